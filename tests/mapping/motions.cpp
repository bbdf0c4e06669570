#include "motions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/part/topology.h"

namespace flexel::mapping::test {
namespace {

constexpr double kLength = 8, kRadius = 0.5;

Lattice turned_lattice(int across) {
  Lattice lattice;
  lattice.axes = rotation(0.7, Vec3(1, 0.6, 0.3));
  lattice.origin = Vec3(0.0137, 0.0211, 0.0071);
  lattice.spacing = Vec3::Constant(1.0 / across);
  return lattice;
}

// `inside`(p, margin): within `margin` of the solid. Corner placement keeps every voxel that holds matter:
// here those whose centre is within half a diagonal.
template <class Inside>
Body body_in_box(int across, Placement placement, const Vec3& min, const Vec3& max, const Inside& inside) {
  const Lattice lattice = turned_lattice(across);
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 u = lattice.to_lattice(
        Vec3(corner & 1 ? max.x() : min.x(), corner & 2 ? max.y() : min.y(), corner & 4 ? max.z() : min.z()));
    low = low.cwiseMin(u);
    high = high.cwiseMax(u);
  }
  const auto floor = [](double x) { return static_cast<std::int32_t>(std::floor(x)) - 1; };
  const double margin = placement == Placement::corner ? 0.6 / across : 0;
  return make_body(
      lattice, {floor(low[0]), floor(low[1]), floor(low[2])},
      {floor(high[0]) + 3, floor(high[1]) + 3, floor(high[2]) + 3},
      [&](const Vec3& p) { return inside(p, margin); }, placement);
}

Vec3 knot_centre(double t) {
  return 1.35 * Vec3(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
}

}  // namespace

Body round_bar(int across, Placement placement, int along_vertices, int around_vertices) {
  Body body = body_in_box(across, placement, Vec3(0, -kRadius, -kRadius), Vec3(kLength, kRadius, kRadius),
                          [&](const Vec3& p, double margin) {
                            return p.x() >= -margin && p.x() <= kLength + margin &&
                                   p.tail<2>().norm() <= kRadius + margin;
                          });
  add_tube_surface(body, kLength, kRadius, along_vertices, around_vertices);
  return body;
}

Body knot(int across, Placement placement) {
  constexpr int kSamples = 600, kAlong = 320, kAround = 32;
  std::vector<Vec3> curve;
  Box box;
  for (int i = 0; i < kSamples; ++i) {
    curve.push_back(knot_centre(2 * std::numbers::pi * i / kSamples));
    box.add(curve.back());
  }
  double step = (curve.back() - curve.front()).norm();  // the longest from a sample to the next
  for (int i = 1; i < kSamples; ++i) step = std::max(step, (curve[i] - curve[i - 1]).norm());
  const Vec3 room = Vec3::Constant(kRadius);
  Body body =
      body_in_box(across, placement, box.min - room, box.max + room, [&](const Vec3& p, double margin) {
        const double reach = kRadius + margin;
        // The samples that are too near to one out of reach to be within it are passed over.
        for (std::size_t i = 0; i < curve.size();) {
          const double squared = (p - curve[i]).squaredNorm();
          if (squared <= reach * reach) return true;
          i += std::max<std::size_t>(1, static_cast<std::size_t>(0.99 * (std::sqrt(squared) - reach) / step));
        }
        return false;
      });
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> quads;
  for (int a = 0; a < kAlong; ++a) {
    const double t = 2 * std::numbers::pi * a / kAlong;
    const Vec3 tangent = (knot_centre(t + 1e-4) - knot_centre(t - 1e-4)).normalized();
    const Vec3 normal = tangent.cross(Vec3(0.1, 0.2, 1)).normalized(), binormal = tangent.cross(normal);
    for (int b = 0; b < kAround; ++b) {
      const double q = 2 * std::numbers::pi * b / kAround;
      vertices.push_back(knot_centre(t) + kRadius * (std::cos(q) * normal + std::sin(q) * binormal));
    }
  }
  const auto at = [&](int a, int b) {
    return static_cast<std::uint32_t>(a % kAlong * kAround + b % kAround);
  };
  for (int a = 0; a < kAlong; ++a)
    for (int b = 0; b < kAround; ++b)
      quads.push_back({at(a, b), at(a, b + 1), at(a + 1, b + 1), at(a + 1, b)});
  add_surface(body, vertices, quads);
  return body;
}

Body coarse_bar() {
  Body body = block(80, 8, 8, kBarSpacing, Placement::corner, 1);
  body.surface_cell_offsets.clear();
  body.surface_cells.clear();
  return body;
}

Vec3 along_circle(const Vec3& p, double angle, double neutral) {
  const double radius = kBarLength / angle, turned = p.x() / radius, r = radius + neutral - p.z();
  return {r * std::sin(turned), p.y(), radius + neutral - r * std::cos(turned)};
}

Vec3 bend(const Vec3& p) {
  const double radius = kLength / M_PI, angle = M_PI * p.x() / kLength;
  return {(radius - p.y()) * std::sin(angle), radius - (radius - p.y()) * std::cos(angle), p.z()};
}
Vec3 twist(const Vec3& p) {
  return rotation(2 * M_PI * p.x() / kLength, Vec3::UnitX()) * p;
}
Vec3 stretch(const Vec3& p) {
  return {2 * p.x(), p.y() / std::sqrt(2), p.z() / std::sqrt(2)};
}
Vec3 turn(const Vec3& p) {
  return rotation(1.0, Vec3(1, 2, 3)) * p + Vec3(0.1, 0.2, 0.3);
}

double largest_error(const Body& body, const std::vector<Vec3>& displacement, const Field& field) {
  double largest = 0;
  for (std::size_t v = 0; v < displacement.size(); ++v) {
    const Vec3& x = body.surface.vertices[v];
    largest = std::max(largest, (x + displacement[v] - field(x)).norm());
  }
  return largest;
}

double rms_error(const Body& body, const std::vector<Vec3>& displacement, const Field& field) {
  double sum = 0;
  for (std::size_t v = 0; v < displacement.size(); ++v) {
    const Vec3& x = body.surface.vertices[v];
    sum += (x + displacement[v] - field(x)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(displacement.size()));
}

double normal_jump(const Body& body, const std::vector<Vec3>& displacement, const Field& field) {
  const Triangles triangles = triangulate(body.surface);
  const Topology mesh = topology(triangles.corners, weld(body.surface.vertices));
  std::vector<Vec3> mapped, exact;
  for (std::size_t v = 0; v < displacement.size(); ++v) {
    mapped.push_back(body.surface.vertices[v] + displacement[v]);
    exact.push_back(field(body.surface.vertices[v]));
  }
  const auto normal = [&](const std::vector<Vec3>& at, std::uint32_t t) -> Vec3 {
    const auto& [a, b, c] = triangles.corners[t];
    return (at[b] - at[a]).cross(at[c] - at[a]).normalized();
  };
  const auto angle = [&](const std::vector<Vec3>& at, std::uint32_t s, std::uint32_t t) {
    const Vec3 a = normal(at, s), b = normal(at, t);
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
  };
  double sum = 0, count = 0;
  for (std::uint32_t t = 0; t < triangles.corners.size(); ++t)
    for (const std::uint32_t other : mesh.neighbour[t]) {
      if (other == kNoTriangle || other < t) continue;
      const double difference = angle(mapped, t, other) - angle(exact, t, other);
      sum += difference * difference;
      ++count;
    }
  return std::sqrt(sum / count);
}

}  // namespace flexel::mapping::test
