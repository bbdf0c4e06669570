// Elements of a part are sorted by (k, j, i), so that the one in a voxel is found by bisection. The voxels
// around a point are looked at in two goes: the 27 nearest, and the ring around them where the first have
// nothing nearer than the ring could be.
#include "simulate/carrier.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "simulate/cells.h"
#include "simulate/rest_shape.h"
#include "simulate/small_matrices.h"

namespace flexel {
namespace {

constexpr double kRingBegins = 1.5;  // voxels, from any point of the middle one to a centre in the ring
constexpr double kReach = 2;         // voxels

std::uint32_t part_of_element(const Body& body, std::uint32_t element) {
  std::uint32_t part = 0;
  while (body.parts[part].element_end <= element) ++part;
  return part;
}

auto key(const Index3& at) {
  return std::tuple(at[2], at[1], at[0]);
}

// The first element of the part at a lattice index, or element_end.
std::uint32_t first_at(const Body& body, const Part& part, const Index3& at) {
  const auto begin = body.lattice_index.begin();
  const auto found = std::lower_bound(begin + part.element_begin, begin + part.element_end, at,
                                      [](const Index3& x, const Index3& y) { return key(x) < key(y); });
  const auto element = static_cast<std::uint32_t>(found - begin);
  return element < part.element_end && body.lattice_index[element] == at ? element : part.element_end;
}

bool is_stray(const Setting& setting, std::uint32_t element) {
  return element < setting.stray_element.size() && setting.stray_element[element];
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

std::vector<std::uint32_t> neighbours(const Setting& setting, const Part& part, std::uint32_t element,
                                      bool along_axes) {
  std::vector<std::uint32_t> found;
  for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
    const Index3& d = half_neighbourhood[bit];
    if ((std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) == 1) != along_axes) continue;
    for (const int sign : {-1, 1})
      if (const auto other = neighbour(setting.body, part, element, bit, sign);
          other && !is_stray(setting, *other))
        found.push_back(*other);
  }
  return found;
}

}  // namespace

Carrier cell_carrier(const Body& body, const CellPoint& point) {
  return {body.cell_elements[point.cell], point.weights, 8};
}

std::optional<std::uint32_t> nearest_element(const Setting& setting, std::uint32_t part, const Vec3& point,
                                             const Vec3& outward) {
  const Body& body = setting.body;
  const Part& in = body.parts[part];
  const Vec3 at = in.lattice.to_lattice(point);
  const double h = in.lattice.spacing.mean();
  const Index3 home{static_cast<std::int32_t>(std::floor(at[0])),
                    static_cast<std::int32_t>(std::floor(at[1])),
                    static_cast<std::int32_t>(std::floor(at[2]))};
  std::optional<std::uint32_t> nearest;
  double least = kReach * h;
  bool inside = false;
  const auto look = [&](const Index3& d) {
    const Index3 voxel{home[0] + d[0], home[1] + d[1], home[2] + d[2]};
    for (std::uint32_t e = first_at(body, in, voxel); e < in.element_end && body.lattice_index[e] == voxel;
         ++e) {
      if (is_stray(setting, e)) continue;
      const Vec3 way = body.rest[e] - point;
      const bool inward = outward.dot(way) <= 0;
      const double distance = way.norm();
      if (distance > kReach * h || (inside && !inward) || (inside == inward && !(distance < least))) continue;
      nearest = e;
      least = distance;
      inside = inward;
    }
  };
  for (const int width : {1, 2}) {
    if (width == 2 && inside && least <= kRingBegins * h) break;
    for (int k = -width; k <= width; ++k)
      for (int j = -width; j <= width; ++j)
        for (int i = -width; i <= width; ++i)
          if (std::max({std::abs(i), std::abs(j), std::abs(k)}) == width || width == 1) look({i, j, k});
  }
  return nearest;
}

SurfaceCarriers::SurfaceCarriers(const Setting& setting, std::uint32_t polygon)
    : setting_(setting), part_(setting.body.surface.polygon_part(polygon)) {
  if (setting.body.parts[part_].placement == Placement::corner) locate_.emplace(setting.body, polygon);
}

std::optional<Carrier> SurfaceCarriers::operator()(const Vec3& point, const Vec3& outward) {
  if (locate_) {
    const auto at = (*locate_)(point);
    if (!at || (at->cell < setting_.stray_cell.size() && setting_.stray_cell[at->cell])) return std::nullopt;
    return cell_carrier(setting_.body, *at);
  }
  const auto element = nearest_element(setting_, part_, point, outward);
  if (!element) return std::nullopt;
  return Carrier{{*element}, {1}, 1};
}

std::optional<Carrier> carrier_on_surface(const Setting& setting, std::uint32_t polygon, const Vec3& point,
                                          const Vec3& outward) {
  return SurfaceCarriers(setting, polygon)(point, outward);
}

Carrier with_gradient(const Setting& setting, const Carrier& carrier, const Vec3& point) {
  if (carrier.count != 1) return carrier;
  const Body& body = setting.body;
  const std::uint32_t element = carrier.elements[0];
  const Part& part = body.parts[part_of_element(body, element)];
  std::vector<std::uint32_t> others = neighbours(setting, part, element, true);
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
    for (const std::uint32_t f : neighbours(setting, part, element, false)) others.push_back(f);
    if (others.size() > 7) others.resize(7);
    inverse = fit();
  }
  Carrier result{{element}, {1}, 1};
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
std::vector<double> spread(const Setting& setting, const std::vector<double>& share,
                           const std::vector<double>& factor) {
  const Body& body = setting.body;
  std::vector<double> volume(body.element_count(), 0);
  const std::vector<std::uint8_t> active = sound_cells(setting);
  for (const Part& part : body.parts) {
    const double voxel = part.lattice.spacing.prod();
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      if (active[c])
        for (const std::uint32_t e : body.cell_elements[c]) volume[e] += share[c] * voxel / 8;
    if (part.placement == Placement::corner) continue;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      if (!is_stray(setting, e)) volume[e] = factor.empty() ? voxel : factor[e] * voxel;
  }
  return volume;
}

}  // namespace

std::vector<double> element_volumes(const Setting& setting) {
  return spread(setting, setting.body.fill, {});
}

std::vector<double> element_masses(const Setting& setting) {
  std::vector<double> mass = spread(setting, mass_shares(setting.body), mass_factors(setting.body));
  for (std::size_t p = 0; p < setting.body.parts.size(); ++p)
    for (std::uint32_t e = setting.body.parts[p].element_begin; e < setting.body.parts[p].element_end; ++e)
      mass[e] *= setting.materials[p].density;
  return mass;
}

}  // namespace flexel
