// Rings of connected elements are added until three of them span space with the origin. A cheap test comes
// first: the nearest element, the one most across it, the one most out of their plane. Then well-conditioned
// elements are taken in order of distance to the middle of the vertex's octant, which in a whole lattice
// gives the three axis neighbours on the vertex's side.
#include "mapping/anchors/search.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace flexel::mapping {
namespace {

struct Candidate {
  double squared_distance;  // to the middle of the octant
  std::uint32_t element;
  Vec3 edge;  // from the origin
};

// A pair with a smaller sine cannot reach kWellConditioned with any third edge.
constexpr double kWellApart = 0.3;

bool spans_space(const std::vector<Candidate>& candidates) {
  const Vec3& first = candidates.front().edge;
  Vec3 normal = Vec3::Zero();
  double best = 0;
  for (const Candidate& b : candidates) {
    const double across = sine(first, b.edge);
    if (across > best) {
      best = across;
      normal = first.cross(b.edge).normalized();
    }
  }
  return best >= kWellApart && std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) {
           return best * std::abs(normal.dot(c.edge)) >= kWellConditioned * c.edge.norm();
         });
}

// Fills elements 1..3 of the frame with the closest good triple.
bool choose_triple(const std::vector<Candidate>& candidates, Frame& frame) {
  if (candidates.size() < 3 || !spans_space(candidates)) return false;
  const Candidate& a = candidates.front();
  for (std::size_t j = 1; j < candidates.size(); ++j) {
    const Candidate& b = candidates[j];
    if (sine(a.edge, b.edge) < kWellApart) continue;
    for (std::size_t k = 1; k < candidates.size(); ++k) {
      const Candidate& c = candidates[k];
      if (std::abs(normalised_determinant(a.edge, b.edge, c.edge)) < kWellConditioned) continue;
      frame.elements = {frame.elements[0], a.element, b.element, c.element};
      frame.kind = FrameKind::full;
      return true;
    }
  }
  return false;
}

// What is left when nothing spans space.
void choose_fewer(const std::vector<Candidate>& candidates, Frame& frame) {
  const std::uint32_t origin = frame.elements[0];
  if (candidates.empty()) return;
  const Candidate& a = candidates.front();
  frame.elements = {origin, a.element, origin, origin};
  frame.kind = FrameKind::line;
  for (const Candidate& b : candidates)
    if (sine(a.edge, b.edge) >= kWellApart) {
      frame.elements = {origin, a.element, b.element, origin};
      frame.kind = FrameKind::plane;
      return;
    }
}

// Adds the neighbours of known[begin ...] that are not yet known.
void widen(const Adjacency& connections, std::vector<std::uint32_t>& known, std::size_t begin) {
  const std::size_t end = known.size();
  for (std::size_t i = begin; i < end; ++i)
    for (const std::uint32_t neighbour : connections.of(known[i]))
      if (std::find(known.begin(), known.end(), neighbour) == known.end()) known.push_back(neighbour);
}

}  // namespace

Frame find_frame(const Body& body, const Adjacency& connections, const Part& part, std::uint32_t origin,
                 int octant) {
  const Vec3 sides(octant & 1 ? 1 : -1, octant & 2 ? 1 : -1, octant & 4 ? 1 : -1);
  // Distances are taken on the lattice, where equal ones are exactly equal however the lattice is turned and
  // whatever the unit.
  const Vec3 proportions = part.lattice.spacing / part.lattice.spacing.maxCoeff();
  const auto to_middle = [&](std::uint32_t element) -> Vec3 {
    const Index3 &a = body.lattice_index[element], &b = body.lattice_index[origin];
    const Vec3 steps = Vec3(a[0], a[1], a[2]) - Vec3(b[0], b[1], b[2]);
    return (steps - sides / 4).cwiseProduct(proportions);
  };
  Frame frame;
  frame.elements = {origin, origin, origin, origin};
  std::vector<std::uint32_t> known{origin};
  std::vector<Candidate> candidates;
  std::size_t begin = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const std::size_t end = known.size();
    widen(connections, known, begin);
    if (known.size() == end) break;
    begin = end;
    frame.rings = static_cast<std::uint8_t>(ring);
    for (std::size_t i = end; i < known.size(); ++i) {
      const Vec3 edge = body.rest[known[i]] - body.rest[origin];
      if (edge.squaredNorm() > 0) candidates.push_back({to_middle(known[i]).squaredNorm(), known[i], edge});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                      : a.element < b.element;
    });
    if (choose_triple(candidates, frame)) return frame;
  }
  choose_fewer(candidates, frame);
  return frame;
}

std::optional<Frame> cell_frame(const Body& body, std::uint32_t cell, int corner) {
  if (body.broken[cell]) return std::nullopt;
  const std::array<std::uint32_t, 8>& element = body.cell_elements[cell];
  Frame frame;
  frame.elements = {element[corner], element[corner ^ 1], element[corner ^ 2], element[corner ^ 4]};
  frame.kind = FrameKind::full;
  const Vec3& origin = body.rest[frame.elements[0]];
  const auto edge = [&](int axis) -> Vec3 { return body.rest[frame.elements[axis]] - origin; };
  if (std::abs(normalised_determinant(edge(1), edge(2), edge(3))) < kWellConditioned) return std::nullopt;
  return frame;
}

}  // namespace flexel::mapping
