// Consistent forces: each surface point's share goes to the eight elements of its cell with the trilinear
// weights, so that the sum of the forces, and of their moments, is that of the load on the surface itself.
// Centre placement: to the nearest element, which keeps the sum; the moment is that of a surface half a voxel
// further in.
#include "simulate/effects/loads.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/followers/pressing_load.h"
#include "simulate/followers/turning_load.h"
#include "simulate/input/scene_selection.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {
namespace {

Load parse_load(TableReader& reader) {
  Load load;
  load.origin = reader.place();
  load.where = require_where(reader);
  load.name = reader.text("name").value_or(describe(load.where));
  load.force = reader.vector("force", Dimension::force);
  load.at = reader.vector("at", Dimension::length);
  load.torque = reader.vector("torque", Dimension::torque);
  load.pressure = reader.quantity("pressure", Dimension::pressure);
  const std::optional<Vec3> pin = reader.vector("bearing", Dimension::force);
  load.course = parse_course(reader);
  load.follower = parse_follower(reader);
  const std::string link = reader.text("link").value_or("averaging");
  if (link != "averaging")
    reader.fail(fmt::format("\"link\" = \"{}\": use \"averaging\" or \"rigid\"", link));
  if (reader.find("link") && !load.force && !load.torque)
    reader.fail("\"link\" goes with \"force\" or \"torque\"");
  reader.finish();
  if ((load.force || load.torque ? 1 : 0) + (load.pressure ? 1 : 0) + (pin ? 1 : 0) != 1)
    reader.fail(
        "[[load]] needs either \"force\" (the total, for example [\"0 N\", \"0 N\", \"-100 N\"]) or "
        "\"pressure\" (for example \"2 MPa\"), \"torque\" or \"bearing\"");
  if (load.at && !load.force) reader.fail("\"at\" says where a \"force\" acts; give one");
  if (pin) {
    if (*pin == Vec3::Zero()) reader.fail("\"bearing\" is zero and has no direction");
    if (load.follower)
      reader.fail("\"follower\" goes with \"force\", \"torque\" and \"pressure\", not with \"bearing\"");
    load.force = pin;
    load.bearing = true;
  }
  return load;
}

void spread(const InterpolationWeights& at, const Vec3& force, std::vector<Vec3>& sum) {
  for (std::uint32_t a = 0; a < at.count; ++a) sum[at.elements[a]] += at.weights[a] * force;
}

std::vector<SurfacePoint> points_under(const Load& load, const std::vector<std::uint32_t>& polygons,
                                       const Problem& problem) {
  // what turns depends on second moments, which gathered points do not keep
  std::vector<SurfacePoint> points = load.follower ? shared_evenly(problem, surface_points(problem, polygons))
                                                   : gathered_surface_points(problem, polygons);
  if (!(over_pieces(total_area(points)) > 0))
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": no matter lies under the selected surface; use a smaller spacing, or "
                    "another face where this one is of a crumb that hangs on nothing",
                    load.name));
  return points;
}

std::vector<LoadedPoint> loaded_points(const std::vector<SurfacePoint>& points) {
  std::vector<LoadedPoint> loaded;
  loaded.reserve(points.size());
  for (const SurfacePoint& point : points)
    loaded.push_back({point.position, point.area_vector.norm(), point.area_vector.normalized()});
  return loaded;
}

// 1/m, world frame: gradients of the trilinear weights at the point that has these weights.
std::array<Vec3, 8> weight_gradients(const InterpolationWeights& at, const Lattice& lattice) {
  Vec3 place = Vec3::Zero();  // cell coordinates
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (a >> axis & 1) place[static_cast<Eigen::Index>(axis)] += at.weights[a];
  std::array<Vec3, 8> gradients;
  for (std::size_t a = 0; a < 8; ++a) {
    Vec3 value, slope;
    for (int axis = 0; axis < 3; ++axis) {
      const bool far = (a >> axis & 1) != 0;
      value[axis] = far ? place[axis] : 1 - place[axis];
      slope[axis] = (far ? 1 : -1) / lattice.spacing[axis];
    }
    gradients[a] = lattice.axes * Vec3(slope.x() * value.y() * value.z(), value.x() * slope.y() * value.z(),
                                       value.x() * value.y() * slope.z());
  }
  return gradients;
}

std::unique_ptr<FollowerLoad> pressing_load(const Load& load, const std::vector<SurfacePoint>& points,
                                            const Body& body) {
  auto made = std::make_unique<PressingLoad>(*load.pressure);
  for (const SurfacePoint& point : points) {
    const Part& part = body.parts[body.surface.polygon_part(point.polygon)];
    if (part.placement == Placement::centre)
      throw InputError(
          load.origin,
          fmt::format(
              "load \"{}\": a pressure with follower = true needs cells, which model \"paper\" does not "
              "have (part \"{}\"); leave follower out, or use model \"cells\"",
              load.name, part.name));
    made->add_point(point.at.elements, point.at.weights, weight_gradients(point.at, part.lattice),
                    point.area_vector);
  }
  return made;
}

std::unique_ptr<FollowerLoad> follower_on_surface(const Load& load,
                                                  const std::vector<std::uint32_t>& polygons,
                                                  const Problem& problem) {
  std::vector<SurfacePoint> points = points_under(load, polygons, problem);
  if (load.pressure) return pressing_load(load, points, problem.body);
  // A turn is seen from carriers only where they are what says where a point is: the nearest element of
  // centre placement is up to half a voxel from it.
  for (SurfacePoint& point : points) {
    point.position.setZero();
    for (std::uint32_t a = 0; a < point.at.count; ++a)
      point.position += point.at.weights[a] * problem.body.rest[point.at.elements[a]];
  }
  return turning_load(load, loaded_points(points), [&](std::size_t q, const auto& each) {
    for (std::uint32_t a = 0; a < points[q].at.count; ++a)
      each(points[q].at.elements[a], points[q].at.weights[a]);
  });
}

void add_surface_load(const Load& load, const std::vector<std::uint32_t>& polygons, const Problem& problem,
                      std::vector<Vec3>& sum) {
  const std::vector<SurfacePoint> points = points_under(load, polygons, problem);
  if (load.pressure) {
    for (const SurfacePoint& point : points) spread(point.at, -*load.pressure * point.area_vector, sum);
    return;
  }
  const std::vector<Vec3> forces = load_forces(load, loaded_points(points));
  for (std::size_t q = 0; q < points.size(); ++q) spread(points[q].at, forces[q], sum);
}

// The selected elements, by the volume of the matter around them.
std::vector<LoadedPoint> loaded_elements(const Load& load, const std::vector<std::uint32_t>& elements,
                                         const Problem& problem) {
  require_load_on_elements(load);
  const std::vector<double> volume = element_volumes(problem);
  std::vector<LoadedPoint> loaded;
  double total = 0;
  for (const std::uint32_t e : elements) {
    loaded.push_back({problem.body.rest[e], volume[e]});
    total += volume[e];
  }
  if (!(over_pieces(total) > 0)) fail_without_matter(load);
  return loaded;
}

void add_volume_load(const Load& load, const std::vector<std::uint32_t>& elements, const Problem& problem,
                     std::vector<Vec3>& sum) {
  const std::vector<Vec3> forces = load_forces(load, loaded_elements(load, elements, problem));
  for (std::size_t q = 0; q < elements.size(); ++q) sum[elements[q]] += forces[q];
}

std::unique_ptr<FollowerLoad> follower_on_elements(const Load& load,
                                                   const std::vector<std::uint32_t>& elements,
                                                   const Problem& problem) {
  return turning_load(load, loaded_elements(load, elements, problem),
                      [&](std::size_t q, const auto& each) { each(elements[q], 1); });
}

}  // namespace

bool parse_follower(TableReader& reader) {
  const SceneValue* value = reader.find("follower");
  if (!value) return false;
  if (value->kind != SceneValue::Kind::boolean)
    reader.fail(value->line, "\"follower\" needs to be true or false");
  return value->flag;
}

void require_load_on_elements(const Load& load) {
  if (load.pressure || load.bearing)
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": a {} needs a face, group or side; {} selects elements", load.name,
                    load.pressure ? "pressure" : "bearing load", describe(load.where)));
}

void fail_without_matter(const Load& load) {
  throw InputError(load.origin, fmt::format("load \"{}\": the selected elements hold no matter", load.name));
}

Selected loaded_by(const Load& load, const Body& body) {
  Selected selected = resolve(load.where, body);
  if (!selected.polygons.empty() && over_pieces(static_cast<double>(selected.elements.size())) > 0)
    throw InputError(load.origin,
                     fmt::format("load \"{}\" mixes surface and elements; write two loads", load.name));
  return selected;
}

std::vector<Vec3> load_forces(const Load& load, const std::vector<LoadedPoint>& points) {
  if (load.bearing) {
    if (auto forces = bearing(points, *load.force)) return *forces;
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": the face does not look against the bearing load all around "
                    "it; select the whole cylinder (of a hole in two halves in a scene both: where = "
                    "[\"part/3\", \"part/4\"]), and give a force across its axis",
                    load.name));
  }
  if (auto forces = averaging_link(points, load.force.value_or(Vec3::Zero()),
                                   load.torque.value_or(Vec3::Zero()), load.at))
    return *forces;
  throw InputError(
      load.origin,
      fmt::format("load \"{}\": its points lie on a line and take no moment about it; select a larger area",
                  load.name));
}

std::unique_ptr<FollowerLoad> turning_load(const Load& load, const std::vector<LoadedPoint>& points,
                                           const NodeWeights& carriers) {
  std::optional<TurningLoad> made = TurningLoad::make(points, carriers, load.force.value_or(Vec3::Zero()),
                                                      load.torque.value_or(Vec3::Zero()), load.at);
  if (made) return std::make_unique<TurningLoad>(std::move(*made));
  throw InputError(
      load.origin,
      fmt::format("load \"{}\": its points lie on a line, whose turn cannot be seen, and it cannot "
                  "follow them; select a larger area, or leave follower out",
                  load.name));
}

void Loads::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("load")) {
    TableReader reader(*table, scene.file(), "[[load]]");
    if (reader.text("link") == "rigid") continue;  // of Supports
    parameters.loads.push_back(parse_load(reader));
  }
}

std::optional<Loads> Loads::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.loads.empty()) return std::nullopt;
  Loads loads;
  loads.body_ = &problem.body;
  for (const Load& load : parameters.loads) {
    const Selected selected = loaded_by(load, problem.body);
    Spread made{load.name, load.course, {}, load.torque.has_value() || load.at.has_value()};
    const bool on_surface = !selected.polygons.empty();
    if (load.follower) {
      made.follower = on_surface ? follower_on_surface(load, selected.polygons, problem)
                                 : follower_on_elements(load, selected.elements, problem);
      loads.loads_.push_back(std::move(made));
      continue;
    }
    std::vector<Vec3> sum(problem.body.element_count(), Vec3::Zero());
    if (on_surface)
      add_surface_load(load, selected.polygons, problem, sum);
    else
      add_volume_load(load, selected.elements, problem, sum);
    if (other_pieces()) other_pieces()->sum_at_elements(sum);  // one force an element, of one process
    for (std::uint32_t e = 0; e < sum.size(); ++e)
      if (sum[e] != Vec3::Zero() && counts_element(e)) made.forces.push_back({e, sum[e]});
    loads.loads_.push_back(std::move(made));
  }
  return loads;
}

std::string Loads::why() const {
  const auto following = std::count_if(loads_.begin(), loads_.end(),
                                       [](const Spread& load) { return load.follower != nullptr; });
  return fmt::format("{} [[load]]{}", loads_.size(),
                     following > 0 ? fmt::format(", {} of which follow(s) the shape", following) : "");
}

bool Loads::constant() const {
  return std::all_of(loads_.begin(), loads_.end(),
                     [](const Spread& load) { return load.course.time.empty() && !load.follower; });
}

bool Loads::follows() const {
  return std::any_of(loads_.begin(), loads_.end(),
                     [](const Spread& load) { return load.follower != nullptr; });
}

void Loads::add_force_change(const State& state, const std::vector<Vec3>& change, bool transposed,
                             std::vector<Vec3>& forces) {
  for (const Spread& load : loads_) {
    if (!load.follower) continue;
    const double factor = load.course.at(state);
    if (transposed)
      load.follower->add_transposed_change(state.displacement, factor, change, forces);
    else
      load.follower->add_change(state.displacement, factor, change, forces);
  }
}

// Trial states of an iteration may have turned anywhere, by whole turns more or less.
void Loads::accept(const State& state) {
  for (Spread& load : loads_)
    if (load.follower) load.turn = load.follower->turn(state.displacement, load.turn);
}

double Loads::added_frequency(const State&, const std::vector<double>& mass) {
  if (added_frequency_) return *added_frequency_;
  std::vector<double> sums(mass.size(), 0);
  for (const Spread& load : loads_) {
    double factor = load.course.factor.empty() ? 1 : 0;
    for (const double each : load.course.factor) factor = std::max(factor, std::abs(each));
    if (load.follower) load.follower->add_row_sums(factor, sums);
  }
  double largest = 0;
  for (std::size_t e = 0; e < mass.size(); ++e)
    if (sums[e] > 0) largest = std::max(largest, sums[e] / mass[e]);
  added_frequency_ = largest;
  return largest;
}

std::vector<double> Loads::memory() const {
  std::vector<double> turns;
  for (const Spread& load : loads_)
    if (load.follower) turns.insert(turns.end(), load.turn.begin(), load.turn.end());
  return turns;
}

void Loads::restore(const std::vector<double>& memory) {
  std::size_t next = 0;
  for (Spread& load : loads_)
    if (load.follower && next + 3 <= memory.size()) {
      load.turn = Eigen::Map<const Vec3>(&memory[next]);
      next += 3;
    }
}

double Loads::energy(const State& state) {
  double energy = 0;
  for (const Spread& load : loads_) {
    double work = 0;
    for (const ElementForce& at : load.forces) work += at.force.dot(state.displacement[at.element]);
    energy -= load.course.at(state) * work;
  }
  return energy;
}

void Loads::add_forces(const State& state, std::vector<Vec3>& forces) {
  for (const Spread& load : loads_) {
    const double factor = load.course.at(state);
    if (load.follower) load.follower->add_forces(state.displacement, factor, forces);
    for (const ElementForce& at : load.forces) forces[at.element] += factor * at.force;
  }
}

void Loads::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) {
  for (const Spread& load : loads_) {
    const double factor = load.course.at(state);
    AppliedLoad total{load.name, Vec3::Zero(), Vec3::Zero()};
    if (load.follower) {
      std::vector<Vec3> forces(body_->element_count(), Vec3::Zero());
      load.follower->add_forces(state.displacement, factor, forces);
      for (std::size_t e = 0; e < forces.size(); ++e)
        add_at(forces[e], body_->rest[e] + state.displacement[e], total.force, total.moment);
      total.follower = true;
      if (load.couple) total.rotation = load.follower->turn(state.displacement, load.turn);
      result.loads.push_back(total);
      continue;
    }
    for (const ElementForce& at : load.forces)
      add_at(factor * at.force, body_->rest[at.element] + state.displacement[at.element], total.force,
             total.moment);
    total.force = over_pieces(total.force);
    total.moment = over_pieces(total.moment);
    if (load.couple)
      total.rotation = turn_of_couple(load.forces.size(), [&](std::size_t i) {
        const ElementForce& at = load.forces[i];
        return LoadedMotion{at.force, body_->rest[at.element], state.displacement[at.element]};
      });
    result.loads.push_back(total);
  }
}

}  // namespace flexel::simulate
