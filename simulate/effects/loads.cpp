// Consistent forces: each surface point's share goes to the eight elements of its cell with the trilinear
// weights, so that the sum of the forces, and of their moments, is that of the load on the surface itself.
// Centre placement: to the nearest element, which keeps the sum; the moment is that of a surface half a voxel
// further in.
#include "simulate/effects/loads.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "base/error.h"
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
    load.force = pin;
    load.bearing = true;
  }
  return load;
}

void spread(const InterpolationWeights& at, const Vec3& force, std::vector<Vec3>& sum) {
  for (std::uint32_t a = 0; a < at.count; ++a) sum[at.elements[a]] += at.weights[a] * force;
}

void add_surface_load(const Load& load, const std::vector<std::uint32_t>& polygons, const Problem& problem,
                      std::vector<Vec3>& sum) {
  const std::vector<SurfacePoint> points = gathered_surface_points(problem, polygons);
  if (!(total_area(points) > 0))
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": no matter lies under the selected surface; use a smaller spacing",
                    load.name));
  if (load.pressure) {
    for (const SurfacePoint& point : points) spread(point.at, -*load.pressure * point.area_vector, sum);
    return;
  }
  std::vector<LoadedPoint> loaded;
  loaded.reserve(points.size());
  for (const SurfacePoint& point : points)
    loaded.push_back({point.position, point.area_vector.norm(), point.area_vector.normalized()});
  const std::vector<Vec3> forces = load_forces(load, loaded);
  for (std::size_t q = 0; q < points.size(); ++q) spread(points[q].at, forces[q], sum);
}

// On the selected elements, by the volume of the matter around them.
void add_volume_load(const Load& load, const std::vector<std::uint32_t>& elements, const Problem& problem,
                     std::vector<Vec3>& sum) {
  if (load.pressure || load.bearing)
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": a {} needs a face, group or side; {} selects elements", load.name,
                    load.pressure ? "pressure" : "bearing load", describe(load.where)));
  const std::vector<double> volume = element_volumes(problem);
  std::vector<LoadedPoint> loaded;
  double total = 0;
  for (const std::uint32_t e : elements) {
    loaded.push_back({problem.body.rest[e], volume[e]});
    total += volume[e];
  }
  if (!(total > 0))
    throw InputError(load.origin,
                     fmt::format("load \"{}\": the selected elements hold no matter", load.name));
  const std::vector<Vec3> forces = load_forces(load, loaded);
  for (std::size_t q = 0; q < elements.size(); ++q) sum[elements[q]] += forces[q];
}

constexpr double kCouple = 1e-3;  // of forces times arms: less moment about their middle is rounding

// The rotation vector [rad] of what a couple acts on: of the rigid motion nearest to the elements' own, each
// with the weight of its force (Kabsch 1976). Nothing for forces that have no moment about their own middle.
template <class ElementForces>
std::optional<Vec3> turn_of_couple(const ElementForces& forces, const Body& body, const State& state) {
  double whole = 0, arms = 0;
  Vec3 middle = Vec3::Zero(), moved = Vec3::Zero(), moment = Vec3::Zero();
  for (const auto& at : forces) {
    const double weight = at.force.norm();
    whole += weight;
    middle += weight * body.rest[at.element];
    moved += weight * state.displacement[at.element];
  }
  middle /= whole;
  moved /= whole;
  Mat3 product = Mat3::Zero();
  for (const auto& at : forces) {
    const Vec3 arm = body.rest[at.element] - middle;
    product += at.force.norm() * (arm + state.displacement[at.element] - moved) * arm.transpose();
    moment += arm.cross(at.force);
    arms += arm.norm() * at.force.norm();
  }
  if (!(moment.norm() > kCouple * arms)) return std::nullopt;
  const Eigen::JacobiSVD<Mat3> svd(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (!(svd.singularValues()[1] > 1e-9 * svd.singularValues()[0])) return std::nullopt;  // a line
  Mat3 sense = Mat3::Identity();
  sense(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::AngleAxisd turn(Mat3(svd.matrixU() * sense * svd.matrixV().transpose()));
  return Vec3(turn.angle() * turn.axis());
}

}  // namespace

std::vector<Vec3> load_forces(const Load& load, const std::vector<LoadedPoint>& points) {
  if (load.bearing) {
    if (auto forces = bearing(points, *load.force)) return *forces;
    throw InputError(load.origin,
                     fmt::format("load \"{}\": the face does not look against the bearing load all around "
                                 "it; select the cylindrical face, and give a force across its axis",
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
    const Selected selected = resolve(load.where, problem.body);
    if (!selected.polygons.empty() && !selected.elements.empty())
      throw InputError(load.origin,
                       fmt::format("load \"{}\" mixes surface and elements; write two loads", load.name));
    std::vector<Vec3> sum(problem.body.element_count(), Vec3::Zero());
    if (selected.elements.empty())
      add_surface_load(load, selected.polygons, problem, sum);
    else
      add_volume_load(load, selected.elements, problem, sum);
    Spread made{load.name, load.course, {}, load.torque.has_value() || load.at.has_value()};
    for (std::uint32_t e = 0; e < sum.size(); ++e)
      if (sum[e] != Vec3::Zero()) made.forces.push_back({e, sum[e]});
    loads.loads_.push_back(std::move(made));
  }
  return loads;
}

std::string Loads::why() const {
  return fmt::format("{} [[load]]", loads_.size());
}

bool Loads::constant() const {
  return std::all_of(loads_.begin(), loads_.end(),
                     [](const Spread& load) { return load.course.time.empty(); });
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
    for (const ElementForce& at : load.forces) forces[at.element] += factor * at.force;
  }
}

void Loads::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) {
  for (const Spread& load : loads_) {
    const double factor = load.course.at(state);
    AppliedLoad total{load.name, Vec3::Zero(), Vec3::Zero()};
    for (const ElementForce& at : load.forces)
      add_at(factor * at.force, body_->rest[at.element] + state.displacement[at.element], total.force,
             total.moment);
    if (load.couple) total.rotation = turn_of_couple(load.forces, *body_, state);
    result.loads.push_back(total);
  }
}

}  // namespace flexel::simulate
