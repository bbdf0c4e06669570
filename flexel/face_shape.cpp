// Area vectors of the polygons give everything: the longest sum is that of a flat face; the direction that no
// normal has a part in (smallest eigenvalue of the area-weighted normals' second moment) is the axis of a
// round one. Its circle is then fitted to the corners in the plane across the axis by linear least squares
// (Kasa 1976).
#include "flexel/face_shape.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <span>

#include "formats/area_vector.h"

namespace flexel {
namespace {

const double kFlatCosine = std::cos(0.2 * M_PI / 180);
const double kRoundSine = std::sin(1.0 * M_PI / 180);
constexpr double kRoundDeviation = 0.01;

struct Sums {
  std::size_t polygons = 0;
  double area = 0;
  Vec3 area_vector = Vec3::Zero(), moment = Vec3::Zero();
  Mat3 normals = Mat3::Zero();
};

Vec3 middle(const Surface& surface, std::span<const std::uint32_t> corners) {
  Vec3 sum = Vec3::Zero();
  for (const std::uint32_t v : corners) sum += surface.vertices[v];
  return sum / static_cast<double>(corners.size());
}

std::vector<Sums> sum_up(const Surface& surface) {
  std::vector<Sums> sums(surface.faces.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    Sums& face = sums[surface.polygon_face[p]];
    const Vec3 vector = area_vector(surface.vertices, surface.polygon(p));
    const double area = vector.norm();
    ++face.polygons;
    if (area == 0) continue;
    face.area += area;
    face.area_vector += vector;
    face.moment += area * middle(surface, surface.polygon(p));
    face.normals += vector * vector.transpose() / area;
  }
  return sums;
}

// The polygons of each face, for a second look.
std::vector<std::vector<std::uint32_t>> polygons_of(const Surface& surface) {
  std::vector<std::vector<std::uint32_t>> polygons(surface.faces.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    polygons[surface.polygon_face[p]].push_back(static_cast<std::uint32_t>(p));
  return polygons;
}

template <class Good>
bool all_normals(const Surface& surface, const std::vector<std::uint32_t>& polygons, const Good& good) {
  for (const std::uint32_t p : polygons) {
    const Vec3 vector = area_vector(surface.vertices, surface.polygon(p));
    if (vector.norm() > 0 && !good(vector.normalized())) return false;
  }
  return true;
}

Vec3 axis_of(const Mat3& normals) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(normals);
  Vec3 axis = solver.eigenvectors().col(0);
  // Rounding beside a coordinate axis would only be noise in what is said.
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) < 1e-9) axis[i] = 0;
  int largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return (axis[largest] < 0 ? Vec3(-axis) : axis).normalized();
}

// Fits the circle; leaves `shape` alone when the corners do not lie on one.
void fit_circle(const Surface& surface, const std::vector<std::uint32_t>& polygons, const Vec3& axis,
                FaceShape& shape) {
  const Vec3 e1 = axis.unitOrthogonal(), e2 = axis.cross(e1);
  const auto flat = [&](std::uint32_t v) {
    const Vec3 offset = surface.vertices[v] - shape.centroid;
    return Eigen::Vector2d(offset.dot(e1), offset.dot(e2));
  };
  Mat3 normal_matrix = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  const auto for_each_corner = [&](const auto& visit) {
    for (const std::uint32_t p : polygons)
      for (const std::uint32_t v : surface.polygon(p)) visit(flat(v));
  };
  for_each_corner([&](const Eigen::Vector2d& at) {
    const Vec3 row(at.x(), at.y(), 1);
    normal_matrix += row * row.transpose();
    right += row * at.squaredNorm();
  });
  const Vec3 solution = normal_matrix.ldlt().solve(right);
  const Eigen::Vector2d centre = solution.head<2>() / 2;
  const double radius = std::sqrt(std::max(solution[2] + centre.squaredNorm(), 0.0));
  double deviation = 0;
  for_each_corner([&](const Eigen::Vector2d& at) {
    deviation = std::max(deviation, std::abs((at - centre).norm() - radius));
  });
  if (!(radius > 0) || !(deviation <= kRoundDeviation * radius)) return;
  shape.kind = FaceShape::Kind::round;
  shape.axis = axis;
  shape.radius = radius;
  shape.axis_point = shape.centroid + centre.x() * e1 + centre.y() * e2;
  double outward = 0;
  for (const std::uint32_t p : polygons) {
    Vec3 from_axis = middle(surface, surface.polygon(p)) - shape.axis_point;
    from_axis -= from_axis.dot(axis) * axis;
    outward += from_axis.dot(area_vector(surface.vertices, surface.polygon(p)));
  }
  shape.hollow = outward < 0;
}

FaceShape shape_of(const Surface& surface, const Sums& sums, const std::vector<std::uint32_t>& polygons) {
  FaceShape shape;
  shape.polygons = sums.polygons;
  shape.area = sums.area;
  if (sums.area == 0) return shape;
  shape.centroid = sums.moment / sums.area;
  const Vec3 normal = sums.area_vector.norm() > 0 ? sums.area_vector.normalized() : Vec3(Vec3::Zero());
  if (all_normals(surface, polygons, [&](const Vec3& n) { return n.dot(normal) >= kFlatCosine; })) {
    shape.kind = FaceShape::Kind::flat;
    shape.normal = normal;
    return shape;
  }
  const Vec3 axis = axis_of(sums.normals);
  if (all_normals(surface, polygons, [&](const Vec3& n) { return std::abs(n.dot(axis)) <= kRoundSine; }))
    fit_circle(surface, polygons, axis, shape);
  return shape;
}

}  // namespace

std::vector<FaceShape> face_shapes(const Surface& surface) {
  const std::vector<Sums> sums = sum_up(surface);
  const std::vector<std::vector<std::uint32_t>> polygons = polygons_of(surface);
  std::vector<FaceShape> shapes;
  for (std::size_t f = 0; f < sums.size(); ++f) shapes.push_back(shape_of(surface, sums[f], polygons[f]));
  return shapes;
}

std::string direction_name(const Vec3& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(direction[axis]) >= kFlatCosine)
      return fmt::format("{}{}", direction[axis] > 0 ? '+' : '-', "xyz"[axis]);
  const auto tidy = [](double x) { return std::abs(x) < 5e-4 ? 0 : x; };
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", tidy(direction.x()), tidy(direction.y()),
                     tidy(direction.z()));
}

std::string describe(const FaceShape& shape, double unit, const std::string& unit_name) {
  if (shape.kind == FaceShape::Kind::flat) return "flat, normal " + direction_name(shape.normal);
  if (shape.kind == FaceShape::Kind::curved) return "curved";
  std::string axis = direction_name(shape.axis);
  if (axis.front() == '+') axis.erase(0, 1);
  return fmt::format("round, {} of diameter {:.4g} {} along {}", shape.hollow ? "hole" : "outside",
                     2 * shape.radius / unit, unit_name, axis);
}

}  // namespace flexel
