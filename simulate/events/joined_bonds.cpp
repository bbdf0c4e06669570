// Of the coarser part's surface points, in a grid of its spacing, the polygons of those around a point are tried.
#include "simulate/events/joined_bonds.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>

#include "base/error.h"
#include "base/math/distance.h"
#include "base/program/progress.h"
#include "formats/lattice/locate.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {
namespace {

constexpr double kJoinFacing = -0.7;  // cosine between the normals
constexpr int kJoinRounds = 30;
constexpr double kJoinFound = 1e-13;  // of the spacing
constexpr double kJoinReach = 3;      // spacings that a point may be led back by

using PartPair = std::array<std::uint32_t, 2>;  // the lower number first

PartPair pair_of(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

// Matter of one part near its surface, as it is now: a cell, or an element with its neighbours.
class MovedCarrier {
 public:
  MovedCarrier(const Problem& problem, const State& state, std::uint32_t polygon, const Vec3& rest,
               const Vec3& outward)
      : problem_(problem),
        state_(state),
        part_(problem.body.parts[problem.body.surface.polygon_part(polygon)]) {
    if (part_.placement == Placement::corner) {
      const auto found = locate_on_surface(problem.body, polygon, rest);
      if (found && !problem.body.broken[found->cell]) number_ = found->cell;
    } else {
      number_ = nearest_element(problem, problem.body.surface.polygon_part(polygon), rest, outward);
    }
  }
  [[nodiscard]] bool found() const { return number_.has_value(); }
  [[nodiscard]] InterpolationWeights at(const Vec3& rest) const {
    if (part_.placement == Placement::corner)
      return cell_carrier(problem_.body, cell_point(problem_.body, *number_, rest));
    return with_gradient(problem_, {{*number_}, {1}, 1}, rest);
  }
  [[nodiscard]] Vec3 now(const Vec3& rest) const {
    const InterpolationWeights weights = at(rest);
    Vec3 point = Vec3::Zero();
    for (std::uint32_t a = 0; a < weights.count; ++a) {
      const std::uint32_t e = weights.elements[a];
      point += weights.weights[a] * (problem_.body.rest[e] + state_.displacement[e]);
    }
    return point;
  }
  // Deformation gradient: what is carried is linear along each axis of the lattice.
  [[nodiscard]] Mat3 gradient(const Vec3& rest) const {
    Mat3 moved;
    const Vec3 here = now(rest);
    for (int axis = 0; axis < 3; ++axis) {
      const double width = part_.lattice.spacing[axis];
      moved.col(axis) = (now(rest + width * part_.lattice.axes.col(axis)) - here) / width;
    }
    return moved * part_.lattice.axes.transpose();
  }
  // The rest point that is at `point` now, looked for from `rest` on; nothing where Newton's method does not find it.
  [[nodiscard]] std::optional<Vec3> rest_of(const Vec3& point, const Vec3& rest) const {
    const double spacing = part_.lattice.spacing.minCoeff();
    Vec3 found = rest;
    for (int round = 0; round < kJoinRounds; ++round) {
      const Mat3 moved = gradient(found);
      if (!(moved.determinant() > 0)) return std::nullopt;
      const Vec3 change = moved.inverse() * (point - now(found));
      found += change;
      if (!((found - rest).norm() < kJoinReach * spacing)) return std::nullopt;
      if (change.norm() <= kJoinFound * spacing) return found;
    }
    return std::nullopt;
  }
  // One element of model `paper` on its own along some axis, whose neighbours do not say where its surface is.
  [[nodiscard]] bool is_flat(const Vec3& rest) const {
    constexpr double kNoVolume = 1e-9;
    return part_.placement == Placement::centre && !(std::abs(gradient(rest).determinant()) > kNoVolume);
  }
  // A normal at rest, as it is turned now.
  [[nodiscard]] Vec3 turned(const Vec3& rest, const Vec3& normal) const {
    return (gradient(rest).inverse().transpose() * normal).normalized();
  }

 private:
  const Problem& problem_;
  const State& state_;
  const Part& part_;
  std::optional<std::uint32_t> number_;  // of a cell or an element
};

struct MovedSample {
  SurfacePoint point;
  Vec3 now = Vec3::Zero();  // m
};

using GridCube = std::array<std::int64_t, 3>;
struct GridCubeHash {
  std::size_t operator()(const GridCube& at) const {
    std::uint64_t hash = 0;
    for (const std::int64_t each : at) hash = (hash ^ static_cast<std::uint64_t>(each)) * 0x9e3779b97f4a7c15u;
    return hash;
  }
};

// Samples of one surface by where they are now.
class SampleGrid {
 public:
  SampleGrid(std::vector<MovedSample> samples, double width) : samples_(std::move(samples)), width_(width) {
    for (const MovedSample& each : samples_) cubes_[cube(each.now)].push_back(&each);
  }
  SampleGrid(const SampleGrid&) = delete;
  SampleGrid& operator=(const SampleGrid&) = delete;
  // Of each polygon that has some within the width of a point, the one nearest to it; by polygon.
  [[nodiscard]] std::vector<const MovedSample*> around(const Vec3& point) const {
    std::map<std::uint32_t, const MovedSample*> nearest;
    const GridCube home = cube(point);
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto found = cubes_.find({home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1});
      if (found == cubes_.end()) continue;
      for (const MovedSample* each : found->second) {
        const MovedSample*& known = nearest.try_emplace(each->point.polygon, each).first->second;
        if ((each->now - point).norm() < (known->now - point).norm()) known = each;
      }
    }
    std::vector<const MovedSample*> found;
    for (const auto& [polygon, each] : nearest) found.push_back(each);
    return found;
  }

 private:
  [[nodiscard]] GridCube cube(const Vec3& at) const {
    const auto along = [&](int axis) { return std::llround(std::floor(at[axis] / width_)); };
    return {along(0), along(1), along(2)};
  }
  std::vector<MovedSample> samples_;
  double width_;
  std::unordered_map<GridCube, std::vector<const MovedSample*>, GridCubeHash> cubes_;
};

class JoinedBonds {
 public:
  JoinedBonds(const Problem& problem, const State& state);
  // Appends the points in which two parts touch within a distance [m]; adds to `flat` those of the two that have elements
  // there of which that cannot be told.
  void touch(std::uint32_t a, std::uint32_t b, double gap, std::vector<FusedPoint>& points,
             std::set<std::uint32_t>& flat) const;

 private:
  struct Touching {
    double distance = 0;  // m, at rest, of the polygon
    InterpolationWeights weights;
  };
  [[nodiscard]] std::vector<MovedSample> samples(std::uint32_t part, const Box& near,
                                                 std::set<std::uint32_t>& flat) const;
  [[nodiscard]] std::optional<Touching> touching(const MovedSample& point, const Vec3& normal,
                                                 const MovedSample& other, double limit) const;
  [[nodiscard]] double distance(const Vec3& rest, std::uint32_t polygon) const;
  [[nodiscard]] double foundation(std::uint32_t part, const InterpolationWeights& at) const;

  const Problem& problem_;
  const Body& body_;
  const State& state_;
  ChangeAround stiffer_;  // by edits
  double diagonal_;       // m, of the surface at rest
  Triangles triangles_;
  std::vector<std::uint32_t> first_triangle_;  // (polygons + 1)
  std::vector<Box> box_;  // (parts) of the elements as they are now, with a spacing around
};

JoinedBonds::JoinedBonds(const Problem& problem, const State& state)
    : problem_(problem),
      body_(problem.body),
      state_(state),
      stiffer_(problem.body, "stiffness_change"),
      diagonal_(bounding_box(problem.body.surface.vertices).diagonal()),
      triangles_(triangulate(problem.body.surface)) {
  first_triangle_.assign(body_.surface.polygon_count() + 1, 0);
  for (const std::uint32_t polygon : triangles_.polygon) ++first_triangle_[polygon + 1];
  for (std::size_t p = 0; p < body_.surface.polygon_count(); ++p)
    first_triangle_[p + 1] += first_triangle_[p];
  for (const Part& part : body_.parts) {
    Box box;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      box.add(body_.rest[e] + state.displacement[e]);
    box.min.array() -= part.lattice.spacing.maxCoeff();
    box.max.array() += part.lattice.spacing.maxCoeff();
    box_.push_back(box);
  }
}

// Points of a part's surface that are in a box now.
std::vector<MovedSample> JoinedBonds::samples(std::uint32_t part, const Box& near,
                                              std::set<std::uint32_t>& flat) const {
  constexpr std::size_t kAtATime = 16384;  // triangles: of their points few are near
  std::vector<MovedSample> found;
  std::vector<std::uint32_t> chosen;
  const auto take = [&] {
    for (const SurfacePoint& point : surface_points(problem_, triangles_, chosen)) {
      const MovedCarrier carrier(problem_, state_, point.polygon, point.position, point.area_vector);
      if (!carrier.found()) continue;
      const Vec3 now = carrier.now(point.position);
      if (!(now.array() >= near.min.array()).all() || !(now.array() <= near.max.array()).all()) continue;
      if (carrier.is_flat(point.position))
        flat.insert(part);
      else
        found.push_back({point, now});
    }
    chosen.clear();
  };
  for (std::uint32_t t = 0; t < triangles_.polygon.size(); ++t) {
    if (body_.surface.polygon_part(triangles_.polygon[t]) != part) continue;
    chosen.push_back(t);
    if (chosen.size() == kAtATime) take();
  }
  take();
  return found;
}

double JoinedBonds::distance(const Vec3& rest, std::uint32_t polygon) const {
  double least = 1e300;
  const std::vector<Vec3>& vertices = body_.surface.vertices;
  for (std::uint32_t t = first_triangle_[polygon]; t < first_triangle_[polygon + 1]; ++t) {
    const auto& corners = triangles_.corners[t];
    least = std::min(
        least, distance_to_triangle(rest, vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]));
  }
  return least;
}

// Where `point`, whose surface has that normal now, meets the polygon of `other`. What carries it there may be another cell
// than the one under `other`: it is led back twice.
std::optional<JoinedBonds::Touching> JoinedBonds::touching(const MovedSample& point, const Vec3& normal,
                                                           const MovedSample& other, double limit) const {
  const std::uint32_t polygon = other.point.polygon;
  const Vec3& outward = other.point.area_vector;
  Vec3 rest = other.point.position;
  for (int pass = 0; pass < 2; ++pass) {
    const MovedCarrier carrier(problem_, state_, polygon, rest, outward);
    if (!carrier.found()) return std::nullopt;
    const std::optional<Vec3> back = carrier.rest_of(point.now, rest);
    if (!back) return std::nullopt;
    rest = *back;
    if (pass == 0) continue;
    const double away = distance(rest, polygon);
    if (away > limit || normal.dot(carrier.turned(rest, outward.normalized())) > kJoinFacing)
      return std::nullopt;
    return Touching{away, carrier.at(rest)};
  }
  return std::nullopt;
}

void add_side(const InterpolationWeights& side, double sign, FusedPoint& held) {
  for (std::uint32_t n = 0; n < side.count; ++n) {
    held.elements.push_back(side.elements[n]);
    held.weights.push_back(sign * side.weights[n]);
  }
}

// E / h of the matter of a part that carries a point, times that of Bonds [Pa/m].
double JoinedBonds::foundation(std::uint32_t part, const InterpolationWeights& at) const {
  return Bonds::kPenalty * stiffer_.at(at) * problem_.materials[part].young /
         body_.parts[part].lattice.spacing.mean();
}

void JoinedBonds::touch(std::uint32_t a, std::uint32_t b, double gap, std::vector<FusedPoint>& points,
                        std::set<std::uint32_t>& flat) const {
  const auto spacing = [&](std::uint32_t part) { return body_.parts[part].lattice.spacing; };
  const bool first = spacing(a).mean() <= spacing(b).mean();
  const std::uint32_t finer = first ? a : b, coarser = first ? b : a;
  const double limit = std::max(gap, touching_distance(diagonal_, spacing(finer).minCoeff()));
  const double width = spacing(coarser).maxCoeff() + limit;
  const Box around_finer{box_[finer].min.array() - width, box_[finer].max.array() + width};
  if ((around_finer.min.array() > box_[coarser].max.array()).any() ||
      (around_finer.max.array() < box_[coarser].min.array()).any())
    return;
  const SampleGrid facing(samples(coarser, around_finer, flat), width);
  for (const MovedSample& point : samples(finer, box_[coarser], flat)) {
    const Vec3& rest = point.point.position;
    const MovedCarrier own(problem_, state_, point.point.polygon, rest, point.point.area_vector);
    const Vec3 normal = own.turned(rest, point.point.area_vector.normalized());
    std::optional<Touching> best;
    for (const MovedSample* other : facing.around(point.now))
      if (const auto found = touching(point, normal, *other, limit);
          found && (!best || found->distance < best->distance))
        best = found;
    if (!best) continue;
    FusedPoint held;
    const InterpolationWeights own_weights = own.at(rest);
    held.stiffness = std::min(foundation(finer, own_weights), foundation(coarser, best->weights)) *
                     point.point.area_vector.norm();
    add_side(own_weights, 1, held);
    add_side(best->weights, -1, held);
    points.push_back(std::move(held));
  }
}

// Lowers them as Bonds is, so that they do not cut the step of a run: all points between the same elements together, whose
// rows are less than the sum of theirs.
void soften_points(const Problem& problem, std::vector<FusedPoint>& points) {
  std::map<std::vector<std::uint32_t>, std::size_t> number;
  std::vector<Eigen::MatrixXd> between;
  for (const FusedPoint& point : points) {
    const auto count = static_cast<Eigen::Index>(point.weights.size());
    const Eigen::Map<const Eigen::VectorXd> weights(point.weights.data(), count);
    const auto [entry, fresh] = number.try_emplace(point.elements, between.size());
    if (fresh) between.emplace_back(Eigen::MatrixXd::Zero(count, count));
    between[entry->second] += point.stiffness * weights * weights.transpose();
  }
  std::vector<Bonds::Rows> rows(between.size());
  for (const auto& [elements, n] : number)
    for (std::size_t i = 0; i < elements.size(); ++i)
      rows[n].emplace_back(elements[i], between[n].row(static_cast<Eigen::Index>(i)).cwiseAbs().sum());
  const std::vector<double> left = Bonds::softening(problem, rows);
  for (FusedPoint& point : points) point.stiffness *= left[number.at(point.elements)];
}

}  // namespace

std::vector<FusedPoint> joined_bonds(const Problem& problem, const State& state, std::uint32_t first,
                                     const Bonds::Parameters& bonds, const std::vector<FusedPoint>& fused,
                                     Progress& progress) {
  const Body& body = problem.body;
  std::vector<FusedPoint> points;
  std::set<PartPair> held;
  const std::vector<std::uint32_t> part_of = element_parts(body);
  for (const FusedPoint& point : fused)
    for (const std::uint32_t e : point.elements) held.insert(pair_of(part_of[point.elements[0]], part_of[e]));
  const std::vector<TouchingGap> named = Bonds::named_gaps(bonds, body);
  const JoinedBonds search(problem, state);
  std::set<std::uint32_t> warned;
  for (std::uint32_t b = first; b < body.parts.size(); ++b)
    for (std::uint32_t a = 0; a < b; ++a) {
      const auto given = std::find_if(named.begin(), named.end(),
                                      [&](const TouchingGap& each) { return each.parts == pair_of(a, b); });
      if (held.contains({a, b}) || (!bonds.bond && given == named.end())) continue;
      const std::size_t before = points.size();
      std::set<std::uint32_t> flat;
      search.touch(a, b, given == named.end() ? 0 : given->gap, points, flat);
      if (points.size() > before) continue;
      for (const std::uint32_t part : flat)
        if (warned.insert(part).second)
          progress.warn(
              fmt::format("part \"{}\" is one element thick near another part, and what joins is not bonded "
                          "to such elements; a \"fuse\" at the same time can hold them together",
                          body.parts[part].name));
      if (given != named.end())
        Bonds::refuse_apart(bonds.named[static_cast<std::size_t>(given - named.begin())]);
    }
  soften_points(problem, points);
  return points;
}

}  // namespace flexel::simulate
