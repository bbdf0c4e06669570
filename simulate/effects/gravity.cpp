// Weight and attraction: dead forces in proportion to the load share, and forces that follow the elements.
#include "simulate/effects/gravity.h"

#include <fmt/format.h>

#include "base/math/greatest.h"
#include "base/parallel.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/gravitation/gravity_tree.h"
#include "simulate/input/part_names.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/matter/masses.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kMostByPairs = 2000;  // elements; more are summed up by a tree
constexpr double kOpening = 0.4;            // of the tree
constexpr double kResolve = 60;             // steps of at most 2 / 60 rad of the fastest orbit

Gravity::Source parse_source(const SceneValue& value, const TableReader& parent) {
  TableReader reader(value, parent.file(), "source of [gravity]");
  Gravity::Source source;
  source.origin = reader.place();
  source.part = reader.text("part").value_or("");
  const SceneValue* at = reader.find("at");
  if (at && !source.part.empty())
    reader.fail(at->line, "a source is \"at\" a point or a \"part\": give one of them");
  if (source.part.empty())
    source.at =
        reader.to_vector(reader.require("at", "[\"0 m\", \"0 m\", \"-6371 km\"]"), Dimension::length, "at");
  if (source.part.empty() || reader.find("mass")) {
    source.mass = reader.to_quantity(reader.require("mass", "\"5.97e24 kg\""), Dimension::mass, "mass");
    if (!(source.mass > 0)) reader.fail("\"mass\" of a source needs to be above 0");
  }
  reader.finish();
  return source;
}

}  // namespace

void Gravity::parse(TableReader& scene, Parameters& parameters) {
  const SceneValue* table = scene.find("gravity");
  if (!table) return;
  TableReader reader(*table, scene.file(), "[gravity]");
  parameters.acceleration = reader.vector("acceleration", Dimension::acceleration);
  for (const SceneValue* source : reader.tables("source"))
    parameters.sources.push_back(parse_source(*source, reader));
  if (const SceneValue* mutual = reader.find("mutual")) {
    if (mutual->kind != SceneValue::Kind::boolean)
      reader.fail(mutual->line, "\"mutual\" in [gravity] needs to be true or false");
    parameters.mutual = mutual->flag;
  }
  const std::optional<double> constant = reader.quantity("constant", Dimension::gravitational_constant);
  parameters.constant = constant.value_or(kNewton);
  const bool attracts = parameters.mutual || !parameters.sources.empty();
  reader.finish();
  if (!parameters.acceleration && !attracts)
    (void)reader.require("acceleration", "[\"0 m/s2\", \"0 m/s2\", \"-9.81 m/s2\"]");
  if (constant && !attracts)
    reader.fail("\"constant\" in [gravity] is that of \"source\" and \"mutual = true\"; give one of them");
  if (!(parameters.constant > 0)) reader.fail("\"constant\" in [gravity] needs to be above 0");
}

std::optional<Gravity> Gravity::make(const Parameters& parameters, const Problem& problem) {
  Gravity made;
  made.acceleration_ = parameters.acceleration.value_or(Vec3::Zero());
  made.sources_ = parameters.sources;
  made.mutual_ = parameters.mutual;
  made.constant_ = parameters.constant;
  if (!parameters.acceleration && !made.needs_time()) return std::nullopt;
  // in time broken matter falls too
  made.mass_ = problem.duration ? lumped_masses(problem) : element_masses(problem);
  for (std::size_t e = 0; e < made.mass_.size(); ++e)
    made.first_moment_ += made.mass_[e] * problem.body.rest[e];
  for (Source& source : made.sources_) made.of_parts_.push_back(made.find_part(source, problem.body));
  if (!made.needs_time()) return made;
  made.rest_ = problem.body.rest;
  made.radius_.resize(made.rest_.size());
  for (const Part& part : problem.body.parts)
    std::fill(made.radius_.begin() + part.element_begin, made.radius_.begin() + part.element_end,
              0.5 * part.lattice.spacing.minCoeff());
  for (std::uint32_t e = 0; made.mutual_ && e < made.mass_.size(); ++e)
    if (made.mass_[e] > 0) made.massive_.push_back(e);
  return made;
}

// Its mass, where the scene says none, is the part's.
Gravity::OfPart Gravity::find_part(Source& source, const Body& body) const {
  OfPart of;
  if (source.part.empty()) return of;
  const Part& part = body.parts[require_part(body, source.part, source.origin)];
  of.begin = part.element_begin;
  of.end = part.element_end;
  for (std::uint32_t e = of.begin; e < of.end; ++e) of.mass += mass_[e];
  if (!(source.mass > 0)) source.mass = of.mass;
  return of;
}

std::string Gravity::why() const {
  std::string why = "[gravity]";
  if (!sources_.empty()) why += fmt::format(", {} source(s)", sources_.size());
  if (mutual_)
    why += fmt::format(", {} elements on each other by {}", massive_.size(),
                       massive_.size() > kMostByPairs ? "a tree" : "pairs");
  return why;
}

PointMasses Gravity::points(const State& state) const {
  PointMasses points;
  for (const std::uint32_t e : massive_) {
    points.position.push_back(rest_[e] + state.displacement[e]);
    points.mass.push_back(mass_[e]);
    points.radius.push_back(radius_[e]);
  }
  return points;
}

Attraction Gravity::attraction(const State& state) const {
  const PointMasses all = points(state);
  return massive_.size() > kMostByPairs ? attraction_by_tree(all, kOpening) : attraction_by_pairs(all);
}

std::vector<Vec3> Gravity::source_places(const State& state) const {
  std::vector<Vec3> places;
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    const OfPart& of = of_parts_[s];
    Vec3 moment = Vec3::Zero();
    for (std::uint32_t e = of.begin; e < of.end; ++e) moment += mass_[e] * (rest_[e] + state.displacement[e]);
    places.push_back(of.mass > 0 ? Vec3(moment / of.mass) : sources_[s].at);
  }
  return places;
}

Pull Gravity::pull(const std::vector<Vec3>& places, const State& state, std::size_t element) const {
  Pull sum;
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    if (element >= of_parts_[s].begin && element < of_parts_[s].end) continue;
    const Pull each =
        pull_of(sources_[s].mass, places[s] - rest_[element] - state.displacement[element], radius_[element]);
    sum.field += each.field;
    sum.potential += each.potential;
    sum.tide += each.tide;
  }
  return sum;
}

void Gravity::add_source_forces(const State& state, std::vector<Vec3>& forces) const {
  const std::vector<Vec3> places = source_places(state);
  parallel_for_each(mass_.size(), [&](std::size_t e) {
    forces[e] += (constant_ * mass_[e]) * pull(places, state, e).field;
  });
  for (std::size_t s = 0; s < sources_.size(); ++s) {
    const OfPart& of = of_parts_[s];
    if (!(of.mass > 0)) continue;
    Vec3 drawn = Vec3::Zero();  // by all that it draws
    for (std::size_t e = 0; e < mass_.size(); ++e)
      if (e < of.begin || e >= of.end)
        drawn -= (constant_ * mass_[e]) *
                 pull_of(sources_[s].mass, places[s] - rest_[e] - state.displacement[e], radius_[e]).field;
    for (std::uint32_t e = of.begin; e < of.end; ++e) forces[e] += mass_[e] / of.mass * drawn;
  }
}

double Gravity::energy(const State& state) {
  double energy = -state.share * parallel_sum<double>(mass_.size(), [&](std::size_t e) {
    return mass_[e] * acceleration_.dot(state.displacement[e]);
  });
  if (!sources_.empty())
    energy += parallel_sum<double>(mass_.size(), [&, places = source_places(state)](std::size_t e) {
      return constant_ * mass_[e] * pull(places, state, e).potential;
    });
  if (mutual_) {
    const Attraction mutual = attraction(state);
    for (std::size_t i = 0; i < massive_.size(); ++i)
      energy += 0.5 * constant_ * mass_[massive_[i]] * mutual.potential[i];
  }
  return energy;
}

void Gravity::add_forces(const State& state, std::vector<Vec3>& forces) {
  if (acceleration_ != Vec3::Zero())
    parallel_for_each(mass_.size(),
                      [&](std::size_t e) { forces[e] += (state.share * mass_[e]) * acceleration_; });
  if (!sources_.empty()) add_source_forces(state, forces);
  if (!mutual_) return;
  const Attraction mutual = attraction(state);
  parallel_for_each(massive_.size(), [&](std::size_t i) {
    forces[massive_[i]] += (constant_ * mass_[massive_[i]]) * mutual.field[i];
  });
}

// The stiffness of an attraction is at most G m M / r^3 (across), and between two elements that of their
// distance at most twice that of the one by itself (Gershgorin).
double Gravity::added_frequency(const State& state, const std::vector<double>&) {
  if (!needs_time()) return 0;
  double largest = 0;
  if (!sources_.empty()) {
    const std::vector<Vec3> places = source_places(state);
    largest += parallel_sum<Greatest>(mass_.size(), [&](std::size_t e) {
                 return Greatest{pull(places, state, e).tide};
               }).value;
    for (const OfPart& of : of_parts_)  // the part as a whole, by all that it draws
      if (of.mass > 0)
        largest += parallel_sum<double>(
                       mass_.size(),
                       [&](std::size_t e) {
                         return e < of.begin || e >= of.end ? mass_[e] * pull(places, state, e).tide : 0;
                       }) /
                   of.mass;
  }
  if (mutual_) {
    const Attraction mutual = attraction(state);
    double most = 0;
    for (const double tide : mutual.tide) most = std::max(most, tide);
    largest += 2 * most;
  }
  return kResolve * kResolve * constant_ * largest;
}

void Gravity::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) {
  AppliedLoad total{"gravity", Vec3::Zero(), Vec3::Zero()};
  const double mass = parallel_sum<double>(mass_.size(), [&](std::size_t e) { return mass_[e]; });
  Vec3 first_moment = first_moment_;
  for (std::size_t e = 0; e < mass_.size(); ++e) first_moment += mass_[e] * state.displacement[e];
  total.force = state.share * over_pieces(mass) * acceleration_;
  total.moment = state.share * over_pieces(first_moment).cross(acceleration_);
  if (!sources_.empty()) {
    std::vector<Vec3> forces(mass_.size(), Vec3::Zero());
    add_source_forces(state, forces);
    for (std::size_t e = 0; e < mass_.size(); ++e)
      add_at(forces[e], rest_[e] + state.displacement[e], total.force, total.moment);
  }
  result.loads.push_back(total);  // the mutual part sums up to 0
}

}  // namespace flexel::simulate
