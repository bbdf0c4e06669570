// Collects every connection with the cells around it, then lets runs grow block by block of eight elements.
#include "simulate/time/connection_runs.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "formats/body.h"

namespace flexel {
namespace {

using step::ConnectionRun;
using step::kLanes;

// Elements whose connections of all directions are computed one after the other: their state and forces stay
// in the innermost cache.
constexpr std::size_t kGroupBlocks = 32;
constexpr std::int32_t kNone = -1;
constexpr std::uint8_t kAllLanes = 0xff;

// A connection from an element: numbers of the chunk, + kLanes.
struct Link {
  std::int32_t b = kNone;
  std::array<std::int32_t, 4> cell{kNone, kNone, kNone, kNone};  // lowest corners of the cells around it
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

class Builder {
 public:
  Builder(std::span<const std::array<std::uint16_t, 8>> cells, std::span<const double> fill,
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
  void add_runs(std::size_t direction, std::size_t first_block, std::size_t last_block);
  [[nodiscard]] bool holds(const Shape& shape, std::int32_t a, const Link& link) const;
  [[nodiscard]] bool is_empty(const Shape& shape, std::int32_t a) const;
  [[nodiscard]] bool continues(const Shape& shape, const Link* links, std::int32_t a) const;
  // Takes as many of the lanes as share a shape; gives which.
  unsigned take(const Link* links, std::int32_t a, unsigned lanes, Shape& shape) const;
  void add_run(std::size_t direction, std::int32_t a, const Shape& shape, unsigned lanes);

  std::size_t count_, blocks_;
  ConnectionRuns result_;
  std::array<std::vector<Link>, 13> links_;  // by element
  struct Branch {
    std::size_t direction, from;
    Link link;
  };
  std::vector<Branch> branches_;  // what an element has besides: where pieces branch
};

Builder::Builder(std::span<const std::array<std::uint16_t, 8>> cells, std::span<const double> fill,
                 std::size_t count)
    : count_(count), blocks_((count + kLanes - 1) / kLanes) {
  static const std::vector<Pair> pairs = make_pairs();
  if (kLanes + count_ > std::numeric_limits<std::uint16_t>::max())
    throw std::length_error("a chunk has more elements than its numbers can tell apart");
  for (std::vector<Link>& links : links_) links.resize(blocks_ * kLanes);
  // behind the elements' as many zeros as the longest run may read where it has no cell
  result_.fill.assign(2 * kLanes + count + kGroupBlocks * kLanes, 0);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    result_.fill[kLanes + cells[c][0]] = fill[c];
    for (const Pair& pair : pairs) add(pair, cells[c]);
  }
}

void Builder::add(const Pair& pair, const std::array<std::uint16_t, 8>& corners) {
  const auto number = [&](std::size_t corner) { return static_cast<std::int32_t>(kLanes + corners[corner]); };
  const std::size_t from = corners[pair.from];
  const auto accepts = [&](Link& link) {
    if (link.b == kNone) link.b = number(pair.to);
    if (link.b != number(pair.to) || link.cell[pair.slot] != kNone) return false;
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
bool Builder::holds(const Shape& shape, std::int32_t a, const Link& link) const {
  if (link.b != a + shape.b) return false;
  for (std::size_t s = 0; s < 4; ++s) {
    const std::int32_t at = shape.cell[s] == kNoOffset ? kNone : a + shape.cell[s];
    if (link.cell[s] == at) continue;
    if (link.cell[s] != kNone || result_.fill[static_cast<std::size_t>(at)] != 0) return false;
  }
  return true;
}

// Whether it finds no cell there, and so no stiffness.
bool Builder::is_empty(const Shape& shape, std::int32_t a) const {
  return std::all_of(shape.cell.begin(), shape.cell.end(), [&](std::int32_t offset) {
    return offset == kNoOffset || result_.fill[static_cast<std::size_t>(a + offset)] == 0;
  });
}

bool Builder::continues(const Shape& shape, const Link* links, std::int32_t a) const {
  const auto size = static_cast<std::int32_t>(result_.fill.size());
  for (std::int32_t l = 0; l < static_cast<std::int32_t>(kLanes); ++l) {
    for (const std::int32_t offset : shape.cell)
      if (offset != kNoOffset && (a + l + offset < 0 || a + l + offset >= size)) return false;
    if (links[l].b == kNone ? !is_empty(shape, a + l) : !holds(shape, a + l, links[l])) return false;
  }
  return true;
}

unsigned Builder::take(const Link* links, std::int32_t a, unsigned lanes, Shape& shape) const {
  unsigned taken = 0;
  for (unsigned l = 0; l < kLanes; ++l) {
    if (!(lanes >> l & 1)) continue;
    const auto own = a + static_cast<std::int32_t>(l);
    Shape wider = shape;
    if (taken == 0) wider.b = links[l].b - own;
    for (std::size_t s = 0; s < 4; ++s)
      if (links[l].cell[s] != kNone && wider.cell[s] == kNoOffset) wider.cell[s] = links[l].cell[s] - own;
    bool fits = true;
    for (unsigned m = 0; m <= l; ++m)
      if ((taken >> m & 1) || m == l) fits = fits && holds(wider, a + static_cast<std::int32_t>(m), links[m]);
    if (!fits) continue;
    shape = wider;
    taken |= 1U << l;
  }
  return taken;
}

void Builder::add_run(std::size_t direction, std::int32_t a, const Shape& shape, unsigned lanes) {
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

void Builder::add_runs(std::size_t direction, std::size_t first_block, std::size_t last_block) {
  bool open = false;  // the last run may go on
  Shape shape;
  for (std::size_t block = first_block; block < last_block; ++block) {
    const Link* links = links_[direction].data() + block * kLanes;
    const auto a = static_cast<std::int32_t>(kLanes + block * kLanes);
    unsigned left = 0;
    for (unsigned l = 0; l < kLanes; ++l) left |= links[l].b == kNone ? 0U : 1U << l;
    if (left != 0 && open && continues(shape, links, a)) {
      ++result_.runs.back().blocks;
      continue;
    }
    open = left != 0;
    for (bool first = true; left != 0; first = false) {
      shape = {};
      const unsigned taken = take(links, a, left, shape);
      left &= ~taken;
      bool alone = true;  // the other lanes find nothing
      for (unsigned l = 0; l < kLanes; ++l)
        alone = alone && ((taken >> l & 1) || is_empty(shape, a + static_cast<std::int32_t>(l)));
      add_run(direction, a, shape, alone ? kAllLanes : taken);
      open = first && alone;
    }
  }
}

ConnectionRuns Builder::operator()() {
  for (std::size_t block = 0; block < blocks_; block += kGroupBlocks)
    for (std::size_t d = 0; d < links_.size(); ++d)
      add_runs(d, block, std::min(blocks_, block + kGroupBlocks));
  for (const Branch& branch : branches_) {
    std::array<Link, kLanes> links{};
    const std::size_t lane = branch.from % kLanes;
    links[lane] = branch.link;
    Shape shape;
    const auto a = static_cast<std::int32_t>(kLanes + branch.from - lane);
    add_run(branch.direction, a, shape, take(links.data(), a, 1U << lane, shape));
  }
  return std::move(result_);
}

}  // namespace

ConnectionRuns connection_runs(std::span<const std::array<std::uint16_t, 8>> cells,
                               std::span<const double> fill, std::size_t count) {
  return Builder(cells, fill, count)();
}

}  // namespace flexel
