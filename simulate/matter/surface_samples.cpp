// Corners of polygons at a vertex are gathered to smooth surfaces one after the other, each beginning with the first
// corner that is left.
#include "simulate/matter/surface_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_set>

#include "base/math/area_vector.h"
#include "formats/lattice/locate.h"

namespace flexel::simulate {
namespace {

constexpr double kSmooth = 0.8660254037844386;  // cosine of 30 degrees
constexpr double kLong = 0.5;                   // spacings: triangles of longer edges are cut
// Of the way from the middle of a piece to its corners: where strains of quadratic cells are better by an order than
// at the faces of cells (Barlow 1976)
constexpr double kInside = 0.5773502691896258;

// The smooth surface at a corner of a polygon.
struct Smooth {
  Vec3 normal = Vec3::Zero();  // unit; 0: the polygon has no area
  double pressure = 0;         // Pa
};

class Sampler {
 public:
  Sampler(const Body& body, const std::vector<double>& pressure, const VoxelRange* range)
      : body_(body), surface_(body.surface), pressure_(pressure), range_(range) {}

  std::vector<SurfaceSample> operator()() {
    find_corners();
    smooth_.resize(surface_.polygon_vertices.size());
    for (std::uint32_t v = 0; v < surface_.vertices.size(); ++v) sample_vertex(v);
    const Triangles triangles = triangulate(surface_);
    for (std::size_t t = 0; t < triangles.polygon.size(); ++t)
      sample_triangle(triangles.polygon[t], triangles.corners[t]);
    return std::move(samples_);
  }

 private:
  // The corners of polygons at each vertex (compressed rows), and the polygons' area vectors.
  void find_corners() {
    offsets_.assign(surface_.vertices.size() + 1, 0);
    for (const std::uint32_t v : surface_.polygon_vertices) ++offsets_[v + 1];
    for (std::size_t v = 0; v < surface_.vertices.size(); ++v) offsets_[v + 1] += offsets_[v];
    corners_.resize(surface_.polygon_vertices.size());
    polygon_.resize(corners_.size());
    std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::uint32_t p = 0; p < surface_.polygon_count(); ++p) {
      area_.push_back(area_vector(surface_.vertices, surface_.polygon(p)));
      for (std::uint32_t c = surface_.polygon_offsets[p]; c < surface_.polygon_offsets[p + 1]; ++c) {
        polygon_[c] = p;
        corners_[next[surface_.polygon_vertices[c]]++] = c;
      }
    }
  }

  void sample_vertex(std::uint32_t vertex) {
    std::vector<std::uint32_t> left;
    for (std::uint32_t i = offsets_[vertex]; i < offsets_[vertex + 1]; ++i)
      if (area_[polygon_[corners_[i]]].norm() > 0) left.push_back(corners_[i]);
    while (!left.empty()) {
      const Vec3 first = area_[polygon_[left[0]]].normalized();
      const auto beyond = std::stable_partition(left.begin(), left.end(), [&](std::uint32_t c) {
        const Vec3& area = area_[polygon_[c]];
        return area.dot(first) > kSmooth * area.norm();
      });
      Vec3 sum = Vec3::Zero();
      double pressure = pressure_[polygon_[left[0]]];
      for (auto c = left.begin(); c != beyond; ++c) {
        sum += area_[polygon_[*c]];
        if (!(pressure_[polygon_[*c]] == pressure)) pressure = kUnknownPressure;
      }
      const Smooth smooth{sum.normalized(), pressure};
      std::optional<CellPoint> under;
      for (auto c = left.begin(); c != beyond; ++c) {
        smooth_[*c] = smooth;
        if (!under && in_reach(polygon_[*c], surface_.vertices[vertex]))
          under = locate_on_surface(body_, polygon_[*c], surface_.vertices[vertex]);
      }
      if (under)
        samples_.push_back({under->cell, vertex, true, surface_.vertices[vertex], smooth.normal, pressure});
      left.erase(left.begin(), beyond);
    }
  }

  [[nodiscard]] bool in_reach(std::uint32_t polygon, const Vec3& at) const {
    return range_ == nullptr ||
           range_->contains(body_.parts[surface_.polygon_part(polygon)].lattice.to_lattice(at));
  }

  void sample_triangle(std::uint32_t polygon, const std::array<std::uint32_t, 3>& corners) {
    const Lattice& lattice = body_.parts[surface_.polygon_part(polygon)].lattice;
    Outline outline;
    for (const std::uint32_t v : corners) outline.push_back(lattice.to_lattice(surface_.vertices[v]));
    double longest = 0;
    for (std::size_t i = 0; i < 3; ++i)
      longest = std::max(longest, (outline[(i + 1) % 3] - outline[i]).cwiseAbs().maxCoeff());
    if (longest <= kLong || !(area_[polygon].norm() > 0)) return;
    if (range_ != nullptr) outline = in_range(outline, *range_);
    if (outline.size() < 3) return;
    SurfaceLocator locate(body_, polygon);
    for_each_voxel(outline, 0, [&](const Outline& piece) {
      const Vec3 middle = middle_of(piece);
      const std::optional<CellPoint> under = locate(lattice.to_world(middle));
      if (!under) return;
      add(under->cell, polygon, corners, lattice.to_world(middle));
      for (const Vec3& corner : piece)
        add(under->cell, polygon, corners, lattice.to_world(middle + kInside * (corner - middle)));
    });
  }

  // A point of a triangle, with the mean of its corners' normals by barycentric coordinates.
  void add(std::uint32_t cell, std::uint32_t polygon, const std::array<std::uint32_t, 3>& corners,
           const Vec3& at) {
    const Vec3 &a = surface_.vertices[corners[0]], &b = surface_.vertices[corners[1]],
               &c = surface_.vertices[corners[2]];
    const Vec3 across = (b - a).cross(c - a);
    const double area = across.squaredNorm();
    if (!(area > 0)) return;
    const std::array<double, 3> weight = {(b - at).cross(c - at).dot(across) / area,
                                          (c - at).cross(a - at).dot(across) / area,
                                          (a - at).cross(b - at).dot(across) / area};
    SurfaceSample sample{cell, corners[0], false, at, Vec3::Zero(), pressure_[polygon]};
    double most = -1;
    for (std::size_t i = 0; i < 3; ++i) {
      sample.normal += weight[i] * smooth_at(polygon, corners[i]).normal;
      if (weight[i] <= most) continue;
      most = weight[i];
      sample.vertex = corners[i];
    }
    if (!(sample.normal.norm() > 0)) return;
    sample.normal.normalize();
    if (seen_.insert(place_of(sample, polygon)).second) samples_.push_back(sample);
  }

  // A sixty-fourth of a voxel, and the axis that the surface there looks along most: one sample of triangles is enough, of
  // faces cut into many long ones.
  [[nodiscard]] std::uint64_t place_of(const SurfaceSample& sample, std::uint32_t polygon) const {
    const Lattice& lattice = body_.parts[surface_.polygon_part(polygon)].lattice;
    const Vec3 at = lattice.to_lattice(sample.at), normal = lattice.axes.transpose() * sample.normal;
    std::uint64_t place = sample.cell;
    for (int axis = 0; axis < 3; ++axis)
      place = 4 * place + static_cast<std::uint64_t>(4 * (at[axis] - std::floor(at[axis]))) % 4;
    Eigen::Index most = 0;
    normal.cwiseAbs().maxCoeff(&most);
    return 8 * place + 2 * static_cast<std::uint64_t>(most) + (normal[most] < 0 ? 1 : 0);
  }

  [[nodiscard]] const Smooth& smooth_at(std::uint32_t polygon, std::uint32_t vertex) const {
    std::uint32_t c = surface_.polygon_offsets[polygon];
    while (surface_.polygon_vertices[c] != vertex) ++c;
    return smooth_[c];
  }

  const Body& body_;
  const Surface& surface_;
  const std::vector<double>& pressure_;
  const VoxelRange* range_;
  std::vector<std::uint32_t> offsets_, corners_;  // of each vertex, corners of polygons
  std::vector<std::uint32_t> polygon_;            // (corners)
  std::vector<Vec3> area_;                        // (polygons) m^2
  std::vector<Smooth> smooth_;                    // (corners)
  std::unordered_set<std::uint64_t> seen_;        // place_of()
  std::vector<SurfaceSample> samples_;
};

}  // namespace

std::vector<SurfaceSample> surface_samples(const Body& body, const std::vector<double>& pressure,
                                           const VoxelRange* range) {
  return Sampler(body, pressure, range)();
}

}  // namespace flexel::simulate
