// What mapping/methods/blend.h evaluates for vertices, in double precision and with derivatives. With v_e the motion
// of element e continued to x and W the sum of the weights, u = sum w_e v_e / W and
//   grad u = (sum v_e grad(w_e)^T + sum w_e G_e - u grad(W)^T) / W.
#include "mapping/methods/space_map.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "formats/lattice/locate.h"
#include "mapping/anchors/blend_weights.h"

namespace flexel::mapping {
namespace {

// Share of the corners of a cell that reach an element, with its gradient by spacings.
struct Share {
  double value = 1;
  Vec3 gradient = Vec3::Zero();
};

Share share_of(std::uint8_t from, const Vec3& within) {
  constexpr std::uint8_t kAll = 0xff;
  if (from == kAll) return {};
  Share sum{0, Vec3::Zero()};
  for (unsigned a = 0; a < 8; ++a) {
    if ((from >> a & 1) == 0) continue;
    std::array<double, 3> value{}, slope{};
    for (unsigned axis = 0; axis < 3; ++axis) {
      const double step = smooth_step(within[axis]), rise = smooth_step_slope(within[axis]);
      const bool high = a >> axis & 1;
      value[axis] = high ? step : 1 - step;
      slope[axis] = high ? rise : -rise;
    }
    sum.value += value[0] * value[1] * value[2];
    sum.gradient +=
        Vec3(slope[0] * value[1] * value[2], value[0] * slope[1] * value[2], value[0] * value[1] * slope[2]);
  }
  return sum;
}

// From a cell of the point `at`, in lattice coordinates, in spacings.
double squared_distance(const Body& body, std::uint32_t cell, const Vec3& at) {
  const Index3& index = body.lattice_index[body.cell_elements[cell][0]];
  const Vec3 within = at - Vec3(index[0], index[1], index[2]);
  return (within - within.cwiseMax(Vec3::Zero()).cwiseMin(Vec3::Ones())).squaredNorm();
}

}  // namespace

SpaceMap::SpaceMap(const Body& body) : body_(body), connections_(element_adjacency(body)) {
  for (const Part& part : body.parts)
    if (part.element_begin == part.element_end)
      throw InputError("part \"" + part.name + "\" has no elements: voxelize it with a smaller --size");
  for (std::uint32_t part = 0; part < body.parts.size(); ++part)
    grids_.push_back(std::make_unique<ElementGrid>(body, part));
  std::vector<std::uint32_t> all(body.element_count());
  std::iota(all.begin(), all.end(), 0u);
  motions_ =
      element_motions(find_moving_elements(body, connections_, all), body, connections_, body.position);
  cells_of_ = sort_into_buckets<std::uint32_t>(body.element_count(), [&](const auto& use) {
    for (std::uint32_t c = 0; c < body.cell_count(); ++c)
      for (const std::uint32_t element : body.cell_elements[c]) use(element, c);
  });
}

Group SpaceMap::group_at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon) const {
  Group group;
  group.part = part;
  const std::uint32_t element = grids_[part]->nearest(x);
  const auto take = [&](std::uint32_t owner, bool in_cell) {
    group.owner = owner;
    group.in_cell = in_cell;
    group.home = body_.lattice_index[in_cell ? body_.cell_elements[owner][0] : owner];
  };
  take(element, false);
  if (body_.parts[part].placement == Placement::centre) return group;
  if (polygon)
    if (const std::optional<CellPoint> under = locate_on_surface(body_, *polygon, x)) {
      if (!body_.broken[under->cell]) take(under->cell, true);
      return group;
    }
  // The nearest element is a corner of the voxel that x lies in, where that is a cell.
  const Vec3 u = body_.parts[part].lattice.to_lattice(x);
  double least = 1e300;
  for (std::uint32_t i = cells_of_.begin[element]; i < cells_of_.begin[element + 1]; ++i) {
    const std::uint32_t cell = cells_of_.values[i];
    const double distance = squared_distance(body_, cell, u);
    if (distance >= least) continue;
    least = distance;
    body_.broken[cell] ? take(element, false) : take(cell, true);
  }
  return group;
}

SpaceMap::Value SpaceMap::Probe::at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon) {
  return blend<true>(reached(map_.group_at(x, part, polygon)), x);
}

SpaceMap::Value SpaceMap::Probe::place(const Vec3& x, std::uint32_t part,
                                       std::optional<std::size_t> polygon) {
  return blend<false>(reached(map_.group_at(x, part, polygon)), x);
}

std::optional<std::uint32_t> SpaceMap::Probe::cell_at(const Vec3& x, std::uint32_t part,
                                                      std::optional<std::size_t> polygon) const {
  const Group group = map_.group_at(x, part, polygon);
  return group.in_cell ? std::optional(group.owner) : std::nullopt;
}

const SpaceMap::Probe::Reached& SpaceMap::Probe::reached(const Group& group) {
  constexpr std::size_t kMost = 256;  // some 1.5 MB, for each thread that asks
  if (last_ != nullptr && group.owner == last_->group.owner && group.in_cell == last_->group.in_cell)
    return *last_;
  if (reached_.size() >= kMost) reached_.clear();
  const auto [found, is_new] = reached_.try_emplace(2 * std::uint64_t{group.owner} + (group.in_cell ? 1 : 0));
  Reached& near = found->second;
  last_ = &near;
  if (!is_new) return near;
  const Body& body = map_.body_;
  const Reach& reach =
      finder_.find(group.in_cell ? std::span<const std::uint32_t>(body.cell_elements[group.owner])
                                 : std::span<const std::uint32_t>(&group.owner, 1),
                   kBlendSteps);
  near.group = group;
  near.elements = reach.elements;
  near.from = reach.from;
  if (!group.in_cell) std::fill(near.from.begin(), near.from.end(), std::uint8_t{0xff});
  for (const std::uint32_t element : near.elements) near.offset.push_back(offset(body, group, element));
  return near;
}

template <bool kGradient>
SpaceMap::Value SpaceMap::Probe::blend(const Reached& near, const Vec3& x) const {
  const Body& body = map_.body_;
  const Lattice& lattice = body.parts[near.group.part].lattice;
  const Vec3 point = within(body, near.group, x);
  double total = 0;
  Vec3 sum = Vec3::Zero(), total_gradient = Vec3::Zero();  // weights' gradients: by spacings
  Mat3 outer = Mat3::Zero(), inner = Mat3::Zero();
  for (std::size_t i = 0; i < near.elements.size(); ++i) {
    const Vec3 away = point - near.offset[i];
    const double square = away.squaredNorm();
    if (square >= kBlendRadius * kBlendRadius) continue;
    const double r = std::sqrt(square) / kBlendRadius;
    const Share share = share_of(near.from[i], point);
    const double weight = wendland(r) * share.value;
    const ElementMotion& motion = map_.motions_[near.elements[i]];
    const Vec3 moved = motion.displacement + motion.gradient * (x - body.rest[near.elements[i]]);
    total += weight;
    sum += weight * moved;
    if constexpr (kGradient) {
      const Vec3 slope = -20 * (1 - r) * (1 - r) * (1 - r) / (kBlendRadius * kBlendRadius) * away;
      const Vec3 weight_gradient = slope * share.value + wendland(r) * share.gradient;
      total_gradient += weight_gradient;
      outer += moved * weight_gradient.transpose();
      inner += weight * motion.gradient;
    }
  }
  if (!(total > 0)) return nearest(near, x);
  const Vec3 u = sum / total;
  Value value{x + u, Mat3::Identity(), true, total};
  if constexpr (kGradient) {
    const Mat3 to_spacings = lattice.spacing.cwiseInverse().asDiagonal() * lattice.axes.transpose();
    value.gradient += (inner + (outer - u * total_gradient.transpose()) * to_spacings) / total;
  }
  return value;
}

SpaceMap::Value SpaceMap::Probe::nearest(const Reached& near, const Vec3& x) const {
  const Body& body = map_.body_;
  std::uint32_t best = near.elements[0];
  for (std::size_t a = 0; a < (near.group.in_cell ? 8u : 1u); ++a)
    if ((body.rest[near.elements[a]] - x).squaredNorm() < (body.rest[best] - x).squaredNorm())
      best = near.elements[a];
  const ElementMotion& motion = map_.motions_[best];
  return {x + motion.displacement + motion.gradient * (x - body.rest[best]),
          Mat3::Identity() + motion.gradient, false};
}

}  // namespace flexel::mapping
