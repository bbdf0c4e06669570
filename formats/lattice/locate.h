// From a point on the part's surface to the cell under it.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/lattice/body.h"

namespace flexel {

// A material point, carried by the eight elements of a cell with trilinear weights. The weights sum to 1;
// they reach slightly outside [0, 1] where the point lies in a neighbouring voxel that has no cell of its
// own.
struct CellPoint {
  std::uint32_t cell = 0;
  std::array<double, 8> weights{};  // by corner a = i + 2 j + 4 k
};

// Trilinear weights of the rest point `point` (m, world frame) in `cell`.
[[nodiscard]] CellPoint cell_point(const Body& body, std::uint32_t cell, const Vec3& point);

// The cell under `point` on polygon `polygon` of the surface at rest: among the cells that the polygon
// bounds, the one whose voxel is nearest. Nothing when the polygon bounds no cell (centre placement, or all
// its matter was dropped).
[[nodiscard]] std::optional<CellPoint> locate_on_surface(const Body& body, std::size_t polygon,
                                                         const Vec3& point);

// Likewise, for many points of one polygon: the cell of the last one is tried first. Keeps a reference to
// `body`.
class SurfaceLocator {
 public:
  SurfaceLocator(const Body& body, std::size_t polygon);
  [[nodiscard]] std::optional<CellPoint> operator()(const Vec3& point);

 private:
  [[nodiscard]] std::uint32_t nearest_cell(const Vec3& at);

  const Body& body_;
  std::span<const std::uint32_t> cells_;  // that the polygon bounds, ascending
  const Lattice* lattice_ = nullptr;
  // Found in voxel `last_home_`, or beside those of its faces that the point lay on
  std::optional<std::uint32_t> last_;
  Eigen::Matrix<std::int64_t, 3, 1> last_home_;
  std::array<int, 3> last_first_{};
};

// Where the material point is now / was at rest.
[[nodiscard]] Vec3 interpolate(const CellPoint& at, const Body& body,
                               const std::vector<Vec3>& element_values);

}  // namespace flexel
