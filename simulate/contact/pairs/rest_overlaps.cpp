// A first pass over pairs of faces finds the mean overlap around each point, a second one whether all overlap by nearly that.
#include "simulate/contact/pairs/rest_overlaps.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flexel::simulate {
namespace {

constexpr double kOpposite = 0.9998;  // cosine of 1 degree, from which faces are as parts of one plane
constexpr double kBendReach = 3;      // spacings, within which a curved surface turns; its facets may be long
constexpr double kLooksAt = 0.5;      // cosine from which surfaces face each other
constexpr double kScatter = 0.5;      // standard deviations that a mean must exceed to be an interference
constexpr double kFitting = 0.9;      // share of the pairs' weight that overlaps by the mean, but for facets
constexpr double kNotFitting = std::numeric_limits<double>::quiet_NaN();

// (points) 1: a face beside which its part's surface turns by up to 60 degrees, as what is curved does, and not
// at an edge: beyond it, its plane is not the surface.
std::vector<std::uint8_t> curved_faces(const ContactSurface& surface) {
  constexpr double kMeets = 0.5;  // cosine of 60 degrees
  const std::vector<ContactPoint>& points = surface.points();
  std::vector<Vec3> at;
  at.reserve(points.size());
  for (const ContactPoint& point : points) at.push_back(point.rest);
  const Neighbours turned =
      neighbours_within(at, kBendReach * surface.widest(), [&](std::uint32_t i, std::uint32_t j) {
        const ContactPoint &a = points[i], &b = points[j];
        const double cosine = a.normal.dot(b.normal);
        return a.part == b.part && a.shape == ContactShape::face && b.shape == ContactShape::face &&
               cosine < kOpposite && cosine > kMeets;
      });
  std::vector<std::uint8_t> curved(points.size(), 0);
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : turned.of(i)) curved[i] = curved[j] = 1;
  return curved;
}

// What a point has before it at rest.
enum Paired : std::uint8_t { kAlone, kPaired, kPairedWithSeveral };

// Of two parts, both faces, near each other at rest.
struct FacingPair {
  std::uint32_t i = 0, j = 0;
  double weight = 0, depth = 0, most = 0;  // N/m; m: penetration, and what facets may add to it or take
};

// (points) Sums over the pairs of a point and of those of its part around it.
template <class Value>
std::vector<double> sums_around(const std::vector<FacingPair>& pairs, const Neighbours& around,
                                std::size_t points, const Value& value) {
  std::vector<double> own(points, 0);
  for (const FacingPair& pair : pairs) {
    own[pair.i] += value(pair, pair.i);
    own[pair.j] += value(pair, pair.j);
  }
  std::vector<double> sums = own;
  for (std::uint32_t a = 0; a < points; ++a)
    for (const std::uint32_t b : around.of(a)) {
      sums[a] += own[b];
      sums[b] += own[a];
    }
  return sums;
}

// Marks the points around which pairs are with several parts: how one of these fits says nothing of the others, but their own
// points know.
void mark_several(const std::vector<FacingPair>& pairs, const Neighbours& around,
                  const std::vector<ContactPoint>& points, std::vector<std::uint8_t>& is_paired) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max(), kSeveral = kNone - 1;
  const auto add = [](std::uint32_t& others, std::uint32_t other) {
    if (other != kNone) others = others == kNone || others == other ? other : kSeveral;
  };
  std::vector<std::uint32_t> own(points.size(), kNone);
  for (const FacingPair& pair : pairs) {
    add(own[pair.i], points[pair.j].part);
    add(own[pair.j], points[pair.i].part);
  }
  std::vector<std::uint32_t> others = own;
  for (std::uint32_t a = 0; a < points.size(); ++a)
    for (const std::uint32_t b : around.of(a)) {
      add(others[a], own[b]);
      add(others[b], own[a]);
    }
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (others[i] == kSeveral) is_paired[i] = kPairedWithSeveral;
}

}  // namespace

RestOverlaps::RestOverlaps(const ContactSettings& settings, const ContactSurface& surface,
                           const ContactMaterials& materials, const ExcludedPairs& excluded)
    : surface_(surface), released_(settings.release_time > 0) {
  if (std::count(settings.parts.begin(), settings.parts.end(), 1) < 2) return;
  curved_ = curved_faces(surface);
  interference_.assign(curved_.size(), kNotFitting);
  find_fits(materials, excluded);
}

ContactSide RestOverlaps::at_rest(std::uint32_t point) const {
  return surface_.at(point, Vec3::Zero(), CellShape{}).side;
}

// m, by which facets may overlap. A face has its plane alone: the rim of a hole is behind the planes of the patches
// beside it on the pin, within a spacing and at up to 60 degrees.
double RestOverlaps::most(std::uint32_t i, std::uint32_t j, const PairState& rest,
                          const PairConstants& constants) const {
  constexpr double kBending = 0.6;  // tangent of half of 60 degrees and a little
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  const double opposite = std::clamp(-a.normal.dot(b.normal), 0.0, 1.0);
  const bool edge = a.shape == ContactShape::edge || b.shape == ContactShape::edge;
  const double bending =
      edge ? kBending : std::sqrt((1 - opposite) / (1 + opposite));  // tan of half the angle
  return std::min(kTouchingDepth * std::min(a.width, b.width) + bending * rest.offset.norm(),
                  constants.law.hard);
}

void RestOverlaps::find_fits(const ContactMaterials& materials, const ExcludedPairs& excluded) {
  const std::vector<ContactPoint>& points = surface_.points();
  std::vector<Vec3> at;
  for (const ContactPoint& point : points) at.push_back(point.rest);
  const auto face = [&](std::uint32_t i) { return points[i].shape == ContactShape::face; };
  const Neighbours facing =
      neighbours_within(at, std::sqrt(2.0) * surface_.widest(), [&](std::uint32_t i, std::uint32_t j) {
        return points[i].part != points[j].part && (curved_[i] || curved_[j]) && face(i) && face(j) &&
               -points[i].normal.dot(points[j].normal) > kLooksAt && !excluded.contains(i, j);
      });
  std::vector<FacingPair> pairs;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : facing.of(i)) {
      const PairConstants constants = materials.between(i, j).constants;
      const PairState rest = pair_state(at_rest(i), at_rest(j), constants);
      if (rest.near && !rest.deep && rest.gap < constants.law.hard)
        pairs.push_back({i, j, rest.weight, -rest.gap, most(i, j, rest, constants)});
    }
  if (pairs.empty()) return;
  std::vector<std::uint8_t> is_paired(points.size(), kAlone);
  for (const FacingPair& pair : pairs) is_paired[pair.i] = is_paired[pair.j] = kPaired;
  const Neighbours around =
      neighbours_within(at, kBendReach * surface_.widest(), [&](std::uint32_t i, std::uint32_t j) {
        return points[i].part == points[j].part && is_paired[i] != kAlone && is_paired[j] != kAlone;
      });
  mark_several(pairs, around, points, is_paired);
  const auto sums = [&](const auto& value) { return sums_around(pairs, around, points.size(), value); };
  using Pair = const FacingPair&;
  const std::vector<double> weight = sums([](Pair pair, std::uint32_t) { return pair.weight; }),
                            depth = sums([](Pair pair, std::uint32_t) { return pair.weight * pair.depth; }),
                            square = sums([](Pair pair, std::uint32_t) {
                              return pair.weight * pair.depth * pair.depth;
                            });
  const std::vector<double> fits = sums([&](Pair pair, std::uint32_t point) {
    const double mean = depth[point] / weight[point];
    return std::abs(pair.depth - mean) <= pair.most ? pair.weight : 0;
  });
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (is_paired[i] != kPaired || !(weight[i] > 0) || !(fits[i] >= kFitting * weight[i])) continue;
    const double mean = depth[i] / weight[i];
    const double scatter = std::sqrt(std::max(square[i] / weight[i] - mean * mean, 0.0));
    interference_[i] = mean > kScatter * scatter ? mean : 0;
  }
  spread_to_rims(at, is_paired);
}

// Edges, and faces beyond those that have others before them, are of the fit beside them: the rim of a hole and the pin
// that comes out of it.
void RestOverlaps::spread_to_rims(const std::vector<Vec3>& at, const std::vector<std::uint8_t>& is_paired) {
  const std::vector<ContactPoint>& points = surface_.points();
  const Neighbours beside =
      neighbours_within(at, kBendReach * surface_.widest(), [&](std::uint32_t i, std::uint32_t j) {
        return points[i].part == points[j].part && (is_paired[i] == kAlone) != (is_paired[j] == kAlone) &&
               points[i].normal.dot(points[j].normal) > kLooksAt;
      });
  std::vector<double> sum(points.size(), 0), count(points.size(), 0);
  std::vector<std::uint8_t> of_several(points.size(), 0);
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : beside.of(i)) {
      const std::uint32_t fit = is_paired[i] != kAlone ? i : j, rim = is_paired[i] != kAlone ? j : i;
      if (is_paired[fit] == kPairedWithSeveral) of_several[rim] = 1;
      if (std::isnan(interference_[fit])) continue;
      sum[rim] += interference_[fit];
      count[rim] += 1;
    }
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (count[i] > 0 && of_several[i] == 0) interference_[i] = sum[i] / count[i];
}

// What overlaps a flat face presses, at any angle, and so does what faces the other squarely.
double RestOverlaps::of(std::uint32_t i, std::uint32_t j, const PairConstants& constants) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  const bool balls = a.shape == ContactShape::ball || b.shape == ContactShape::ball;
  if (a.part == b.part || balls || curved_.empty() || !(curved_[i] || curved_[j])) return 0;
  const PairState rest = pair_state(at_rest(i), at_rest(j), constants);
  if (!rest.near || rest.deep || !(rest.gap < 0) || -a.normal.dot(b.normal) > kOpposite) return 0;
  // Where the surfaces fit, all that lies deeper is of facets, and of a rim behind the planes of what is beside it.
  double mean = 0.5 * (interference_[i] + interference_[j]);
  if (std::isnan(mean)) mean = std::isnan(interference_[i]) ? interference_[j] : interference_[i];
  if (!std::isnan(mean)) return std::max(-rest.gap - mean, 0.0);
  return !released_ && -rest.gap <= most(i, j, rest, constants) ? -rest.gap : 0;
}

}  // namespace flexel::simulate
