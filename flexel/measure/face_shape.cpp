// From the area vectors of the polygons: a face is flat if the length of their sum is its area. The axis of a
// round face is the direction to which all normals are orthogonal (smallest eigenvalue of their area-weighted
// second moment). Its circle is fitted to the corners, projected along the axis, by linear least squares
// (Kasa 1976).
//
// The angle that a face covers of its cylinder is counted in steps of half a degree. A hole is concave and
// its faces, one or several of one cylinder side by side, cover the full circle; those of a fillet do not.
#include "flexel/measure/face_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <numeric>
#include <span>

#include "base/math/area_vector.h"
#include "base/math/dense.h"
#include "base/math/eigenvalues.h"

namespace flexel::commands {
namespace {

const double kFlatCosine = std::cos(0.2 * M_PI / 180);
const double kRoundSine = std::sin(1.0 * M_PI / 180);
// Between the axis and the plane of a triangle: one whose corners lie on a cylinder of 16 sides, at different
// heights, slants by 3 degrees, one of 8 sides by 7. That the corners lie on one circle is what tells.
const double kSlantSine = std::sin(10.0 * M_PI / 180);
constexpr double kRoundDeviation = 0.01;
constexpr std::size_t kSteps = 720;                  // round a cylinder
constexpr std::size_t kAllRound = kSteps - 10;       // steps: closed but for what rounding leaves
constexpr double kLargestFillet = 125 * M_PI / 180;  // a hollow that goes further round is no fillet

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

Sums sum_up(const Surface& surface, const std::vector<std::uint32_t>& polygons) {
  Sums face;
  for (const std::uint32_t p : polygons) {
    const Vec3 vector = area_vector(surface.vertices, surface.polygon(p));
    const double area = vector.norm();
    ++face.polygons;
    if (area == 0) continue;
    face.area += area;
    face.area_vector += vector;
    face.moment += area * middle(surface, surface.polygon(p));
    face.normals += vector * vector.transpose() / area;
  }
  return face;
}

// The polygons of each face.
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
  const Vec3 solution = solve_symmetric_3(normal_matrix, right);
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

// Whether the radius changes along the axis: that of a cone does in proportion, that of a barrel with its square. Both are
// fitted to the corners, which lie on the surface however it was meshed.
bool tapers(const Surface& surface, const std::vector<std::uint32_t>& polygons, const FaceShape& cylinder) {
  double low = 1e300, high = -1e300;  // m, along the axis
  const auto for_each_corner = [&](const auto& visit) {
    for (const std::uint32_t p : polygons)
      for (const std::uint32_t v : surface.polygon(p)) {
        const Vec3 arm = surface.vertices[v] - cylinder.axis_point;
        const double along = arm.dot(cylinder.axis);
        visit(along, (arm - along * cylinder.axis).norm() - cylinder.radius);
      }
  };
  for_each_corner([&](double along, double) {
    low = std::min(low, along);
    high = std::max(high, along);
  });
  const double half = (high - low) / 2;
  if (!(half > 0)) return false;
  Mat3 normal_matrix = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for_each_corner([&](double along, double further) {
    const double t = (along - low) / half - 1;
    const Vec3 row(1, t, t * t);
    normal_matrix += row * row.transpose();
    right += row * further;
  });
  // corners at two places along the axis only leave its square open
  const Vec3 fit = solve_least_norm(normal_matrix, right);
  return std::abs(fit[1]) + 2 * std::abs(fit[2]) > kRoundSine * half;
}

// The part of a cylinder that a face covers.
struct Reach {
  std::bitset<kSteps> steps;          // round the axis
  double low = 1e300, high = -1e300;  // m, along it
};

Reach reach_of(const Surface& surface, const std::vector<std::uint32_t>& polygons,
               const FaceShape& cylinder) {
  const Vec3 e1 = cylinder.axis.unitOrthogonal(), e2 = cylinder.axis.cross(e1);
  Reach reach;
  for (const std::uint32_t p : polygons) {
    double first = 0, low = 0, high = 0;  // rad; the last two from the first corner
    for (std::size_t i = 0; i < surface.polygon(p).size(); ++i) {
      const Vec3 arm = surface.vertices[surface.polygon(p)[i]] - cylinder.axis_point;
      const double angle = std::atan2(arm.dot(e2), arm.dot(e1));
      if (i == 0) first = angle;
      const double turned = std::remainder(angle - first, 2 * M_PI);
      low = std::min(low, turned);
      high = std::max(high, turned);
      reach.low = std::min(reach.low, arm.dot(cylinder.axis));
      reach.high = std::max(reach.high, arm.dot(cylinder.axis));
    }
    constexpr double kStep = 2 * M_PI / kSteps;
    const auto begin = static_cast<std::ptrdiff_t>(std::floor((first + low + 4 * M_PI) / kStep + 0.5));
    const auto end = static_cast<std::ptrdiff_t>(std::floor((first + high + 4 * M_PI) / kStep + 0.5));
    for (std::ptrdiff_t s = begin; s < end; ++s) reach.steps.set(static_cast<std::size_t>(s) % kSteps);
  }
  return reach;
}

// Whether two round faces lie on one cylinder, on the same side of it.
bool on_one_cylinder(const FaceShape& a, const FaceShape& b) {
  if (a.hollow != b.hollow || std::abs(a.radius - b.radius) > kRoundDeviation * a.radius) return false;
  if (a.axis.cross(b.axis).norm() > kRoundSine) return false;
  const Vec3 between = b.axis_point - a.axis_point;
  return (between - between.dot(a.axis) * a.axis).norm() <= 2 * kRoundDeviation * a.radius;
}

// Sets `closed` of the round faces whose cylinder is closed by them and those beside them.
void close_cylinders(const Surface& surface, const std::vector<std::vector<std::uint32_t>>& polygons,
                     std::vector<FaceShape>& shapes) {
  std::vector<std::uint32_t> open;  // round, not closed by itself; ascending in radius
  for (std::uint32_t f = 0; f < shapes.size(); ++f)
    if (shapes[f].kind == FaceShape::Kind::round && !shapes[f].closed) open.push_back(f);
  std::sort(open.begin(), open.end(), [&](auto a, auto b) { return shapes[a].radius < shapes[b].radius; });
  for (std::size_t i = 0; i < open.size(); ++i) {
    const FaceShape& shape = shapes[open[i]];
    Reach all = reach_of(surface, polygons[open[i]], shape);
    std::vector<std::uint32_t> members{open[i]};
    for (std::size_t k = i + 1; k < open.size(); ++k) {
      const std::uint32_t other = open[k];
      if (shapes[other].radius > (1 + kRoundDeviation) * shape.radius) break;
      if (surface.faces[other].part != surface.faces[open[i]].part || !on_one_cylinder(shape, shapes[other]))
        continue;
      const Reach more = reach_of(surface, polygons[other], shape);
      if (more.low >= all.high || more.high <= all.low) continue;
      all.steps |= more.steps;
      members.push_back(other);
    }
    if (all.steps.count() >= kAllRound)
      for (const std::uint32_t f : members) shapes[f].closed = true;
  }
}

}  // namespace

FaceShape face_shape(const Surface& surface, const std::vector<std::uint32_t>& polygons) {
  const Sums sums = sum_up(surface, polygons);
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
  if (!all_normals(surface, polygons, [&](const Vec3& n) { return std::abs(n.dot(axis)) <= kSlantSine; }))
    return shape;
  FaceShape round = shape;
  fit_circle(surface, polygons, axis, round);
  if (round.kind != FaceShape::Kind::round || tapers(surface, polygons, round)) return shape;
  const std::size_t steps = reach_of(surface, polygons, round).steps.count();
  round.angle = 2 * M_PI * static_cast<double>(steps) / kSteps;
  round.closed = steps >= kAllRound;
  return round;
}

std::vector<FaceShape> face_shapes(const Surface& surface) {
  const std::vector<std::vector<std::uint32_t>> polygons = polygons_of(surface);
  std::vector<FaceShape> shapes;
  for (const std::vector<std::uint32_t>& face : polygons) shapes.push_back(face_shape(surface, face));
  close_cylinders(surface, polygons, shapes);
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
  if (shape.closed)
    return fmt::format("round, {} of diameter {:.4g} {} along {}", shape.hollow ? "hole" : "outside",
                       2 * shape.radius / unit, unit_name, axis);
  const char* what = shape.angle > kLargestFillet ? (shape.hollow ? "hollow" : "outside")
                     : shape.hollow               ? "fillet"
                                                  : "rounded edge";
  return fmt::format("round, {} of radius {:.4g} {} ({:.0f} degrees) along {}", what, shape.radius / unit,
                     unit_name, shape.angle * 180 / M_PI, axis);
}

}  // namespace flexel::commands
