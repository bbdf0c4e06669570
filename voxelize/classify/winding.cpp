// A binary tree over the triangles, split at the median of the longest side of the centres' box. A node far
// from the point (more than kFar times its radius) counts as a dipole at its area centroid with the
// second-order term left out.
#include "voxelize/classify/winding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace flexel::voxelize {
namespace {

constexpr double kFar = 2.3;
constexpr std::uint32_t kLeaf = 8;

// Plain numbers, which stay in registers: the address sanitizer guards each of Eigen's temporaries, and then
// takes four times as long.
struct Vector {
  double x, y, z;
};

Vector between(const Vec3& from, const Vec3& to) {
  return {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
}

double dot(Vector a, Vector b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

Vector cross(Vector a, Vector b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The sum of signed solid angles of triangles. The half of each is the argument of a complex number (van
// Oosterom and Strackee, 1983): these are multiplied, and one arctangent is taken in the end. The argument of
// the product loses a turn where both arguments have one sign and it has the other.
class SolidAngle {
 public:
  void add(Vector p, Vector q, Vector r) {
    const double a = std::sqrt(dot(p, p)), b = std::sqrt(dot(q, q)), c = std::sqrt(dot(r, r));
    const double im = dot(p, cross(q, r)) + 0.;  // no -0, here and below: its argument may be -pi
    const double re = a * b * c + dot(p, q) * c + dot(q, r) * a + dot(r, p) * b;
    const double size = std::abs(re) + std::abs(im);
    if (!(size > 0)) return;
    const double real = (re_ * re - im_ * im) / size, imaginary = (re_ * im + im_ * re) / size + 0.;
    if (im_ >= 0 && im >= 0 && imaginary < 0) turns_ += 1;
    if (im_ < 0 && im < 0 && imaginary >= 0) turns_ -= 1;
    re_ = real;
    im_ = imaginary;
  }
  [[nodiscard]] double sum() const { return 2 * (std::atan2(im_, re_) + 2 * std::numbers::pi * turns_); }

 private:
  double re_ = 1, im_ = 0, turns_ = 0;
};

}  // namespace

struct WindingNumber::Tree {
  struct Node {
    Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();  // area centroid, summed area vectors
    double radius = 0;
    std::uint32_t begin = 0, end = 0;  // triangles
    std::uint32_t left = 0;            // children left and left + 1; 0: a leaf
  };

  Tree(const PartMesh& m, const std::vector<Vec3>& at)
      : mesh(&m), points(at.data()), order(m.corners.size()) {
    std::iota(order.begin(), order.end(), 0u);
    centres.reserve(order.size());
    for (const Corners& c : m.corners) centres.push_back((points[c[0]] + points[c[1]] + points[c[2]]) / 3);
    nodes.emplace_back();
    nodes[0].end = static_cast<std::uint32_t>(order.size());
    for (std::uint32_t n = 0; n < nodes.size(); ++n) build(n);
  }

  void build(std::uint32_t n) {
    summarise(nodes[n]);
    const std::uint32_t begin = nodes[n].begin, end = nodes[n].end;
    if (end - begin <= kLeaf) return;
    Box box;
    for (std::uint32_t t = begin; t < end; ++t) box.add(centres[order[t]]);
    int axis = 0;
    box.size().maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis]
                                                                   : a < b;
                     });
    nodes[n].left = static_cast<std::uint32_t>(nodes.size());
    nodes.emplace_back();
    nodes.back().begin = begin;
    nodes.back().end = middle;
    nodes.emplace_back();
    nodes.back().begin = middle;
    nodes.back().end = end;
  }

  void summarise(Node& node) const {
    double area = 0;
    for (std::uint32_t t = node.begin; t < node.end; ++t) {
      const Corners& c = mesh->corners[order[t]];
      const Vec3 normal = (points[c[1]] - points[c[0]]).cross(points[c[2]] - points[c[0]]) / 2;
      node.normal += normal;
      node.centre += normal.norm() * centres[order[t]];
      area += normal.norm();
    }
    if (area > 0)
      node.centre /= area;
    else if (node.end > node.begin)
      node.centre = centres[order[node.begin]];
    double squared = 0;
    for (std::uint32_t t = node.begin; t < node.end; ++t)
      for (const std::uint32_t v : mesh->corners[order[t]])
        squared = std::max(squared, (points[v] - node.centre).squaredNorm());
    node.radius = std::sqrt(squared);
  }

  [[nodiscard]] double angle(std::uint32_t n, const Vec3& point) const {
    const Node& node = nodes[n];
    const Vector to = between(point, node.centre);
    const double squared = dot(to, to);
    if (squared > kFar * kFar * node.radius * node.radius)
      return dot({node.normal[0], node.normal[1], node.normal[2]}, to) / (squared * std::sqrt(squared));
    if (node.left != 0) return angle(node.left, point) + angle(node.left + 1, point);
    SolidAngle sum;
    for (std::uint32_t t = node.begin; t < node.end; ++t) {
      const Corners& c = mesh->corners[order[t]];
      sum.add(between(point, points[c[0]]), between(point, points[c[1]]), between(point, points[c[2]]));
    }
    return sum.sum();
  }

  const PartMesh* mesh;
  const Vec3* points;
  std::vector<std::uint32_t> order;
  std::vector<Vec3> centres;
  std::vector<Node> nodes;
};

WindingNumber::WindingNumber(const PartMesh& mesh, const std::vector<Vec3>& points)
    : tree_(std::make_unique<Tree>(mesh, points)) {}
WindingNumber::~WindingNumber() = default;

double WindingNumber::at(const Vec3& point) const {
  return tree_->order.empty() ? 0 : tree_->angle(0, point) / (4 * std::numbers::pi);
}

}  // namespace flexel::voxelize
