// Which elements carry a material point of the body, and with what weights.
//
// Corner placement: the eight elements of a cell, trilinear. Centre placement: the nearest element, or, where
// the half voxel between it and the surface matters, that element and its neighbours along the lattice's axes
// (affine, exact for affine displacements).
#pragma once
#include <algorithm>
#include <optional>
#include <span>

#include "formats/lattice/locate.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

struct InterpolationWeights {
  std::array<std::uint32_t, 8> elements{};
  std::array<double, 8> weights{};  // sum 1
  std::uint32_t count = 0;          // of both that are used
};

[[nodiscard]] InterpolationWeights cell_carrier(const Body& body, const CellPoint& point);

// The element of a centre-placed part that rests nearest to a point, for many points: the elements in the voxels
// around are found once for all those in one voxel. Keeps a reference to `problem`.
class NearestElement {
 public:
  NearestElement(const Problem& problem, std::uint32_t part) : problem_(problem), part_(part) {}
  // Nothing where none lies within two voxels. Those with outward . (element - point) <= 0 go before all
  // others; a zero vector tells none apart. Of several equally near the lowest.
  [[nodiscard]] std::optional<std::uint32_t> operator()(const Vec3& point, const Vec3& outward);
  // All that are equally near, whatever rounding says: of a point half-way between two elements both. Good until the next
  // call.
  [[nodiscard]] std::span<const std::uint32_t> all(const Vec3& point, const Vec3& outward);

 private:
  [[nodiscard]] std::vector<std::uint32_t> elements_around(std::int32_t from, std::int32_t to) const;

  const Problem& problem_;
  std::uint32_t part_;
  std::optional<Index3> home_;                         // voxel that the others are of
  std::vector<std::uint32_t> near_;                    // in the 27 voxels around
  std::optional<std::vector<std::uint32_t>> in_ring_;  // in the 98 around these, once they are asked for
  std::vector<std::uint32_t> tied_;                    // found
};

// What carries `point` (m, rest, world frame) on polygon `polygon` of the surface, `outward` the polygon's
// normal: the cell under it, or the nearest element of the polygon's part, one on the inner side of the
// surface before any other. Nothing when no cell or no element within two voxels is there or it is stray.
[[nodiscard]] std::optional<InterpolationWeights> carrier_on_surface(const Problem& problem,
                                                                     std::uint32_t polygon, const Vec3& point,
                                                                     const Vec3& outward);

// Likewise, for many points of one polygon. Keeps a reference to `problem`.
class SurfaceCarriers {
 public:
  SurfaceCarriers(const Problem& problem, std::uint32_t polygon);
  [[nodiscard]] std::optional<InterpolationWeights> operator()(const Vec3& point, const Vec3& outward);
  // The elements that carry a point at centre placement together, as it is equally near to all of them; empty: operator()
  // tells what carries it. Good until the next call.
  [[nodiscard]] std::span<const std::uint32_t> tied(const Vec3& point, const Vec3& outward);

 private:
  const Problem& problem_;
  std::uint32_t part_;
  std::optional<SurfaceLocator> locate_;  // corner placement
  NearestElement nearest_;                // centre placement
};

// NearestElement, for one point.
[[nodiscard]] std::optional<std::uint32_t> nearest_element(const Problem& problem, std::uint32_t part,
                                                           const Vec3& point, const Vec3& outward);

// `carrier` of a point near one element of a centre-placed part, with the gradient fitted to its neighbours:
// u(p) = u_e + sum_f w_f (u_f - u_e), w_f = (p - x_e) . M^-1 (x_f - x_e), M = sum_f (x_f - x_e)(x_f - x_e)^T.
// A carrier of a cell stays as it is.
[[nodiscard]] InterpolationWeights with_gradient(const Problem& problem, const InterpolationWeights& carrier,
                                                 const Vec3& point);

// How many times what its material says edits made something of the matter around elements, such as column
// "stiffness_change": the mean of the unbroken cells around an element, at centre placement its own factor.
class ChangeAround {
 public:
  ChangeAround(const Body& body, const char* column);
  [[nodiscard]] double of(std::uint32_t element) const { return factors_.empty() ? 1 : factors_[element]; }
  // Where elements carry a point: the mean by their weights, of those above 0.
  [[nodiscard]] double at(const InterpolationWeights& carrier) const;

 private:
  std::vector<double> factors_;  // (elements); empty: 1
};

// By how much edits raise the square of the frequency of the cells around an element: 1 at least, for what is slower
// bears what its part does.
class QuickerByEdits {
 public:
  explicit QuickerByEdits(const Body& body)
      : stiffness_(body, "stiffness_change"), density_(body, "density_change") {}
  [[nodiscard]] double operator()(std::uint32_t element) const {
    return std::max(1.0, stiffness_.of(element) / density_.of(element));
  }

 private:
  ChangeAround stiffness_, density_;
};

// (elements) m^3: the matter of each element that is simulated: its voxel (centre placement), or an eighth of
// the filled volume of each unbroken cell around it.
[[nodiscard]] std::vector<double> element_volumes(const Problem& problem);
// (elements) kg, likewise.
[[nodiscard]] std::vector<double> element_masses(const Problem& problem);

}  // namespace flexel::simulate
