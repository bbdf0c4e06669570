// A patch has the sum of areas, and the means by area of places, weights and normals.
#include "simulate/contact/points/merged_patches.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "simulate/contact/points/broad_phase.h"

namespace flexel::simulate {
namespace {

constexpr double kMostArea = 1.0;      // of h^2, of what is joined
constexpr double kSameNormal = 0.985;  // cosine of 10 degrees: more would flatten what is curved
constexpr double kOnPlane = 0.2;       // spacings, from the other's plane
constexpr double kMostReach = 1.15;  // sum of the weights' sizes: how far outside of its cell a patch may lie
constexpr std::size_t kSharedSide = 4;  // elements

std::size_t shared_elements(const InterpolationWeights& a, const InterpolationWeights& b) {
  return static_cast<std::size_t>(std::count_if(a.elements.begin(), a.elements.end(), [&](std::uint32_t e) {
    return std::find(b.elements.begin(), b.elements.end(), e) != b.elements.end();
  }));
}

// At `place` in the cell of `point`, which carries it at its own place.
std::array<double, 8> weights_at(const Lattice& lattice, const Vec3& place, const ContactPoint& point) {
  Vec3 at = lattice.to_lattice(place) - lattice.to_lattice(point.rest);
  for (std::size_t a = 0; a < 8; ++a)
    for (int axis = 0; axis < 3; ++axis)
      if (a >> axis & 1u) at[axis] += point.at.weights[a];
  std::array<double, 8> weights{};
  for (std::size_t a = 0; a < 8; ++a) {
    weights[a] = 1;
    for (int axis = 0; axis < 3; ++axis) weights[a] *= a >> axis & 1u ? at[axis] : 1 - at[axis];
  }
  return weights;
}

// The mean of two places of a curved surface lies under it, by share (1 - share) / 2 of what their normals and
// places differ by.
ContactPoint joined(const Lattice& lattice, const ContactPoint& small, const ContactPoint& large) {
  ContactPoint both = large;
  both.area = small.area + large.area;
  const double share = small.area / both.area;
  const Vec3 way = small.rest - large.rest;
  both.normal = ((1 - share) * large.normal + share * small.normal).normalized();
  const double under = 0.5 * share * (1 - share) * way.dot(small.normal - large.normal);
  both.rest += share * way + under * both.normal;
  both.at.weights = weights_at(lattice, both.rest, large);
  return both;
}

bool may_join(const ContactPoint& small, const ContactPoint& large) {
  const Vec3 way = large.rest - small.rest;
  const double width = large.width;
  return small.area + large.area <= kMostArea * width * width &&
         small.normal.dot(large.normal) > kSameNormal &&
         std::max(std::abs(way.dot(small.normal)), std::abs(way.dot(large.normal))) < kOnPlane * width &&
         shared_elements(small.at, large.at) >= kSharedSide;
}

double reach(const ContactPoint& point) {
  double sum = 0;
  for (const double weight : point.at.weights) sum += std::abs(weight);
  return sum;
}

}  // namespace

std::vector<ContactPoint> merged_patches(const Lattice& lattice, std::vector<ContactPoint> patches) {
  std::vector<Vec3> at;
  double width = 0;
  for (const ContactPoint& patch : patches) {
    at.push_back(patch.rest);
    width = std::max(width, patch.width);
  }
  if (patches.empty()) return patches;
  std::vector<std::vector<std::uint32_t>> near(patches.size());
  const Neighbours found = neighbours_within(at, width, [&](std::uint32_t i, std::uint32_t j) {
    return shared_elements(patches[i].at, patches[j].at) >= kSharedSide;
  });
  for (std::uint32_t i = 0; i < patches.size(); ++i)
    for (const std::uint32_t j : found.of(i)) near[i].push_back(j), near[j].push_back(i);
  std::vector<std::uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return patches[a].area < patches[b].area; });
  std::vector<std::uint8_t> gone(patches.size(), 0);
  for (const std::uint32_t i : order) {
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t to = i;
    for (const std::uint32_t j : near[i]) {
      const double distance = (patches[j].rest - patches[i].rest).norm();
      if (gone[j] || patches[j].area < patches[i].area || !(distance < nearest)) continue;
      if (!may_join(patches[i], patches[j]) || reach(joined(lattice, patches[i], patches[j])) > kMostReach)
        continue;
      nearest = distance;
      to = j;
    }
    if (to == i) continue;
    patches[to] = joined(lattice, patches[i], patches[to]);
    gone[i] = 1;
  }
  std::vector<ContactPoint> kept;
  for (std::size_t i = 0; i < patches.size(); ++i)
    if (!gone[i]) kept.push_back(patches[i]);
  return kept;
}

}  // namespace flexel::simulate
