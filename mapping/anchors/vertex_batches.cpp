// A counting sort of the vertices by cell or element, then the connected neighbourhood of each group.
#include "mapping/anchors/vertex_batches.h"

#include "base/bucket.h"
#include "mapping/anchors/blend_weights.h"

namespace flexel::mapping {
namespace {

// Cells are numbered before elements.
std::size_t owner_number(const Body& body, const VertexAnchor& anchor) {
  if (anchor.in_cell && !body.broken[anchor.owner]) return anchor.owner;
  return body.cell_count() +
         (anchor.in_cell ? body.cell_elements[anchor.owner][anchor.octant] : anchor.owner);
}

std::vector<Group> nonempty_groups(const Body& body, const std::vector<std::uint32_t>& begin) {
  const std::size_t cells = body.cell_count();
  const std::vector<std::uint32_t> cell_part = cell_parts(body), element_part = element_parts(body);
  std::vector<Group> groups;
  for (std::size_t owner = 0; owner + 1 < begin.size(); ++owner) {
    if (begin[owner] == begin[owner + 1]) continue;
    Group group;
    group.in_cell = owner < cells;
    group.owner = static_cast<std::uint32_t>(group.in_cell ? owner : owner - cells);
    group.part = group.in_cell ? cell_part[group.owner] : element_part[group.owner];
    group.home = body.lattice_index[group.in_cell ? body.cell_elements[group.owner][0] : group.owner];
    group.begin = begin[owner];
    group.end = begin[owner + 1];
    groups.push_back(group);
  }
  return groups;
}

// Squared distance in spacings of a lattice point from the cell [0, 1]^3.
double squared_distance_from_cell(const Vec3& point) {
  return (point - point.cwiseMax(Vec3::Zero()).cwiseMin(Vec3::Ones())).squaredNorm();
}

struct Found {
  std::vector<std::uint32_t> elements;
  std::vector<std::uint8_t> from;
};

// Appends what `group` reaches; returns how many.
std::size_t append_reach(const Body& body, const Group& group, ReachFinder& finder, int steps, double radius,
                         Found& found) {
  const std::span<const std::uint32_t> anchors = group.in_cell
                                                     ? std::span(body.cell_elements[group.owner])
                                                     : std::span<const std::uint32_t>(&group.owner, 1);
  const Reach& reach = finder.find(anchors, steps);
  const std::size_t before = found.elements.size();
  for (std::size_t i = 0; i < reach.elements.size(); ++i) {
    if (group.in_cell &&
        squared_distance_from_cell(offset(body, group, reach.elements[i])) >= radius * radius)
      continue;
    found.elements.push_back(reach.elements[i]);
    found.from.push_back(reach.from[i]);
  }
  return found.elements.size() - before;
}

void find_reaches(const Body& body, const Adjacency& connections, int steps, double radius, Groups& groups) {
  constexpr std::size_t kGrain = 128;
  const std::size_t n = groups.groups.size();
  std::vector<Found> chunks((n + kGrain - 1) / kGrain);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    ReachFinder finder(connections);
    for (std::size_t g = begin; g < end; ++g)
      groups.groups[g].reach_end =
          append_reach(body, groups.groups[g], finder, steps, radius, chunks[begin / kGrain]);
  });
  std::uint64_t next = 0;
  for (Group& group : groups.groups) {
    group.reach_begin = next;
    next = group.reach_end += next;
  }
  groups.elements.reserve(next);
  groups.from.reserve(next);
  for (Found& chunk : chunks) {
    groups.elements.insert(groups.elements.end(), chunk.elements.begin(), chunk.elements.end());
    groups.from.insert(groups.from.end(), chunk.from.begin(), chunk.from.end());
    chunk = {};
  }
}

}  // namespace

Groups group_vertices(const Body& body, const Adjacency& connections,
                      const std::vector<VertexAnchor>& anchors, int steps, double radius) {
  Buckets<std::uint32_t> buckets =
      sort_into_buckets<std::uint32_t>(body.cell_count() + body.element_count(), [&](const auto& use) {
        for (std::size_t v = 0; v < anchors.size(); ++v)
          use(owner_number(body, anchors[v]), static_cast<std::uint32_t>(v));
      });
  Groups groups;
  groups.vertices = std::move(buckets.values);
  groups.groups = nonempty_groups(body, buckets.begin);
  for (std::uint32_t g = 0; g < groups.groups.size(); ++g)
    for (std::uint32_t begin = groups.groups[g].begin; begin < groups.groups[g].end; begin += Groups::kBlock)
      groups.blocks.push_back({g, begin, std::min(begin + Groups::kBlock, groups.groups[g].end)});
  find_reaches(body, connections, steps, radius, groups);
  return groups;
}

std::array<double, 8> shares(const Group& group, const Vec3& within) {
  if (group.in_cell) return anchor_shares(within);
  return {1, 0, 0, 0, 0, 0, 0, 0};
}

}  // namespace flexel::mapping
