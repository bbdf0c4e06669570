// Collects every connection with the cells around it, then lets runs grow by eight elements at a time.
#include "simulate/kernels/connection_runs.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>

#include "formats/lattice/body.h"

namespace flexel::simulate {
namespace {

using step::ConnectionRun;
using step::kLanes;

// Elements whose connections of all directions are computed one after the other: their state and forces stay
// in the innermost cache.
constexpr std::size_t kGroup = 128;
constexpr std::int32_t kNoElement = -1;
constexpr std::uint8_t kAllLanes = 0xff;

// A connection from an element: numbers of the chunk, + kLanes.
struct Link {
  std::int32_t b = kNoElement;
  std::array<std::int32_t, 4> cell{kNoElement, kNoElement, kNoElement,
                                   kNoElement};  // lowest corners of the cells around it
};

// One of a cell's 28 pairs of corners.
struct Pair {
  std::size_t direction, from, to, slot;  // slot: which of the cells around the connection this one is
};

std::vector<Pair> make_pairs() {
  std::vector<Pair> pairs;
  for (unsigned i = 0; i < 8; ++i)
    for (unsigned j = 0; j < 8; ++j)
      for (std::size_t d = 0; d < half_neighbourhood.size(); ++d) {
        bool leads = true;
        for (unsigned axis = 0; axis < 3; ++axis)
          leads = leads && static_cast<int>(j >> axis & 1) - static_cast<int>(i >> axis & 1) ==
                               half_neighbourhood[d][axis];
        if (!leads) continue;
        std::size_t slot = 0, bit = 0;
        for (unsigned axis = 0; axis < 3; ++axis)
          if (half_neighbourhood[d][axis] == 0) slot |= std::size_t{i >> axis & 1} << bit++;
        pairs.push_back({d, i, j, slot});
      }
  return pairs;
}

class RunBuilder {
 public:
  RunBuilder(std::span<const std::array<std::uint16_t, 8>> cells, std::span<const double> fill,
             std::size_t count);
  ConnectionRuns operator()();

 private:
  // A run as offsets from a to b and to the cells, kNoOffset: no cell there.
  static constexpr std::int32_t kNoOffset = INT32_MIN;
  struct Shape {
    std::int32_t b = 0;
    std::array<std::int32_t, 4> cell{kNoOffset, kNoOffset, kNoOffset, kNoOffset};
  };

  void add(const Pair& pair, const std::array<std::uint16_t, 8>& corners);
  void add_runs(std::size_t direction, std::size_t first, std::size_t last);  // elements
  [[nodiscard]] bool holds(const Shape& shape, std::int32_t a, const Link& link) const;
  [[nodiscard]] bool is_empty(const Shape& shape, std::int32_t a) const;
  [[nodiscard]] bool continues(const Shape& shape, const Link* links, std::int32_t a) const;
  struct Taken {
    Shape shape;
    unsigned lanes = 0;
  };
  // The first connection of the eight and all others that a run of one shape may hold with it.
  [[nodiscard]] Taken take(const Link* links, std::int32_t a) const;
  void add_run(std::size_t direction, std::int32_t a, const Shape& shape, unsigned lanes);

  std::size_t count_;
  ConnectionRuns result_;
  std::array<std::vector<Link>, 13> links_;  // by element
  struct Branch {
    std::size_t direction, from;
    Link link;
  };
  std::vector<Branch> branches_;  // what an element has besides: where pieces branch
};

RunBuilder::RunBuilder(std::span<const std::array<std::uint16_t, 8>> cells, std::span<const double> fill,
                       std::size_t count)
    : count_(count) {
  static const std::vector<Pair> pairs = make_pairs();
  if (kLanes + count_ > std::numeric_limits<std::uint16_t>::max())
    throw std::length_error("a chunk has more elements than its numbers can tell apart");
  for (std::vector<Link>& links : links_) links.resize(count + 2 * kLanes);
  // behind the elements' as many zeros as the longest run may read where it has no cell
  result_.fill.assign(2 * kLanes + count + kGroup, 0);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    result_.fill[kLanes + cells[c][0]] = fill[c];
    for (const Pair& pair : pairs) add(pair, cells[c]);
  }
}

void RunBuilder::add(const Pair& pair, const std::array<std::uint16_t, 8>& corners) {
  const auto number = [&](std::size_t corner) { return static_cast<std::int32_t>(kLanes + corners[corner]); };
  const std::size_t from = corners[pair.from];
  const auto accepts = [&](Link& link) {
    if (link.b == kNoElement) link.b = number(pair.to);
    if (link.b != number(pair.to) || link.cell[pair.slot] != kNoElement) return false;
    link.cell[pair.slot] = number(0);
    return true;
  };
  if (accepts(links_[pair.direction][from])) return;
  for (Branch& branch : branches_)
    if (branch.direction == pair.direction && branch.from == from && accepts(branch.link)) return;
  branches_.push_back({pair.direction, from, {}});
  (void)accepts(branches_.back().link);
}

// Whether a run of that shape finds at `a` this connection's neighbour, its cells and no others.
bool RunBuilder::holds(const Shape& shape, std::int32_t a, const Link& link) const {
  if (link.b != a + shape.b) return false;
  for (std::size_t s = 0; s < 4; ++s) {
    const std::int32_t at = shape.cell[s] == kNoOffset ? kNoElement : a + shape.cell[s];
    if (link.cell[s] == at) continue;
    if (link.cell[s] != kNoElement || result_.fill[static_cast<std::size_t>(at)] != 0) return false;
  }
  return true;
}

// Whether it finds no cell there, and so no stiffness.
bool RunBuilder::is_empty(const Shape& shape, std::int32_t a) const {
  return std::all_of(shape.cell.begin(), shape.cell.end(), [&](std::int32_t offset) {
    return offset == kNoOffset || result_.fill[static_cast<std::size_t>(a + offset)] == 0;
  });
}

// Whether a run may go on over the block that begins with `links`: some connection there, all of that shape.
bool RunBuilder::continues(const Shape& shape, const Link* links, std::int32_t a) const {
  const auto size = static_cast<std::int32_t>(result_.fill.size());
  bool any = false;
  for (std::int32_t l = 0; l < static_cast<std::int32_t>(kLanes); ++l) {
    for (const std::int32_t offset : shape.cell)
      if (offset != kNoOffset && (a + l + offset < 0 || a + l + offset >= size)) return false;
    if (links[l].b == kNoElement ? !is_empty(shape, a + l) : !holds(shape, a + l, links[l])) return false;
    any = any || links[l].b != kNoElement;
  }
  return any;
}

RunBuilder::Taken RunBuilder::take(const Link* links, std::int32_t a) const {
  Shape shape;
  unsigned taken = 0;
  for (unsigned l = 0; l < kLanes; ++l) {
    if (links[l].b == kNoElement) continue;
    const auto own = a + static_cast<std::int32_t>(l);
    Shape wider = shape;
    if (taken == 0) wider.b = links[l].b - own;
    for (std::size_t s = 0; s < 4; ++s)
      if (links[l].cell[s] != kNoElement && wider.cell[s] == kNoOffset)
        wider.cell[s] = links[l].cell[s] - own;
    bool fits = true;
    for (unsigned m = 0; m <= l; ++m)
      if ((taken >> m & 1) || m == l) fits = fits && holds(wider, a + static_cast<std::int32_t>(m), links[m]);
    if (!fits) continue;
    shape = wider;
    taken |= 1U << l;
  }
  return {shape, taken};
}

void RunBuilder::add_run(std::size_t direction, std::int32_t a, const Shape& shape, unsigned lanes) {
  ConnectionRun run{};
  run.a = static_cast<std::uint16_t>(a);
  run.b = static_cast<std::uint16_t>(a + shape.b);
  for (std::size_t s = 0; s < 4; ++s)
    run.cell[s] = static_cast<std::uint16_t>(
        shape.cell[s] == kNoOffset ? static_cast<std::int32_t>(kLanes + count_) : a + shape.cell[s]);
  run.blocks = 1;
  run.direction = static_cast<std::uint8_t>(direction);
  run.lanes = static_cast<std::uint8_t>(lanes);
  result_.runs.push_back(run);
}

// From the first connection that is left: a run from there, or one that begins at a multiple of eight where
// that takes as many or goes on, for aligned loads are cheaper.
void RunBuilder::add_runs(std::size_t direction, std::size_t first, std::size_t last) {
  Link* links = links_[direction].data();
  const auto number = [](std::size_t element) { return static_cast<std::int32_t>(kLanes + element); };
  for (std::size_t e = first; e < last;) {
    if (links[e].b == kNoElement) {
      ++e;
      continue;
    }
    std::size_t begin = e / kLanes * kLanes;
    Taken taken = take(links + begin, number(begin));
    if (begin != e && !continues(taken.shape, links + begin + kLanes, number(begin + kLanes)))
      if (const Taken own = take(links + e, number(e));
          std::popcount(own.lanes) > std::popcount(taken.lanes)) {
        taken = own;
        begin = e;
      }
    bool alone = true;  // the other lanes find nothing
    for (unsigned l = 0; l < kLanes; ++l)
      if (taken.lanes >> l & 1) {
        links[begin + l] = {};
      } else {
        alone = alone && is_empty(taken.shape, number(begin + l));
      }
    add_run(direction, number(begin), taken.shape, alone ? kAllLanes : taken.lanes);
    for (begin += kLanes; alone && begin < last && continues(taken.shape, links + begin, number(begin));
         begin += kLanes) {
      ++result_.runs.back().blocks;
      std::fill(links + begin, links + begin + kLanes, Link{});
    }
  }
}

ConnectionRuns RunBuilder::operator()() {
  for (std::size_t first = 0; first < count_; first += kGroup)
    for (std::size_t d = 0; d < links_.size(); ++d) add_runs(d, first, std::min(count_, first + kGroup));
  for (const Branch& branch : branches_) {
    std::array<Link, kLanes> links{};
    const std::size_t lane = branch.from % kLanes;
    links[lane] = branch.link;
    const auto a = static_cast<std::int32_t>(kLanes + branch.from - lane);
    const Taken taken = take(links.data(), a);
    add_run(branch.direction, a, taken.shape, taken.lanes);
  }
  return std::move(result_);
}

}  // namespace

ConnectionRuns connection_runs(std::span<const std::array<std::uint16_t, 8>> cells,
                               std::span<const double> fill, std::size_t count) {
  return RunBuilder(cells, fill, count)();
}

}  // namespace flexel::simulate
