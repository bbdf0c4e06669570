// Elements of a part are sorted by (k, j, i), so that the one in a voxel is found by bisection. The voxels
// around a point are looked at in two goes: the 27 nearest, and the ring around them where the first have
// nothing nearer than the ring could be.
#include "simulate/matter/interpolation_weights.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/math/small_matrices.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/models/cells.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr double kRingBegins = 1.5;  // voxels, from any point of the middle one to a centre in the ring
constexpr double kReach = 2;         // voxels
constexpr double kSameNear = 1e-7;   // voxels: distances that differ by rounding

std::uint32_t part_of_element(const Body& body, std::uint32_t element) {
  std::uint32_t part = 0;
  while (body.parts[part].element_end <= element) ++part;
  return part;
}

auto key(const Index3& at) {
  return std::tuple(at[2], at[1], at[0]);
}

// The first element of the part at a lattice index or behind it, or element_end.
std::uint32_t first_from(const Body& body, const Part& part, const Index3& at) {
  const auto begin = body.lattice_index.begin();
  const auto found = std::lower_bound(begin + part.element_begin, begin + part.element_end, at,
                                      [](const Index3& x, const Index3& y) { return key(x) < key(y); });
  return static_cast<std::uint32_t>(found - begin);
}

// The first element of the part at a lattice index, or element_end.
std::uint32_t first_at(const Body& body, const Part& part, const Index3& at) {
  const std::uint32_t element = first_from(body, part, at);
  return element < part.element_end && body.lattice_index[element] == at ? element : part.element_end;
}

bool is_stray(const Problem& problem, std::uint32_t element) {
  return element < problem.stray_element.size() && problem.stray_element[element];
}

// The neighbour that `element` is connected with in direction `d` of the half-neighbourhood's `bit`, times
// `sign`.
std::optional<std::uint32_t> neighbour(const Body& body, const Part& part, std::uint32_t element,
                                       std::size_t bit, int sign) {
  Index3 at = body.lattice_index[element];
  for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += sign * half_neighbourhood[bit][axis];
  for (std::uint32_t e = first_at(body, part, at); e < part.element_end && body.lattice_index[e] == at; ++e)
    if (body.piece[e] == body.piece[element] && (body.connections[sign > 0 ? element : e] >> bit & 1u))
      return e;
  return std::nullopt;
}

std::vector<std::uint32_t> neighbours(const Problem& problem, const Part& part, std::uint32_t element,
                                      bool along_axes) {
  std::vector<std::uint32_t> found;
  for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
    const Index3& d = half_neighbourhood[bit];
    if ((std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) == 1) != along_axes) continue;
    for (const int sign : {-1, 1})
      if (const auto other = neighbour(problem.body, part, element, bit, sign);
          other && !is_stray(problem, *other))
        found.push_back(*other);
  }
  return found;
}

}  // namespace

InterpolationWeights cell_carrier(const Body& body, const CellPoint& point) {
  return {body.cell_elements[point.cell], point.weights, 8};
}

// Of the voxels from `from` to `to` away from home along the axis that goes farthest, those that are not stray, in the
// order of the elements. A row of voxels is a run of elements.
std::vector<std::uint32_t> NearestElement::elements_around(std::int32_t from, std::int32_t to) const {
  const Body& body = problem_.body;
  const Part& in = body.parts[part_];
  const Index3& home = *home_;
  std::vector<std::uint32_t> found;
  for (std::int32_t k = -to; k <= to; ++k)
    for (std::int32_t j = -to; j <= to; ++j)
      for (std::uint32_t e = first_from(body, in, {home[0] - to, home[1] + j, home[2] + k});
           e < in.element_end; ++e) {
        const Index3& at = body.lattice_index[e];
        const std::int32_t i = at[0] - home[0];
        if (at[2] != home[2] + k || at[1] != home[1] + j || i > to) break;
        if (std::max({std::abs(i), std::abs(j), std::abs(k)}) >= from && !is_stray(problem_, e))
          found.push_back(e);
      }
  return found;
}

std::optional<std::uint32_t> NearestElement::operator()(const Vec3& point, const Vec3& outward) {
  const std::span<const std::uint32_t> found = all(point, outward);
  return found.empty() ? std::nullopt : std::optional(*std::min_element(found.begin(), found.end()));
}

std::span<const std::uint32_t> NearestElement::all(const Vec3& point, const Vec3& outward) {
  const Body& body = problem_.body;
  const Lattice& lattice = body.parts[part_].lattice;
  const Vec3 at = lattice.to_lattice(point);
  const double h = lattice.spacing.mean(), same = kSameNear * h;
  const Index3 home{static_cast<std::int32_t>(std::floor(at[0])),
                    static_cast<std::int32_t>(std::floor(at[1])),
                    static_cast<std::int32_t>(std::floor(at[2]))};
  if (home_ != home) {
    home_ = home;
    near_ = elements_around(0, 1);
    in_ring_.reset();
  }
  tied_.clear();
  double least = kReach * h;
  bool inside = false;
  const double on_surface = same * outward.norm();
  const auto look = [&](std::uint32_t e) {
    const Vec3 way = body.rest[e] - point;
    const bool inward = outward.dot(way) <= on_surface;
    const double distance = way.norm();
    if (distance > kReach * h || (inside && !inward) || (inside == inward && distance > least + same)) return;
    if (inside != inward || distance < least - same) {
      tied_.clear();
      least = distance;
    }
    least = std::min(least, distance);
    tied_.push_back(e);
    inside = inward;
  };
  std::for_each(near_.begin(), near_.end(), look);
  if (inside && least <= kRingBegins * h) return tied_;
  if (!in_ring_) in_ring_ = elements_around(2, 2);
  std::for_each(in_ring_->begin(), in_ring_->end(), look);
  return tied_;
}

std::optional<std::uint32_t> nearest_element(const Problem& problem, std::uint32_t part, const Vec3& point,
                                             const Vec3& outward) {
  return NearestElement(problem, part)(point, outward);
}

SurfaceCarriers::SurfaceCarriers(const Problem& problem, std::uint32_t polygon)
    : problem_(problem), part_(problem.body.surface.polygon_part(polygon)), nearest_(problem, part_) {
  if (problem.body.parts[part_].placement == Placement::corner) locate_.emplace(problem.body, polygon);
}

std::optional<InterpolationWeights> SurfaceCarriers::operator()(const Vec3& point, const Vec3& outward) {
  if (locate_) {
    const auto at = (*locate_)(point);
    if (!at || (at->cell < problem_.stray_cell.size() && problem_.stray_cell[at->cell])) return std::nullopt;
    if (!is_surely_under(problem_.body, *at)) return std::nullopt;
    return cell_carrier(problem_.body, *at);
  }
  const auto element = nearest_(point, outward);
  if (!element) return std::nullopt;
  return InterpolationWeights{{*element}, {1}, 1};
}

std::span<const std::uint32_t> SurfaceCarriers::tied(const Vec3& point, const Vec3& outward) {
  return locate_ ? std::span<const std::uint32_t>() : nearest_.all(point, outward);
}

std::optional<InterpolationWeights> carrier_on_surface(const Problem& problem, std::uint32_t polygon,
                                                       const Vec3& point, const Vec3& outward) {
  return SurfaceCarriers(problem, polygon)(point, outward);
}

InterpolationWeights with_gradient(const Problem& problem, const InterpolationWeights& carrier,
                                   const Vec3& point) {
  if (carrier.count != 1) return carrier;
  const Body& body = problem.body;
  const std::uint32_t element = carrier.elements[0];
  const Part& part = body.parts[part_of_element(body, element)];
  std::vector<std::uint32_t> others = neighbours(problem, part, element, true);
  const auto fit = [&] {
    Mat3 moment = Mat3::Zero();
    for (const std::uint32_t f : others) {
      const Vec3 way = body.rest[f] - body.rest[element];
      moment += way * way.transpose();
    }
    return inverse_on_range(moment);
  };
  std::pair<Mat3, bool> inverse = fit();
  if (!inverse.second) {
    for (const std::uint32_t f : neighbours(problem, part, element, false)) others.push_back(f);
    if (others.size() > 7) others.resize(7);
    inverse = fit();
  }
  InterpolationWeights result{{element}, {1}, 1};
  const Vec3 slope = inverse.first * (point - body.rest[element]);
  for (const std::uint32_t f : others) {
    const double weight = slope.dot(body.rest[f] - body.rest[element]);
    result.elements[result.count] = f;
    result.weights[result.count++] = weight;
    result.weights[0] -= weight;
  }
  return result;
}

namespace {

// `share` (cells) of the voxel's volume, `factor` (elements, or none) at centre placement.
std::vector<double> spread(const Problem& problem, const std::vector<double>& share,
                           const std::vector<double>& factor) {
  const Body& body = problem.body;
  std::vector<double> volume(body.element_count(), 0);
  const std::vector<std::uint8_t> active = sound_cells(problem);
  for (const Part& part : body.parts) {
    const double voxel = part.lattice.spacing.prod();
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (active[c])
        for (const std::uint32_t e : body.cell_elements[c]) volume[e] += share[c] * voxel / 8;
    if (part.placement == Placement::corner) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      if (!is_stray(problem, e)) volume[e] = factor.empty() ? voxel : factor[e] * voxel;
  }
  return volume;
}

}  // namespace

ChangeAround::ChangeAround(const Body& body, const char* column) : factors_(element_factors(body, column)) {
  const std::vector<double> of_cells = cell_factors(body, column);
  if (of_cells.empty()) return;
  factors_.resize(body.element_count(), 1);
  std::vector<double> sum(body.element_count(), 0);
  std::vector<std::uint32_t> around(body.element_count(), 0);
  for (std::size_t c = 0; c < body.cell_count(); ++c) {
    if (body.broken[c]) continue;
    for (const std::uint32_t e : body.cell_elements[c]) {
      sum[e] += of_cells[c];
      ++around[e];
    }
  }
  for (const Part& part : body.parts)
    for (std::uint32_t e = part.element_begin; part.placement == Placement::corner && e < part.element_end;
         ++e)
      if (around[e] > 0) factors_[e] = sum[e] / around[e];
}

double ChangeAround::at(const InterpolationWeights& carrier) const {
  if (factors_.empty()) return 1;
  double sum = 0, total = 0;
  for (std::uint32_t a = 0; a < carrier.count; ++a) {
    const double weight = std::max(carrier.weights[a], 0.0);
    sum += weight * factors_[carrier.elements[a]];
    total += weight;
  }
  return total > 0 ? sum / total : 1;
}

std::vector<double> element_volumes(const Problem& problem) {
  return spread(problem, problem.body.fill, {});
}

std::vector<double> element_masses(const Problem& problem) {
  std::vector<double> mass = spread(problem, mass_shares(problem.body), mass_factors(problem.body));
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p)
    for (std::uint32_t e = problem.body.parts[p].element_begin; e < problem.body.parts[p].element_end; ++e)
      mass[e] *= problem.materials[p].density;
  return mass;
}

}  // namespace flexel::simulate
