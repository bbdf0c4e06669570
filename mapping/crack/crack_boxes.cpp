// Boxes are a sorted list of packed indices: those of the elements and those that the surface touches, found
// by halving the range of each triangle until it misses the triangle's plane or is a few boxes.
#include "mapping/crack/crack_boxes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>

#include "base/error.h"
#include "mapping/anchors/nearest.h"

namespace flexel::mapping {
namespace {

constexpr int kBits = 21;
constexpr std::int64_t kOffset = std::int64_t{1} << (kBits - 1);

// True when the box of `range` (a little grown) has corners on both sides of the triangle's plane.
bool meets_plane(const BoxRange& range, const Vec3& shift, const Vec3& normal, const Vec3& point) {
  Vec3 middle, half;
  for (int a = 0; a < 3; ++a) {
    middle[a] = 0.5 * (range.low[a] + range.high[a]) + shift[a];
    half[a] = 0.5 * (range.high[a] - range.low[a] + 1) + 1e-6;
  }
  return std::abs(normal.dot(middle - point)) <= normal.cwiseAbs().dot(half);
}

// visit(index) for boxes of `range` that the triangle with this plane may touch.
template <class Visit>
void for_each_touched(const BoxRange& range, const Vec3& shift, const Vec3& normal, const Vec3& point,
                      const Visit& visit) {
  if (!meets_plane(range, shift, normal, point)) return;
  int longest = 0;
  for (int a = 1; a < 3; ++a)
    if (range.high[a] - range.low[a] > range.high[longest] - range.low[longest]) longest = a;
  const int size = range.high[longest] - range.low[longest];
  if (size == 0) return visit(range.low);
  BoxRange below = range, above = range;
  below.high[longest] = range.low[longest] + size / 2;
  above.low[longest] = below.high[longest] + 1;
  for_each_touched(below, shift, normal, point, visit);
  for_each_touched(above, shift, normal, point, visit);
}

}  // namespace

std::uint64_t CrackBoxes::key(std::int64_t slow, std::int64_t middle, std::int64_t fast) const {
  const auto pack = [](std::int64_t i) {
    return static_cast<std::uint64_t>(std::clamp<std::int64_t>(i + kOffset, 0, 2 * kOffset - 1));
  };
  return pack(slow) << (2 * kBits) | pack(middle) << kBits | pack(fast);
}

void CrackBoxes::add_surface_boxes(const std::vector<std::array<Vec3, 3>>& triangles,
                                   std::vector<std::uint64_t>& keys) const {
  for (const std::array<Vec3, 3>& corner : triangles) {
    BoxRange range;
    for (int a = 0; a < 3; ++a) {
      range.low[a] = box_of(a, std::min({corner[0][a], corner[1][a], corner[2][a]}));
      range.high[a] = box_of(a, std::max({corner[0][a], corner[1][a], corner[2][a]}));
    }
    const Vec3 normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    for_each_touched(range, shift_, normal, corner[0],
                     [&](const Index3& index) { keys.push_back(key(index[2], index[1], index[0])); });
  }
}

// Elements at one index follow each other.
template <class Visit>
void CrackBoxes::for_each_owner(std::uint32_t box, const Visit& visit) const {
  const std::uint32_t first = owner_[box];
  const std::uint32_t end = body_.parts[fragments_.list[fragments_.of[first]].part].element_end;
  for (std::uint32_t e = first; e < end && body_.lattice_index[e] == body_.lattice_index[first]; ++e)
    visit(e);
}

std::uint32_t CrackBoxes::owner_in(std::uint32_t box, std::uint32_t fragment) const {
  std::uint32_t found = kNoBox;
  for_each_owner(box, [&](std::uint32_t e) {
    if (found == kNoBox && fragments_.of[e] == fragment) found = e;
  });
  return found;
}

// Of leaves that share a box all have to be parted.
bool CrackBoxes::parted_boxes(std::uint32_t box, std::uint32_t next) const {
  bool any = false, joined = false;
  for_each_owner(box, [&](std::uint32_t a) {
    for_each_owner(next, [&](std::uint32_t b) {
      any = any || parted_.contains(a, b);
      joined = joined || parted_.connected(a, b);
    });
  });
  return any && !joined;
}

CrackBoxes::CrackBoxes(const Body& body, std::uint32_t part, const Components& fragments,
                       const PartedPairs& parted, const Vec3& shift,
                       const std::vector<std::array<Vec3, 3>>& triangles)
    : body_(body), fragments_(fragments), parted_(parted), shift_(shift) {
  const Part& of = body.parts[part];
  for (std::uint32_t e = of.element_begin; e < of.element_end; ++e)
    for (const std::int32_t i : body.lattice_index[e])
      if (std::abs(static_cast<std::int64_t>(i)) + 8 > kOffset)
        throw InputError("the lattice of part \"" + of.name + "\" is too long for --crack open and cap");
  for (std::uint32_t e = of.element_begin; e < of.element_end; ++e) {
    const Index3& index = body.lattice_index[e];
    keys_.push_back(key(index[2], index[1], index[0]));
  }
  std::vector<std::uint64_t> own(keys_);
  add_surface_boxes(triangles, keys_);
  std::sort(keys_.begin(), keys_.end());
  keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
  const auto unpack = [](std::uint64_t k, int place) {
    return static_cast<std::int32_t>(
        static_cast<std::int64_t>(k >> (place * kBits) & ((std::uint64_t{1} << kBits) - 1)) - kOffset);
  };
  owner_.resize(keys_.size());
  fragment_.resize(keys_.size());
  const ElementGrid grid(body, part);
  const double half = of.placement == Placement::centre ? 0.5 : 0;
  for (std::size_t box = 0; box < keys_.size(); ++box) {
    const auto at = std::lower_bound(own.begin(), own.end(), keys_[box]);
    if (at != own.end() && *at == keys_[box])
      owner_[box] = of.element_begin + static_cast<std::uint32_t>(at - own.begin());
    else
      owner_[box] = grid.nearest(of.lattice.to_world(
          Vec3(unpack(keys_[box], 0), unpack(keys_[box], 1), unpack(keys_[box], 2)) + Vec3::Constant(half)));
    fragment_[box] = fragments.of[owner_[box]];
    for_each_owner(static_cast<std::uint32_t>(box), [&](std::uint32_t e) {
      if (fragments.of[e] != fragments.of[owner_[box]]) fragment_[box] = kMixed;
    });
  }
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t box = 0; box < keys_.size(); ++box) {
      const Index3 low{unpack(keys_[box], 0), unpack(keys_[box], 1), unpack(keys_[box], 2)};
      Index3 high = low;
      ++high[axis];
      const std::uint32_t next = find(high);
      if (next == kNoBox || (fragment_[next] == fragment_[box] && fragment_[box] != kMixed &&
                             !parted_boxes(static_cast<std::uint32_t>(box), next)))
        continue;
      squares_.push_back({axis, low});
      square_keys_[axis].push_back(key(low[axis], low[(axis + 1) % 3], low[(axis + 2) % 3]));
    }
  for (std::vector<std::uint64_t>& sorted : square_keys_) std::sort(sorted.begin(), sorted.end());
}

std::uint32_t CrackBoxes::find(const Index3& index) const {
  const std::uint64_t wanted = key(index[2], index[1], index[0]);
  const auto at = std::lower_bound(keys_.begin(), keys_.end(), wanted);
  return at != keys_.end() && *at == wanted ? static_cast<std::uint32_t>(at - keys_.begin()) : kNoBox;
}

bool CrackBoxes::is_square(int axis, const Index3& low) const {
  return std::binary_search(square_keys_[axis].begin(), square_keys_[axis].end(),
                            key(low[axis], low[(axis + 1) % 3], low[(axis + 2) % 3]));
}

CrackBoxes::Face CrackBoxes::face(int axis, const Index3& low) const {
  if (!is_square(axis, low)) return Face::whole;
  Index3 high = low;
  ++high[axis];
  const std::uint32_t below = fragment_[find(low)], above = fragment_[find(high)];
  if (below == kMixed || above == kMixed) return Face::mixed;
  return below == above ? Face::inside : Face::fragments;
}

std::array<Index3, 4> CrackBoxes::around_line(int along, int p, int q, int at) const {
  const int first = along == 0 ? 1 : 0, second = along == 2 ? 1 : 2;
  std::array<Index3, 4> index{};
  for (int k = 0; k < 4; ++k) {
    index[k][along] = at;
    index[k][first] = p + (k & 1);
    index[k][second] = q + (k >> 1);
  }
  return index;
}

std::optional<CrackBoxes::Sectors> CrackBoxes::sectors(int along, int p, int q, int at) const {
  const int first = along == 0 ? 1 : 0, second = along == 2 ? 1 : 2;
  const std::array<Index3, 4> index = around_line(along, p, q, at);
  std::array<bool, 4> matter{};
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t box = find(index[k]);
    matter[k] = box != kNoBox;
    if (matter[k] && fragment_[box] == kMixed) return std::nullopt;
  }
  Sectors sector{0, 1, 2, 3};
  const auto join = [&](int low, int high, int axis) {
    if (!matter[low] || !matter[high] || is_square(axis, index[low])) return;
    const std::uint8_t from = std::max(sector[low], sector[high]), to = std::min(sector[low], sector[high]);
    std::replace(sector.begin(), sector.end(), from, to);
  };
  join(0, 1, first);
  join(2, 3, first);
  join(0, 2, second);
  join(1, 3, second);
  return sector;
}

bool CrackBoxes::touches_itself(int along, int p, int q, int at) const {
  const std::optional<Sectors> sector = sectors(along, p, q, at);
  if (!sector) return true;  // it may
  const std::array<Index3, 4> index = around_line(along, p, q, at);
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < a; ++b) {
      const std::uint32_t one = find(index[a]), other = find(index[b]);
      if (one != kNoBox && other != kNoBox && (*sector)[a] != (*sector)[b] &&
          fragment_[one] == fragment_[other])
        return true;
    }
  return false;
}

bool CrackBoxes::has_square(int axis, int plane, const BoxRange& range) const {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  const std::vector<std::uint64_t>& keys = square_keys_[axis];
  const std::uint64_t last = key(plane, range.high[b], range.high[c]);
  std::uint64_t from = key(plane, range.low[b], range.low[c]);
  while (from <= last) {
    const auto at = std::lower_bound(keys.begin(), keys.end(), from);
    if (at == keys.end() || *at > last) return false;
    // In the row of `at`: within the range, before it, or beyond it, which leads to the next row.
    const std::uint64_t row = *at >> kBits << kBits;
    const std::uint64_t low = row | (key(0, 0, range.low[c]) & ((std::uint64_t{1} << kBits) - 1));
    const std::uint64_t high = row | (key(0, 0, range.high[c]) & ((std::uint64_t{1} << kBits) - 1));
    if (*at >= low && *at <= high) return true;
    from = *at < low ? low : low + (std::uint64_t{1} << kBits);
  }
  return false;
}

CrackBoxes::Plane CrackBoxes::find_cut(const BoxRange& range) const {
  std::array<int, 3> axes{0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(),
                   [&](int a, int b) { return range.high[a] - range.low[a] > range.high[b] - range.low[b]; });
  for (const int axis : axes) {
    const int count = range.high[axis] - range.low[axis], middle = range.low[axis] + (count - 1) / 2;
    // From the middle outwards.
    for (int step = 0; step < 2 * count; ++step) {
      const int plane = middle + (step % 2 ? (step + 1) / 2 : -(step / 2));
      if (plane < range.low[axis] || plane >= range.high[axis]) continue;
      if (has_square(axis, plane, range)) return {axis, plane};
    }
  }
  return {};
}

}  // namespace flexel::mapping
