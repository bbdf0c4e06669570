// Facing points are joined where the elements of one reach those of the other along a few connections.
#include "simulate/contact/pairs/excluded_pairs.h"

#include <algorithm>

namespace flexel::simulate {
namespace {

constexpr double kNear = 2.5;      // spacings at rest, within which joined points do not touch
constexpr int kHops = 2;           // connections between the cells of joined points, at most
constexpr double kSameSide = 0.3;  // cosine between normals at rest above which points are on one side

// Elements within kHops connections of those that carry `point`, ascending.
std::vector<std::uint32_t> reached_from(const ContactPoint& point, const Adjacency& matter) {
  const InterpolationWeights& from = point.at;
  std::vector<std::uint32_t> reached(from.elements.begin(), from.elements.begin() + from.count);
  for (int hop = 0; hop < kHops; ++hop) {
    const std::size_t end = reached.size();
    for (std::size_t r = 0; r < end; ++r)
      for (const std::uint32_t next : matter.of(reached[r])) reached.push_back(next);
    std::sort(reached.begin(), reached.end());
    reached.erase(std::unique(reached.begin(), reached.end()), reached.end());
  }
  return reached;
}

}  // namespace

ExcludedPairs::ExcludedPairs(const ContactSettings& settings, const Problem& problem,
                             const ContactSurface& surface)
    : settings_(settings), surface_(surface) {
  if (settings.self && !surface.points().empty()) find_joined(problem);
}

void ExcludedPairs::find_joined(const Problem& problem) {
  const std::vector<ContactPoint>& points = surface_.points();
  std::vector<Vec3> rest;
  for (const ContactPoint& point : points) rest.push_back(point.rest);
  const Neighbours facing =
      neighbours_within(rest, kNear * surface_.widest(), [&](std::uint32_t i, std::uint32_t j) {
        const ContactPoint &a = points[i], &b = points[j];
        return a.part == b.part && (a.rest - b.rest).norm() < kNear * a.width &&
               a.normal.dot(b.normal) < kSameSide;
      });
  const Adjacency matter = element_adjacency(problem.body);
  std::vector<std::vector<std::uint32_t>> joined(points.size());
  parallel_for_each(
      points.size(),
      [&](std::size_t i) {
        if (facing.of(i).empty()) return;
        const std::vector<std::uint32_t> reached = reached_from(points[i], matter);
        for (const std::uint32_t j : facing.of(i)) {
          const InterpolationWeights& to = points[j].at;
          if (std::any_of(to.elements.begin(), to.elements.begin() + to.count, [&](std::uint32_t element) {
                return std::binary_search(reached.begin(), reached.end(), element);
              }))
            joined[i].push_back(j);
        }
      },
      64);
  joined_.offsets.assign(1, 0);
  for (const auto& own : joined) {
    joined_.others.insert(joined_.others.end(), own.begin(), own.end());
    joined_.offsets.push_back(joined_.others.size());
  }
}

bool ExcludedPairs::contains(std::uint32_t i, std::uint32_t j) const {
  return surface_.points()[i].part == surface_.points()[j].part ? joined(i, j) : bonded(i, j);
}

bool ExcludedPairs::joined(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  if ((a.rest - b.rest).norm() >= kNear * a.width) return false;
  if (a.normal.dot(b.normal) >= kSameSide && a.shape != ContactShape::ball) return true;
  const std::span<const std::uint32_t> others = joined_.of(std::min(i, j));
  return std::binary_search(others.begin(), others.end(), std::max(i, j));
}

bool ExcludedPairs::bonded(std::uint32_t i, std::uint32_t j) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  const std::array parts{std::min(a.part, b.part), std::max(a.part, b.part)};
  return std::find(settings_.bonded.begin(), settings_.bonded.end(), parts) != settings_.bonded.end() &&
         (a.rest - b.rest).norm() < kNear * std::max(a.width, b.width);
}

}  // namespace flexel::simulate
