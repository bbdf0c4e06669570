// From a point on the part's surface to the cell under it, and from one in its matter to the cell that carries it.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/lattice/body.h"
#include "formats/part/nearest_polygon.h"

namespace flexel {

// A material point, carried by the eight elements of a cell with trilinear weights. The weights sum to 1;
// they reach slightly outside [0, 1] where the point lies in a neighbouring voxel that has no cell of its
// own.
struct CellPoint {
  std::uint32_t cell = 0;
  std::array<double, 8> weights{};  // by corner a = i + 2 j + 4 k
};

// Whether the point lies within a spacing, the least of its part's, of its cell.
[[nodiscard]] bool is_near(const Body& body, const CellPoint& at);

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

// The part, and the cell, whose matter a point at rest is of.
struct PointHome {
  std::uint32_t part = 0;
  std::optional<std::uint32_t> cell;  // none at centre placement
  double distance = 0;                // m, of the point from the nearest voxel
};

// Finds them: of the voxels nearest to the point, and where voxels of several parts or pieces of matter hold it, as of two
// walls nearer to each other than a cell, by the surface nearest to it: the way to any other's crosses its own. Matter too
// little for a cell of its own goes with the cell that stands in under its polygons, as vertices on it do. Keeps
// references to all that it is given.
class PointHomes {
 public:
  // `left_out`, of cells and of elements: 1: as if it were not there; may be shorter. `points`: as many as will be asked about.
  explicit PointHomes(const Body& body, std::span<const std::uint8_t> left_out_cells = {},
                      std::span<const std::uint8_t> left_out_elements = {}, std::size_t points = SIZE_MAX);

  // `point`: m, world frame.
  [[nodiscard]] PointHome find(const Vec3& point) const;
  // Likewise, but nothing where no voxel lies within a spacing of its part: looks at few voxels only.
  [[nodiscard]] std::optional<PointHome> find_near(const Vec3& point) const;

 private:
  // The voxels of a part that are nearest to the point: its cells, at centre placement its elements.
  struct Nearest {
    double distance = 0;  // m; infinite: none
    std::vector<std::uint32_t> owners;
  };
  [[nodiscard]] const Index3& voxel(const Part& part, std::uint32_t owner) const;
  void consider(const Part& part, std::uint32_t owner, const Vec3& point, Nearest& nearest) const;
  [[nodiscard]] Nearest near_voxels(const Part& part, const Vec3& point) const;
  [[nodiscard]] Nearest all_voxels(const Part& part, const Vec3& point) const;
  [[nodiscard]] PointHome choose(const std::vector<Nearest>& nearest, const Vec3& point) const;
  [[nodiscard]] std::uint32_t part_of(const std::vector<Nearest>& nearest, const Vec3& point) const;
  [[nodiscard]] std::uint32_t cell_of(const Part& part, const Nearest& nearest, const Vec3& point) const;
  [[nodiscard]] std::optional<std::uint32_t> stand_in(const Part& part, const Nearest& nearest,
                                                      const NearPolygon& under) const;
  [[nodiscard]] std::vector<std::uint32_t> bounded(std::uint32_t polygon,
                                                   const std::vector<std::uint32_t>& cells) const;
  [[nodiscard]] bool has_matter(std::uint32_t polygon) const;

  const Body& body_;
  std::span<const std::uint8_t> left_out_cells_, left_out_elements_;
  NearestPolygon polygons_;
  std::vector<std::uint8_t> at_surface_;  // (cells) 1: polygons bound it
  std::vector<std::uint8_t> sorted_;      // (parts) 1: owners ascend by voxel, k first
};

// Where the material point is now / was at rest.
[[nodiscard]] Vec3 interpolate(const CellPoint& at, const Body& body,
                               const std::vector<Vec3>& element_values);

}  // namespace flexel
