// Aggregation by lattice blocks. Nodes are sorted by (part, block); within a block a search along strong
// links finds its connected pieces, so that neighbouring walls that meet in a block stay apart. Pieces too
// small to carry six rigid motions join the neighbour with most links, one by one in order (few are that
// small, so this part is serial). All else runs in parallel over nodes, blocks or aggregates, each result
// written by one of them.
#include "simulate/linear/aggregate.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "base/math/parallel_sort.h"
#include "base/parallel.h"

namespace flexel::simulate {
namespace {

// Offsets (n + 1) from the counts stored in offsets[1..n].
template <class Integer>
void accumulate_counts(std::vector<Integer>& offsets) {
  std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
}

// Even partition of a part's index range into blocks, per axis.
struct Blocks {
  Index3 low, extent, count;
  [[nodiscard]] Index3 of(const Index3& index) const {
    Index3 block{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto offset = static_cast<std::int64_t>(index[a]) - low[a];
      block[a] = static_cast<std::int32_t>(offset * count[a] / extent[a]);
    }
    return block;
  }
};

std::vector<Blocks> part_blocks(const LevelNodes& nodes, int width) {
  std::uint32_t parts = 0;
  for (const std::uint32_t part : nodes.part) parts = std::max(parts, part + 1);
  constexpr auto kMost = std::numeric_limits<std::int32_t>::max();
  std::vector<Blocks> blocks(parts, {{kMost, kMost, kMost}, {-kMost, -kMost, -kMost}, {1, 1, 1}});
  for (std::size_t i = 0; i < nodes.index.size(); ++i) {
    Blocks& part = blocks[nodes.part[i]];
    for (std::size_t a = 0; a < 3; ++a) {
      part.low[a] = std::min(part.low[a], nodes.index[i][a]);
      part.extent[a] = std::max(part.extent[a], nodes.index[i][a]);
    }
  }
  for (Blocks& part : blocks) {
    for (std::size_t a = 0; a < 3; ++a) {
      part.extent[a] = part.extent[a] < part.low[a] ? 1 : part.extent[a] - part.low[a] + 1;
      part.count[a] = std::max(1, (part.extent[a] + 1) / width);
    }
  }
  return blocks;
}

// Nodes sorted by (part, block z, y, x, node), and where each block begins.
struct SortedBlocks {
  std::vector<Index3> block;         // (nodes)
  std::vector<std::uint32_t> order;  // (nodes)
  std::vector<std::uint32_t> group;  // (nodes) number of the node's block
  std::vector<std::uint32_t> begin;  // (blocks + 1) into order
};

SortedBlocks sort_into_blocks(const LevelNodes& nodes, int width) {
  const std::size_t n = nodes.index.size();
  const std::vector<Blocks> blocks = part_blocks(nodes, width);
  SortedBlocks sorted{
      std::vector<Index3>(n), std::vector<std::uint32_t>(n), std::vector<std::uint32_t>(n), {}};
  parallel_for_each(n, [&](std::size_t i) { sorted.block[i] = blocks[nodes.part[i]].of(nodes.index[i]); });
  std::iota(sorted.order.begin(), sorted.order.end(), 0u);
  const auto compare = [&](std::uint32_t a, std::uint32_t b) {
    if (nodes.part[a] != nodes.part[b]) return nodes.part[a] < nodes.part[b] ? -1 : 1;
    for (std::size_t axis : {2u, 1u, 0u}) {
      if (sorted.block[a][axis] != sorted.block[b][axis])
        return sorted.block[a][axis] < sorted.block[b][axis] ? -1 : 1;
    }
    return 0;
  };
  parallel_sort(sorted.order.begin(), sorted.order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int sign = compare(a, b);
    return sign != 0 ? sign < 0 : a < b;
  });
  for (std::size_t s = 0; s < n; ++s) {
    if (s == 0 || compare(sorted.order[s - 1], sorted.order[s]) != 0)
      sorted.begin.push_back(static_cast<std::uint32_t>(s));
    sorted.group[sorted.order[s]] = static_cast<std::uint32_t>(sorted.begin.size() - 1);
  }
  sorted.begin.push_back(static_cast<std::uint32_t>(n));
  return sorted;
}

// Labels the connected pieces of each block 0, 1, ... in order of their first node; returns the number of
// pieces per block.
std::vector<std::uint32_t> label_pieces(const SortedBlocks& sorted, const Links& links, const Links& strong,
                                        bool drop_isolated, std::vector<std::uint32_t>& label) {
  const std::size_t groups = sorted.begin.size() - 1;
  std::vector<std::uint32_t> pieces(groups, 0);
  constexpr std::uint32_t kUnseen = kNoAggregate - 1;
  label.assign(sorted.order.size(), kUnseen);
  parallel_chunks(groups, 64, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> stack;
    for (std::size_t g = begin; g < end; ++g) {
      for (std::uint32_t s = sorted.begin[g]; s < sorted.begin[g + 1]; ++s) {
        const std::uint32_t seed = sorted.order[s];
        if (label[seed] != kUnseen) continue;
        if (drop_isolated && !links.any(seed)) {
          label[seed] = kNoAggregate;
          continue;
        }
        label[seed] = pieces[g];
        stack.assign(1, seed);
        while (!stack.empty()) {
          const std::uint32_t node = stack.back();
          stack.pop_back();
          strong.for_each(node, [&](std::uint32_t other) {
            if (sorted.group[other] != g || label[other] != kUnseen) return;
            label[other] = pieces[g];
            stack.push_back(other);
          });
        }
        ++pieces[g];
      }
    }
  });
  return pieces;
}

struct Members {
  std::vector<std::uint32_t> begin;  // (aggregates + 1)
  std::vector<std::uint32_t> nodes;  // ascending within an aggregate
  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t a) const {
    return {nodes.data() + begin[a], begin[a + 1] - begin[a]};
  }
};

Members members_of(const std::vector<std::uint32_t>& of, std::size_t count) {
  Members members{std::vector<std::uint32_t>(count + 1, 0), {}};
  for (const std::uint32_t a : of) {
    if (a != kNoAggregate) ++members.begin[a + 1];
  }
  accumulate_counts(members.begin);
  members.nodes.resize(members.begin.back());
  std::vector<std::uint32_t> next(members.begin.begin(), members.begin.end() - 1);
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (of[i] != kNoAggregate) members.nodes[next[of[i]]++] = static_cast<std::uint32_t>(i);
  }
  return members;
}

// Joins aggregates under `smallest` nodes to the neighbour of the same part with most links. Renumbers
// without gaps; returns the number left.
std::size_t join_small(const LevelNodes& nodes, const Links& links, std::size_t smallest, std::size_t count,
                       std::vector<std::uint32_t>& of) {
  const Members members = members_of(of, count);
  std::vector<std::uint32_t> root(count);
  std::vector<std::size_t> size(count);
  std::iota(root.begin(), root.end(), 0u);
  for (std::size_t a = 0; a < count; ++a) size[a] = members.of(a).size();
  const auto find = [&](std::uint32_t a) {
    while (root[a] != a) a = root[a] = root[root[a]];
    return a;
  };
  for (std::uint32_t a = 0; a < count; ++a) {
    // An aggregate that others joined keeps its own number; it is small only while its sum is.
    if (root[a] != a || size[a] >= smallest) continue;
    std::map<std::uint32_t, std::size_t> votes;
    for (const std::uint32_t node : members.of(a)) {
      links.for_each(node, [&](std::uint32_t other) {
        if (of[other] == kNoAggregate || nodes.part[other] != nodes.part[node]) return;
        const std::uint32_t target = find(of[other]);
        if (target != a) ++votes[target];
      });
    }
    const auto best = std::max_element(votes.begin(), votes.end(),
                                       [](const auto& x, const auto& y) { return x.second < y.second; });
    if (best == votes.end()) continue;
    root[a] = best->first;
    size[best->first] += size[a];
  }
  std::vector<std::uint32_t> number(count, kNoAggregate);
  std::uint32_t left = 0;
  for (std::uint32_t a = 0; a < count; ++a) {
    if (root[a] == a) number[a] = left++;
  }
  for (std::uint32_t& a : of) {
    if (a != kNoAggregate) a = number[find(a)];
  }
  return left;
}

LevelNodes aggregate_nodes(const LevelNodes& fine, const std::vector<Index3>& block, const Members& members) {
  const std::size_t count = members.begin.size() - 1;
  LevelNodes nodes{std::vector<Index3>(count), std::vector<std::uint32_t>(count), std::vector<Vec3>(count),
                   std::vector<double>(count)};
  parallel_for_each(count, [&](std::size_t a) {
    const auto list = members.of(a);
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t node : list) sum += fine.position[node];
    nodes.index[a] = block[list.front()];
    nodes.part[a] = fine.part[list.front()];
    nodes.position[a] = sum / static_cast<double>(list.size());
    double reach = 0;
    for (const std::uint32_t node : list) {
      reach = std::max(reach, (fine.position[node] - nodes.position[a]).norm() + fine.reach[node]);
    }
    nodes.reach[a] = reach > 0 ? reach : 1;
  });
  return nodes;
}

Graph quotient_graph(const Links& links, const std::vector<std::uint32_t>& of, const Members& members) {
  const std::size_t count = members.begin.size() - 1;
  std::vector<std::vector<std::uint32_t>> rows(count);
  parallel_for_each(
      count,
      [&](std::size_t a) {
        std::vector<std::uint32_t>& row = rows[a];
        for (const std::uint32_t node : members.of(a)) {
          links.for_each(node, [&](std::uint32_t other) {
            const std::uint32_t b = of[other];
            if (b != a && b != kNoAggregate && (row.empty() || row.back() != b)) row.push_back(b);
          });
        }
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        row.shrink_to_fit();
      },
      64);
  Graph graph{std::vector<std::uint64_t>(count + 1, 0), {}};
  for (std::size_t a = 0; a < count; ++a) graph.offsets[a + 1] = graph.offsets[a] + rows[a].size();
  graph.neighbours.reserve(graph.offsets.back());
  for (const auto& row : rows) graph.neighbours.insert(graph.neighbours.end(), row.begin(), row.end());
  return graph;
}

}  // namespace

std::vector<std::uint8_t> link_strengths(const LinearOperator& matrix, std::span<const double> thresholds) {
  const std::size_t n = matrix.rows();
  const auto offsets = matrix.row_offsets();
  const auto columns = matrix.columns();
  std::vector<double> size(n);
  {
    const std::vector<Block> diagonal = matrix.diagonal();
    parallel_for_each(n, [&](std::size_t i) { size[i] = diagonal[i].norm(); });
  }
  std::vector<std::uint8_t> strength(columns.size(), 0);
  parallel_chunks(n, 256, [&](std::size_t begin, std::size_t end) {
    thread_local std::vector<Block> room;
    const Block* block = matrix.blocks(begin, end, room);
    for (std::size_t i = begin; i < end; ++i)
      for (std::uint64_t q = offsets[i]; q < offsets[i + 1]; ++q) {
        const std::uint32_t j = columns[q];
        const double squared = (block++)->squaredNorm(), scale = size[i] * size[j];
        for (const double t : thresholds) strength[q] += j != i && squared > t * t * scale;
      }
  });
  return strength;
}

Aggregates aggregate(const LevelNodes& nodes, const Links& links, const Links& strong,
                     const AggregateOptions& options) {
  Aggregates result;
  const SortedBlocks sorted = sort_into_blocks(nodes, options.width);
  const std::vector<std::uint32_t> pieces =
      label_pieces(sorted, links, strong, options.drop_isolated, result.of);
  std::vector<std::uint32_t> first(pieces.size() + 1, 0);
  for (std::size_t g = 0; g < pieces.size(); ++g) first[g + 1] = first[g] + pieces[g];
  for (std::size_t i = 0; i < result.of.size(); ++i) {
    if (result.of[i] != kNoAggregate) result.of[i] += first[sorted.group[i]];
  }
  const std::size_t count = join_small(nodes, links, options.smallest, first.back(), result.of);
  const Members members = members_of(result.of, count);
  result.nodes = aggregate_nodes(nodes, sorted.block, members);
  result.links = quotient_graph(links, result.of, members);
  return result;
}

}  // namespace flexel::simulate
