// A first pass over pairs of faces finds how surfaces overlap around each point as a whole, by least squares; a second one
// whether all pairs there overlap by nearly that.
#include "simulate/contact/pairs/rest_overlaps.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/math/dense.h"

namespace flexel::simulate {
namespace {

constexpr double kOpposite = 0.9998;  // cosine of 1 degree, from which faces are as parts of one plane
constexpr double kBendReach = 3;      // spacings, within which a curved surface turns; its facets may be long
constexpr double kLooksAt = 0.5;      // cosine from which surfaces face each other
constexpr double kScatter = 0.5;      // standard deviations that the whole must exceed to be more than facets
constexpr double kFitting = 0.9;      // share of the pairs' weight that overlaps by the whole, but for facets
constexpr double kRidge = 1e-3;       // variance of normals below which they do not tell an offset
constexpr double kMostOffset = 1;     // spacings: a larger one is none, but the surfaces' curvatures differ

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
  Vec3 normal = Vec3::Zero();              // out of i
};

// (points) Sums over the pairs of a point and of those of its part around it.
template <class Sum, class Value>
std::vector<Sum> sums_around(const std::vector<FacingPair>& pairs, const Neighbours& around,
                             const std::vector<Sum>& zeros, const Value& value) {
  std::vector<Sum> own = zeros;
  for (const FacingPair& pair : pairs) {
    own[pair.i] += value(pair, pair.i);
    own[pair.j] += value(pair, pair.j);
  }
  std::vector<Sum> sums = own;
  for (std::uint32_t a = 0; a < sums.size(); ++a)
    for (const std::uint32_t b : around.of(a)) {
      sums[a] += own[b];
      sums[b] += own[a];
    }
  return sums;
}

// Weighted sums of x x^T with x = (1, normal, depth): all that least squares need.
using OverlapMoments = Eigen::Matrix<double, 5, 5>;

OverlapMoments overlap_moments(const FacingPair& pair) {
  Eigen::Matrix<double, 5, 1> x;
  x << 1, pair.normal, pair.depth;
  return pair.weight * x * x.transpose();
}

// The overlap of least squares; a normal along which the pairs hardly differ adds nothing to it. Its scatter is what
// remains, its size the root mean square of the overlap itself.
struct WholeOverlap {
  RestFit fit;
  double size = 0, scatter = 0;  // m
};

WholeOverlap least_squares_overlap(const OverlapMoments& sums) {
  const double weight = sums(0, 0);
  const OverlapMoments mean = sums / weight;
  const Vec3 normal = mean.block<3, 1>(1, 0);
  const double depth = mean(4, 0);
  const Mat3 spread = mean.block<3, 3>(1, 1) - normal * normal.transpose();
  const Vec3 slope = mean.block<3, 1>(1, 4) - depth * normal;
  WholeOverlap whole;
  whole.fit.offset = solve_symmetric_3(spread + kRidge * Mat3::Identity(), slope);
  whole.fit.depth = depth - whole.fit.offset.dot(normal);
  const double explained = whole.fit.offset.dot(spread * whole.fit.offset),
               left = mean(4, 4) - depth * depth - 2 * whole.fit.offset.dot(slope) + explained;
  whole.size = std::sqrt(depth * depth + std::max(explained, 0.0));
  whole.scatter = std::sqrt(std::max(left, 0.0));
  return whole;
}

// Whether facets hide what the surfaces around a point overlap by at most, or contact is too soft for that (its first
// hundredth of a spacing): it may press with a third of its force, with 1.7 times that or not at all. Surfaces that fit so
// well that nothing can press are sure, and so is a clearance wider than the facets.
bool is_unsure(const WholeOverlap& whole, double width) {
  // spacings: an overlap that presses within a quarter beside fine facets; that and half of the scatter, which are nothing
  constexpr double kTrusted = 0.02, kNegligible = 0.005;
  constexpr double kBeyond = 2;  // standard deviations of coarse facets, likewise
  const double most = whole.fit.depth + whole.fit.offset.norm();
  return std::abs(most) < std::max(kTrusted * width, kBeyond * whole.scatter) &&
         whole.size + 0.5 * whole.scatter > kNegligible * width;
}

// Parts of which a quarter of what fits or more is unsure. Curved surfaces alone fit each other: a roller on a plate does not.
std::vector<UnsureFit> unsure_fits(const std::vector<FacingPair>& pairs, const std::vector<RestFit>& fits,
                                   const std::vector<WholeOverlap>& wholes,
                                   const std::vector<std::uint8_t>& curved, const ContactSurface& surface) {
  constexpr double kShare = 0.25;
  struct Weights {
    double all = 0, unsure = 0, squares = 0, width = 0;  // N/m; N/m; N m; m
  };
  std::map<std::array<std::uint32_t, 2>, Weights> of_parts;
  for (const FacingPair& pair : pairs) {
    const std::uint32_t a = surface.points()[pair.i].part, b = surface.points()[pair.j].part;
    if (!curved[pair.i] || !curved[pair.j] || (surface.prescribed(a) && surface.prescribed(b))) continue;
    for (const std::uint32_t point : {pair.i, pair.j}) {
      if (!fits[point].is_one) continue;
      Weights& sum = of_parts[{std::min(a, b), std::max(a, b)}];
      sum.all += pair.weight;
      sum.width = surface.points()[point].width;
      if (!is_unsure(wholes[point], sum.width)) continue;
      sum.unsure += pair.weight;
      sum.squares += pair.weight * wholes[point].size * wholes[point].size;
    }
  }
  std::vector<UnsureFit> unsure;
  for (const auto& [parts, sum] : of_parts)
    if (sum.unsure > kShare * sum.all)
      unsure.push_back({parts, std::sqrt(sum.squares / sum.unsure), sum.width});
  return unsure;
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
  fits_.assign(curved_.size(), {});
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
        pairs.push_back({i, j, rest.weight, -rest.gap, most(i, j, rest, constants), rest.normal});
    }
  if (pairs.empty()) return;
  std::vector<std::uint8_t> is_paired(points.size(), kAlone);
  for (const FacingPair& pair : pairs) is_paired[pair.i] = is_paired[pair.j] = kPaired;
  const Neighbours around =
      neighbours_within(at, kBendReach * surface_.widest(), [&](std::uint32_t i, std::uint32_t j) {
        return points[i].part == points[j].part && is_paired[i] != kAlone && is_paired[j] != kAlone;
      });
  mark_several(pairs, around, points, is_paired);
  const std::vector<OverlapMoments> moments =
      sums_around(pairs, around, std::vector<OverlapMoments>(points.size(), OverlapMoments::Zero()),
                  [](const FacingPair& pair, std::uint32_t) { return overlap_moments(pair); });
  std::vector<WholeOverlap> wholes(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (moments[i](0, 0) > 0) wholes[i] = least_squares_overlap(moments[i]);
  const std::vector<double> fitting = sums_around(
      pairs, around, std::vector<double>(points.size(), 0), [&](const FacingPair& pair, std::uint32_t point) {
        return std::abs(pair.depth - wholes[point].fit.along(pair.normal)) <= pair.most ? pair.weight : 0;
      });
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const WholeOverlap& whole = wholes[i];
    if (is_paired[i] != kPaired || !(fitting[i] >= kFitting * moments[i](0, 0)) ||
        whole.fit.offset.norm() > kMostOffset * points[i].width)
      continue;
    if (whole.size > kScatter * whole.scatter) fits_[i] = whole.fit;
    fits_[i].is_one = true;
  }
  unsure_ = unsure_fits(pairs, fits_, wholes, curved_, surface_);
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
  std::vector<RestFit> sum(points.size());
  std::vector<double> count(points.size(), 0);
  std::vector<std::uint8_t> of_several(points.size(), 0);
  for (std::uint32_t i = 0; i < points.size(); ++i)
    for (const std::uint32_t j : beside.of(i)) {
      const std::uint32_t fit = is_paired[i] != kAlone ? i : j, rim = is_paired[i] != kAlone ? j : i;
      if (is_paired[fit] == kPairedWithSeveral) of_several[rim] = 1;
      if (!fits_[fit].is_one) continue;
      sum[rim].depth += fits_[fit].depth;
      sum[rim].offset += fits_[fit].offset;
      count[rim] += 1;
    }
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (count[i] > 0 && of_several[i] == 0)
      fits_[i] = {true, sum[i].depth / count[i], sum[i].offset / count[i]};
}

// What overlaps a flat face presses, at any angle, and so does what faces the other squarely.
double RestOverlaps::of(std::uint32_t i, std::uint32_t j, const PairConstants& constants) const {
  const ContactPoint &a = surface_.points()[i], &b = surface_.points()[j];
  const bool balls = a.shape == ContactShape::ball || b.shape == ContactShape::ball;
  if (a.part == b.part || balls || curved_.empty() || !(curved_[i] || curved_[j])) return 0;
  const PairState rest = pair_state(at_rest(i), at_rest(j), constants);
  if (!rest.near || rest.deep || !(rest.gap < 0) || -a.normal.dot(b.normal) > kOpposite) return 0;
  // Where the surfaces fit, all that lies deeper is of facets, and of a rim behind the planes of what is beside it.
  const RestFit &of_i = fits_[i], &of_j = fits_[j];
  const double along_i = of_i.along(rest.normal), along_j = of_j.along(rest.normal);
  if (of_i.is_one || of_j.is_one) {
    const double whole = of_i.is_one && of_j.is_one ? 0.5 * (along_i + along_j)
                         : of_i.is_one              ? along_i
                                                    : along_j;
    return std::max(-rest.gap - std::max(whole, 0.0), 0.0);
  }
  return !released_ && -rest.gap <= most(i, j, rest, constants) ? -rest.gap : 0;
}

}  // namespace flexel::simulate
