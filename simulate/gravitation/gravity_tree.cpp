// An octree over the points in the order of their Morton keys (21 bits an axis): a node is a range of that
// order. Its moments come from its children's, or its points' at a leaf. Every point walks the tree by
// itself, in the order of the nodes, so its sums have a fixed order.
#include "simulate/gravitation/gravity_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/parallel_sort.h"
#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::uint32_t kLeaf = 16;  // points
constexpr int kDepth = 21;           // bits an axis
constexpr std::size_t kTreeGrain = 256;

std::uint64_t spread(std::uint64_t bits) {  // two zeros between any two bits
  bits &= 0x1fffff;
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

struct NodeBox {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  void add(const Vec3& point) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
};

struct Node {
  std::uint32_t begin = 0, end = 0;  // points, in Morton order
  std::uint32_t next = 0;            // node to go on with once this one is done with
  bool leaf = false;
  NodeBox box;
  double mass = 0;                 // kg
  Vec3 centre = Vec3::Zero();      // m, of mass
  Mat3 quadrupole = Mat3::Zero();  // kg m^2, sum m (3 x x^T - |x|^2 I) about the centre
  double far = 0;                  // m^2, squared distance from which it acts as a whole
};

class Tree {
 public:
  Tree(const PointMasses& points, double opening);
  [[nodiscard]] Pull at(std::uint32_t place) const;  // of a point by its place in the order
  [[nodiscard]] std::uint32_t point(std::uint32_t place) const { return keyed_[place].second; }

 private:
  void sort();
  void add_node(std::uint32_t begin, std::uint32_t end, int level);
  void weigh(std::size_t node);
  void add_moment(Node& node, double mass, const Vec3& at) const;

  const PointMasses& points_;
  double opening_, largest_radius_ = 0;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed_;  // Morton key, point
  std::vector<Node> nodes_;                                     // parents before their children
};

Tree::Tree(const PointMasses& points, double opening) : points_(points), opening_(opening) {
  for (const double radius : points.radius) largest_radius_ = std::max(largest_radius_, radius);
  sort();
  if (!keyed_.empty()) add_node(0, static_cast<std::uint32_t>(keyed_.size()), kDepth - 1);
}

void Tree::sort() {
  NodeBox box;
  for (const Vec3& point : points_.position) box.add(point);
  const double cells = (1 << kDepth) - 1;
  const double side = std::max((box.high - box.low).maxCoeff(), cells * std::numeric_limits<double>::min());
  const double scale = cells / side;  // finite, all at one place too
  keyed_.resize(points_.position.size());
  parallel_for_each(keyed_.size(), [&](std::size_t i) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key |= spread(static_cast<std::uint64_t>((points_.position[i][axis] - box.low[axis]) * scale)) << axis;
    keyed_[i] = {key, static_cast<std::uint32_t>(i)};
  });
  parallel_sort(keyed_.begin(), keyed_.end(), std::less<>());
}

void Tree::add_node(std::uint32_t begin, std::uint32_t end, int level) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  nodes_[self].begin = begin;
  nodes_[self].end = end;
  nodes_[self].leaf = end - begin <= kLeaf || level < 0;
  if (!nodes_[self].leaf)
    for (std::uint32_t from = begin; from < end;) {
      const std::uint64_t digit = keyed_[from].first >> (3 * level);
      std::uint32_t to = from;
      while (to < end && keyed_[to].first >> (3 * level) == digit) ++to;
      add_node(from, to, level - 1);
      from = to;
    }
  nodes_[self].next = static_cast<std::uint32_t>(nodes_.size());
  weigh(self);
}

void Tree::add_moment(Node& node, double mass, const Vec3& at) const {
  const Vec3 x = at - node.centre;
  node.quadrupole += mass * (3 * x * x.transpose() - x.squaredNorm() * Mat3::Identity());
}

void Tree::weigh(std::size_t self) {
  Node& node = nodes_[self];
  const auto each_child = [&](const auto& use) {
    for (std::size_t child = self + 1; child < node.next; child = nodes_[child].next) use(nodes_[child]);
  };
  const auto each_point = [&](const auto& use) {
    for (std::uint32_t i = node.begin; i < node.end; ++i) use(keyed_[i].second);
  };
  if (node.leaf) {
    each_point([&](std::uint32_t p) {
      node.box.add(points_.position[p]);
      node.mass += points_.mass[p];
      node.centre += points_.mass[p] * points_.position[p];
    });
  } else {
    each_child([&](const Node& child) {
      node.box.add(child.box.low);
      node.box.add(child.box.high);
      node.mass += child.mass;
      node.centre += child.mass * child.centre;
    });
  }
  node.centre /= node.mass;
  if (node.leaf)
    each_point([&](std::uint32_t p) { add_moment(node, points_.mass[p], points_.position[p]); });
  else
    each_child([&](const Node& child) {
      node.quadrupole += child.quadrupole;
      add_moment(node, child.mass, child.centre);
    });
  const double off = (node.centre - 0.5 * (node.box.low + node.box.high)).norm();
  const double far = (node.box.high - node.box.low).maxCoeff() / opening_ + off + largest_radius_;
  node.far = far * far;
}

Pull Tree::at(std::uint32_t place) const {
  const std::uint32_t self = keyed_[place].second;
  const Vec3& from = points_.position[self];
  Pull sum;
  for (std::uint32_t n = 0; n < nodes_.size();) {
    const Node& node = nodes_[n];
    const Vec3 d = node.centre - from;
    const double squared = d.squaredNorm();
    if (squared > node.far) {
      const double inverse2 = 1 / squared, inverse = std::sqrt(inverse2), inverse3 = inverse * inverse2,
                   inverse5 = inverse3 * inverse2;
      const Vec3 across = node.quadrupole * d;
      const double along = d.dot(across) * inverse2;
      sum.field += (node.mass * inverse3 + 2.5 * along * inverse5) * d - inverse5 * across;
      sum.potential -= node.mass * inverse + 0.5 * along * inverse3;
      sum.tide += node.mass * inverse3;
      n = node.next;
    } else if (node.leaf) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) {
        const std::uint32_t other = keyed_[i].second;
        if (other == self) continue;
        const Pull each = pull_of(points_.mass[other], points_.position[other] - from,
                                  0.5 * (points_.radius[self] + points_.radius[other]));
        sum.field += each.field;
        sum.potential += each.potential;
        sum.tide += each.tide;
      }
      n = node.next;
    } else {
      ++n;
    }
  }
  return sum;
}

}  // namespace

Attraction attraction_by_tree(const PointMasses& points, double opening) {
  const std::size_t count = points.mass.size();
  Attraction result;
  result.field.resize(count);
  result.potential.resize(count);
  result.tide.resize(count);
  const Tree tree(points, opening);
  parallel_for_each(
      count,
      [&](std::size_t i) {
        const auto place = static_cast<std::uint32_t>(i);
        const std::uint32_t point = tree.point(place);
        const Pull pull = tree.at(place);
        result.field[point] = pull.field;
        result.potential[point] = pull.potential;
        result.tide[point] = pull.tide;
      },
      kTreeGrain);
  Vec3 net = Vec3::Zero();
  double mass = 0;
  for (std::size_t i = 0; i < count; ++i) {
    net += points.mass[i] * result.field[i];
    mass += points.mass[i];
  }
  for (Vec3& field : result.field) field -= net / mass;
  return result;
}

}  // namespace flexel::simulate
