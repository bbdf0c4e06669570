// A patch whose corners' ball is outside an indenter has no point inside: a point with weights w is within sum |w| times
// the corners' farthest from their middle. Few patches are left, so sums run on one thread in a fixed order.
#include "simulate/indent/indenters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.h"
#include "base/human.h"
#include "base/units.h"
#include "formats/lattice/fragments_of_body.h"
#include "simulate/conditions/rotation_key.h"

namespace flexel::simulate {
namespace {

IndenterShape parse_ball(TableReader& reader, IndenterPlace& place) {
  IndenterShape shape;
  place.centre = reader.to_vector(reader.require("centre", "[\"0 mm\", \"0 mm\", \"15 mm\"]"),
                                  Dimension::length, "centre");
  shape.radius = reader.to_quantity(reader.require("radius", "\"5 mm\""), Dimension::length, "radius");
  if (!(shape.radius > 0)) reader.fail("\"radius\" needs to be above 0");
  shape.rounding = shape.radius;
  reader.finish();
  return shape;
}

IndenterShape parse_plate(TableReader& reader, IndenterPlace& place) {
  IndenterShape shape;
  shape.plate = true;
  place.centre = reader.to_vector(reader.require("centre", "[\"0 mm\", \"0 mm\", \"15 mm\"]"),
                                  Dimension::length, "centre");
  (void)reader.require("normal", "[0, 0, -1]");
  place.normal = *reader.direction("normal");
  shape.radius = reader.to_quantity(reader.require("radius", "\"5 mm\""), Dimension::length, "radius");
  if (!(shape.radius > 0)) reader.fail("\"radius\" needs to be above 0");
  shape.rounding = reader.quantity("rounding", Dimension::length).value_or(kPlateRounding * shape.radius);
  if (!(shape.rounding > 0 && shape.rounding <= shape.radius))
    reader.fail("\"rounding\", the radius of the edge, needs to be above 0, and at most the plate's radius");
  reader.finish();
  return shape;
}

Indenter parse_indenter(TableReader& reader) {
  Indenter indenter;
  indenter.origin = reader.place();
  indenter.name = reader.text("name").value_or("indenter");
  const SceneValue *ball = reader.find("ball"), *plate = reader.find("plate");
  indenter.motion.translation = reader.vector("displacement", Dimension::length).value_or(Vec3::Zero());
  read_rotation(reader, indenter.motion);
  reader.finish();
  if ((ball != nullptr) == (plate != nullptr))
    reader.fail(
        "[[indenter]] needs either \"ball\" (for example { centre = [\"0 mm\", \"0 mm\", \"15 mm\"], radius "
        "= "
        "\"5 mm\" }) or \"plate\" ({ centre = ..., normal = [0, 0, -1], radius = \"5 mm\" })");
  if (indenter.motion.arc_from) reader.fail("\"arc_from\" is of [[move]]: an indenter turns about an axis");
  TableReader shape(ball ? *ball : *plate, reader.file(),
                    ball ? "ball of [[indenter]]" : "plate of [[indenter]]");
  indenter.shape = ball ? parse_ball(shape, indenter.start) : parse_plate(shape, indenter.start);
  return indenter;
}

// What drives a point out that is `depth` [m] deep.
struct PushOut {
  double energy = 0, force = 0, stiffness = 0;  // J, N, N/m
};

PushOut push_out(double stiffness, double spacing, double depth) {
  const double soft = Indenters::kDeepest * spacing;
  if (depth < soft)
    return {stiffness * depth * depth * depth / (6 * soft), stiffness * depth * depth / (2 * soft),
            stiffness * depth / soft};
  return {stiffness * (depth * (depth - soft) / 2 + soft * soft / 6), stiffness * (depth - soft / 2),
          stiffness};
}

double smallest_spacing(const Body& body) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Part& part : body.parts) smallest = std::min(smallest, part.lattice.spacing.minCoeff());
  return smallest;
}

std::vector<SurfacePoint> all_surface_points(const Problem& problem) {
  std::vector<std::uint32_t> polygons(problem.body.surface.polygon_count());
  std::iota(polygons.begin(), polygons.end(), 0U);
  return surface_points(problem, polygons);
}

Vec3 moved(const SurfacePoint& point, const std::vector<Vec3>& displacement) {
  Vec3 place = point.position;
  if (!displacement.empty())
    for (std::uint32_t a = 0; a < point.at.count; ++a)
      place += point.at.weights[a] * displacement[point.at.elements[a]];
  return place;
}

// Whether what these eight corners carry, points whose weights' absolute values sum to `spread` at most, comes nowhere near an
// indenter while both go from one place to the other.
bool stays_away(const IndenterShape& shape, const std::array<IndenterPlace, 2>& places, double spread,
                const std::array<Vec3, 8>& from, const std::array<Vec3, 8>& to) {
  const Vec3 middle = std::accumulate(from.begin(), from.end(), Vec3(Vec3::Zero())) / 8;
  double reach = 0, moved = 0;
  for (std::size_t a = 0; a < 8; ++a) {
    reach = std::max(reach, spread * (from[a] - middle).norm());
    moved = std::max(moved, spread * (to[a] - from[a]).norm());
  }
  const double arm = (middle - places[0].centre).norm() + reach + moved + shape.radius;
  const double turned = 2 * (places[1].normal - places[0].normal).norm();  // an arc is longer than its chord
  const double way = (places[1].centre - places[0].centre).norm() + turned * arm;
  return gap_to(shape, places[0], middle).distance > reach + moved + way;
}

// What an indenter can do nothing at.
void refuse_unfit(const Indenter& indenter, const Problem& problem) {
  const auto refuse = [&](const std::string& why) {
    throw InputError(indenter.origin, fmt::format("indenter \"{}\" {}", indenter.name, why));
  };
  if (problem.duration)
    refuse("acts at equilibrium only: leave [run] time and contact out, or lead a part by [[manipulator]]");
  for (const Part& part : problem.body.parts)
    if (part.placement == Placement::centre)
      refuse(
          fmt::format("needs cells, which model \"paper\" does not have (part \"{}\"): use model "
                      "\"cells\"",
                      part.name));
  if (problem.body.notes.contains(kCarvedNote))
    refuse("needs the part's own surface, and something was carved out of it: leave the carving out");
  if (const double spacing = smallest_spacing(problem.body); indenter.shape.radius < spacing)
    refuse(fmt::format("has a radius of {}, less than a cell of {}: use a smaller spacing (--size)",
                       human_length(indenter.shape.radius), human_length(spacing)));
  // Depths are differences of the radius and a distance: at 10^6 cells the least that counts is a hundredth wrong.
  constexpr double kMostCells = 1e6;
  if (const double most = kMostCells * smallest_spacing(problem.body); indenter.shape.radius > most)
    refuse(fmt::format(
        "has a radius of {}, more than a million cells ({}): check the unit, or give a plate that is "
        "little wider than the part",
        human_length(indenter.shape.radius), human_length(most)));
  // Deeper than its rounding a plate pushes along its normal all at once, and a solution is a hundredth of a cell deep.
  constexpr double kLeastRounding = 0.1;  // cells
  if (const double least = kLeastRounding * smallest_spacing(problem.body); indenter.shape.rounding < least)
    refuse(fmt::format("has an edge of radius {}, less than a tenth of a cell, {}: use a larger \"rounding\"",
                       human_length(indenter.shape.rounding), human_length(least)));
  constexpr double kMostSteps = 10000;
  if (const double steps = indenter.way() / (kIndenterStep * indenter.shape.rounding); !(steps <= kMostSteps))
    refuse(fmt::format(
        "is led by {}, which at {} a load step takes more than {} of them: check the unit, or begin nearer",
        human_length(indenter.way()), human_length(kIndenterStep * indenter.shape.rounding),
        human_count(static_cast<std::size_t>(kMostSteps))));
}

// Where nothing has moved yet: no point deeper than a solution has it, and no ball within a part, where all of the surface
// is farther from its centre than its radius and the nearest looks away from it.
void refuse_start(const Indenter& indenter, const std::vector<SurfacePoint>& points, const Problem& problem) {
  const std::vector<Vec3>& start = problem.settled;
  const auto refuse = [&](const std::string& part) {
    throw InputError(
        indenter.origin,
        fmt::format("indenter \"{}\" begins inside part \"{}\": begin beside it, and lead it in by "
                    "\"displacement\"",
                    indenter.name, part));
  };
  double nearest = std::numeric_limits<double>::infinity();
  const SurfacePoint* facing = nullptr;
  for (const SurfacePoint& point : points) {
    const Part& part = problem.body.parts[problem.body.surface.polygon_part(point.polygon)];
    const double gap = gap_to(indenter.shape, indenter.start, moved(point, start)).distance;
    if (gap < -Indenters::kDeepest * part.lattice.spacing.mean()) refuse(part.name);
    if (gap < nearest) {
      nearest = gap;
      facing = &point;
    }
  }
  if (!indenter.shape.plate && facing &&
      (indenter.start.centre - moved(*facing, start)).dot(facing->area_vector) < 0)
    refuse(problem.body.parts[problem.body.surface.polygon_part(facing->polygon)].name);
}

}  // namespace

IndenterPlace Indenter::at(double share) const {
  if (share == 0) return start;  // by a link too
  const Vec3 tip = start.centre + start.normal;
  const Vec3 centre = start.centre + motion.displacement(start.centre, share);
  return {centre, (tip + motion.displacement(tip, share) - centre).normalized()};
}

double Indenter::way() const {
  const Vec3 arm = start.centre - motion.through;
  const double across = (arm - arm.dot(motion.axis) * motion.axis).norm() + shape.radius;
  return motion.translation.norm() + std::abs(motion.angle) * across;
}

std::optional<double> way_clear(const IndenterShape& shape, const IndenterPlace& place, const Vec3& away,
                                const Problem& problem, const std::vector<Vec3>& displacement) {
  const double farthest = 2 * (bounding_box(problem.body.rest).diagonal() + shape.radius);
  const double enough = 1e-3 * Indenters::kDeepest * smallest_spacing(problem.body);
  const std::vector<SurfacePoint> points = all_surface_points(problem);
  double way = 0;
  while (way < farthest) {
    double least = std::numeric_limits<double>::infinity();
    for (const SurfacePoint& point : points)
      least = std::min(
          least,
          gap_to(shape, {place.centre + way * away, place.normal}, moved(point, displacement)).distance);
    if (least >= -enough) return way;
    way += std::max(-least, 1e-3 * shape.rounding);
  }
  return std::nullopt;
}

const Indenters* find_indenters(const std::vector<ActiveEffect>& effects) {
  for (const ActiveEffect& effect : effects)
    if (const auto* found = dynamic_cast<const Indenters*>(&effect.untimed())) return found;
  return nullptr;
}

void Indenters::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("indenter")) {
    TableReader reader(*table, scene.file(), "[[indenter]]");
    parameters.indenters.push_back(parse_indenter(reader));
  }
}

std::optional<Indenters> Indenters::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.indenters.empty()) return std::nullopt;
  for (const Indenter& indenter : parameters.indenters) refuse_unfit(indenter, problem);
  Indenters made;
  made.body_ = &problem.body;
  made.indenters_ = parameters.indenters;
  const std::vector<SurfacePoint> points = all_surface_points(problem);
  for (const Indenter& indenter : made.indenters_) refuse_start(indenter, points, problem);
  made.add_points(points, problem);
  return made;
}

void Indenters::add_points(const std::vector<SurfacePoint>& points, const Problem& problem) {
  std::vector<std::uint32_t> order(points.size());  // of numbers: a point has 160 bytes
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return points[a].at.elements < points[b].at.elements;
  });
  points_.reserve(points.size());
  const ChangeAround stiffer(problem.body, "stiffness_change");
  for (const std::uint32_t next : order) {
    const SurfacePoint& point = points[next];
    const std::uint32_t part = problem.body.surface.polygon_part(point.polygon);
    const double spacing = problem.body.parts[part].lattice.spacing.mean();
    if (patches_.empty() || patches_.back().elements != point.at.elements) {
      const auto begin = static_cast<std::uint32_t>(points_.size());
      patches_.push_back({point.at.elements, begin, begin, 1, spacing});
    }
    double sum = 0;
    for (const double weight : point.at.weights) sum += std::abs(weight);
    Patch& patch = patches_.back();
    patch.spread = std::max(patch.spread, sum);
    points_.push_back({point.at.weights, kPenalty * stiffer.at(point.at) * problem.materials[part].young /
                                             spacing * point.area_vector.norm()});
    ++patch.end;
  }
}

std::string Indenters::why() const {
  return fmt::format("{} [[indenter]]", indenters_.size());
}

std::array<Vec3, 8> Indenters::corners(const Patch& patch, const std::vector<Vec3>& displacement) const {
  std::array<Vec3, 8> places;
  for (std::size_t a = 0; a < 8; ++a)
    places[a] = body_->rest[patch.elements[a]] + displacement[patch.elements[a]];
  return places;
}

template <class Each>
void Indenters::for_each_inside(const IndenterShape& shape, const IndenterPlace& place, const Patch& patch,
                                const std::array<Vec3, 8>& corners, const Each& each) const {
  for (std::uint32_t q = patch.begin; q < patch.end; ++q) {
    Vec3 position = Vec3::Zero();
    for (std::size_t a = 0; a < 8; ++a) position += points_[q].weights[a] * corners[a];
    const IndenterGap gap = gap_to(shape, place, position);
    if (gap.distance < 0) each(patch, points_[q], gap, position);
  }
}

template <class Each>
void Indenters::for_each_inside(const Indenter& indenter, const State& state, const Each& each) const {
  const IndenterPlace place = indenter.at(state.share);
  for (const Patch& patch : patches_) {
    const std::array<Vec3, 8> now = corners(patch, state.displacement);
    const Vec3 middle = std::accumulate(now.begin(), now.end(), Vec3(Vec3::Zero())) / 8;
    double reach = 0;
    for (const Vec3& corner : now) reach = std::max(reach, (corner - middle).squaredNorm());
    if (gap_to(indenter.shape, place, middle).distance > patch.spread * std::sqrt(reach)) continue;
    for_each_inside(indenter.shape, place, patch, now, each);
  }
}

double Indenters::energy(const State& state) {
  double sum = 0;
  for (const Indenter& indenter : indenters_)
    for_each_inside(indenter, state,
                    [&](const Patch& patch, const Point& point, const IndenterGap& gap, const Vec3&) {
                      sum += push_out(point.stiffness, patch.spacing, -gap.distance).energy;
                    });
  return sum;
}

void Indenters::add_forces(const State& state, std::vector<Vec3>& forces) {
  for (const Indenter& indenter : indenters_)
    for_each_inside(
        indenter, state, [&](const Patch& patch, const Point& point, const IndenterGap& gap, const Vec3&) {
          const Vec3 force = push_out(point.stiffness, patch.spacing, -gap.distance).force * gap.gradient;
          for (std::size_t a = 0; a < 8; ++a) forces[patch.elements[a]] += point.weights[a] * force;
        });
}

void Indenters::add_stiffness(const State& state, BlockMatrix& matrix) {
  for (const Indenter& indenter : indenters_)
    for_each_inside(indenter, state,
                    [&](const Patch& patch, const Point& point, const IndenterGap& gap, const Vec3&) {
                      const PushOut push = push_out(point.stiffness, patch.spacing, -gap.distance);
                      Mat3 stiffness = push.stiffness * gap.gradient * gap.gradient.transpose();
                      if (-gap.distance < kDeepest * patch.spacing) stiffness -= push.force * gap.curvature;
                      for (std::size_t a = 0; a < 8; ++a)
                        for (std::size_t b = 0; b < 8; ++b)
                          matrix.values[position_of(matrix, patch.elements[a], patch.elements[b])] +=
                              point.weights[a] * point.weights[b] * stiffness;
                    });
}

std::vector<std::uint32_t> Indenters::may_pull_at() const {
  std::vector<std::uint32_t> elements;
  for (const Patch& patch : patches_)
    elements.insert(elements.end(), patch.elements.begin(), patch.elements.end());
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  return elements;
}

double Indenters::longest_load_step() const {
  double longest = 1;
  for (const Indenter& indenter : indenters_)
    if (const double way = indenter.way(); !indenter.motion.link && way > 0)
      longest = std::min(longest, kIndenterStep * indenter.shape.rounding / way);
  return longest;
}

std::vector<IndenterPlace> Indenters::places(double share) const {
  std::vector<IndenterPlace> places;
  for (const Indenter& indenter : indenters_) places.push_back(indenter.at(share));
  return places;
}

std::string Indenters::gone_through(const std::vector<IndenterPlace>& before,
                                    const std::vector<Vec3>& displacement, const State& state) const {
  for (std::size_t i = 0; i < indenters_.size(); ++i) {
    const std::array<IndenterPlace, 2> places{before[i], indenters_[i].at(state.share)};
    for (const Patch& patch : patches_) {
      const std::array<Vec3, 8> from = corners(patch, displacement), to = corners(patch, state.displacement);
      if (stays_away(indenters_[i].shape, places, patch.spread, from, to)) continue;
      for (std::uint32_t q = patch.begin; q < patch.end; ++q) {
        std::array<Vec3, 2> point{Vec3::Zero(), Vec3::Zero()};
        for (std::size_t a = 0; a < 8; ++a) {
          point[0] += points_[q].weights[a] * from[a];
          point[1] += points_[q].weights[a] * to[a];
        }
        if (goes_through(indenters_[i].shape, places, point)) return indenters_[i].name;
      }
    }
  }
  return "";
}

std::string Indenters::refuses_load_step(const State& before, const State& after) const {
  const std::string which = gone_through(places(before.share), before.displacement, after);
  return which.empty() ? "" : fmt::format("the part goes through indenter \"{}\"", which);
}

std::vector<double> Indenters::depths(const State& state) const {
  std::vector<double> depths;
  for (const Indenter& indenter : indenters_) {
    double& deepest = depths.emplace_back(0);
    for_each_inside(indenter, state,
                    [&](const Patch& patch, const Point&, const IndenterGap& gap, const Vec3&) {
                      deepest = std::max(deepest, -gap.distance / patch.spacing);
                    });
  }
  return depths;
}

std::vector<std::string> Indenters::warnings(const State& state) const {
  std::vector<std::string> said;
  const std::vector<double> depth = depths(state);
  for (std::size_t i = 0; i < indenters_.size(); ++i) {
    const std::string who = fmt::format("{}: indenter \"{}\"", indenters_[i].origin, indenters_[i].name);
    if (depth[i] == 0) said.push_back(who + " touches nothing where it ends");
    if (depth[i] > kDeepest)
      said.push_back(
          fmt::format("{} has the surface up to {} of a cell inside: it presses by more than ten times "
                      "Young's modulus there; a larger ball or plate, or a shorter way, presses less",
                      who, human_share(depth[i])));
  }
  return said;
}

void Indenters::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) {
  for (const Indenter& indenter : indenters_) {
    Reaction reaction;
    reaction.name = indenter.name;
    reaction.is_move = true;
    double pushed = 0;  // N
    for_each_inside(
        indenter, state,
        [&](const Patch& patch, const Point& point, const IndenterGap& gap, const Vec3& position) {
          const Vec3 force = push_out(point.stiffness, patch.spacing, -gap.distance).force * gap.gradient;
          add_at(force, position, reaction.force, reaction.moment);
          reaction.middle += force.norm() * position;
          pushed += force.norm();
        });
    reaction.middle = pushed > 0 ? Vec3(reaction.middle / pushed) : indenter.at(state.share).centre;
    result.reactions.push_back(reaction);
  }
}

}  // namespace flexel::simulate
