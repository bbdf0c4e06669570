// Consistent forces: each surface point's share goes to the eight elements of its cell with the trilinear
// weights, so that the sum of the forces, and of their moments, is that of the load on the surface itself.
// Centre placement: to the nearest element, which keeps the sum; the moment is that of a surface half a voxel
// further in.
#include "simulate/effects/loads.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/error.h"
#include "simulate/scene_selection.h"
#include "simulate/surface_points.h"

namespace flexel {
namespace {

Load parse_load(TableReader& reader) {
  Load load;
  load.origin = reader.place();
  load.where = require_where(reader);
  load.name = reader.text("name").value_or(describe(load.where));
  load.force = reader.vector("force", Dimension::force);
  load.pressure = reader.quantity("pressure", Dimension::pressure);
  load.course = parse_course(reader);
  reader.finish();
  if (load.force.has_value() == load.pressure.has_value())
    reader.fail(
        "[[load]] needs either \"force\" (the total, for example [\"0 N\", \"0 N\", \"-100 N\"]) or "
        "\"pressure\" "
        "(for example \"2 MPa\")");
  return load;
}

void spread(const Carrier& at, const Vec3& force, std::vector<Vec3>& sum) {
  for (std::uint32_t a = 0; a < at.count; ++a) sum[at.elements[a]] += at.weights[a] * force;
}

void add_surface_load(const Load& load, const std::vector<std::uint32_t>& polygons, const Setting& setting,
                      std::vector<Vec3>& sum) {
  const std::vector<SurfacePoint> points = surface_points(setting, polygons);
  const double area = total_area(points);
  if (!(area > 0))
    throw InputError(
        load.origin,
        fmt::format("load \"{}\": no matter lies under the selected surface; use a smaller spacing",
                    load.name));
  for (const SurfacePoint& point : points) {
    const Vec3 force = load.force ? Vec3(*load.force * (point.area_vector.norm() / area))
                                  : Vec3(-*load.pressure * point.area_vector);
    spread(point.at, force, sum);
  }
}

// The force spread over the selected elements by the volume of the matter around them.
void add_volume_load(const Load& load, const std::vector<std::uint32_t>& elements, const Setting& setting,
                     std::vector<Vec3>& sum) {
  if (load.pressure)
    throw InputError(load.origin,
                     fmt::format("load \"{}\": a pressure needs a face, group or side; {} selects elements",
                                 load.name, describe(load.where)));
  const std::vector<double> volume = element_volumes(setting);
  double total = 0;
  for (const std::uint32_t e : elements) total += volume[e];
  if (!(total > 0))
    throw InputError(load.origin,
                     fmt::format("load \"{}\": the selected elements hold no matter", load.name));
  for (const std::uint32_t e : elements) sum[e] += *load.force * (volume[e] / total);
}

}  // namespace

void Loads::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("load")) {
    TableReader reader(*table, scene.file(), "[[load]]");
    parameters.loads.push_back(parse_load(reader));
  }
}

std::optional<Loads> Loads::make(const Parameters& parameters, const Setting& setting) {
  if (parameters.loads.empty()) return std::nullopt;
  Loads loads;
  std::vector<Vec3> steady(setting.body.element_count(), Vec3::Zero());
  const auto add_group = [&](const Course& course, const std::vector<Vec3>& forces) {
    Group made;
    made.course = course;
    for (std::uint32_t e = 0; e < forces.size(); ++e)
      if (forces[e] != Vec3::Zero()) made.forces.push_back({e, forces[e]});
    if (!made.forces.empty()) loads.groups_.push_back(std::move(made));
  };
  for (const Load& load : parameters.loads) {
    const Selected selected = resolve(load.where, setting.body);
    if (!selected.polygons.empty() && !selected.elements.empty())
      throw InputError(load.origin,
                       fmt::format("load \"{}\" mixes surface and elements; write two loads", load.name));
    std::vector<Vec3> sum(setting.body.element_count(), Vec3::Zero());
    if (selected.elements.empty())
      add_surface_load(load, selected.polygons, setting, sum);
    else
      add_volume_load(load, selected.elements, setting, sum);
    Vec3 resultant = Vec3::Zero();
    for (const Vec3& force : sum) resultant += force;
    loads.totals_.push_back({load.name, resultant, load.course});
    if (!load.course.time.empty())
      add_group(load.course, sum);
    else
      for (std::size_t e = 0; e < sum.size(); ++e) steady[e] += sum[e];
  }
  add_group({}, steady);
  return loads;
}

std::string Loads::why() const {
  return fmt::format("{} [[load]]", totals_.size());
}

bool Loads::constant() const {
  return std::all_of(groups_.begin(), groups_.end(),
                     [](const Group& group) { return group.course.time.empty(); });
}

double Loads::energy(const State& state) const {
  double energy = 0;
  for (const Group& group : groups_) {
    double work = 0;
    for (const ElementForce& at : group.forces) work += at.force.dot(state.displacement[at.element]);
    energy -= group.course.at(state) * work;
  }
  return energy;
}

void Loads::add_forces(const State& state, std::vector<Vec3>& forces) const {
  for (const Group& group : groups_) {
    const double factor = group.course.at(state);
    for (const ElementForce& at : group.forces) forces[at.element] += factor * at.force;
  }
}

void Loads::report(const State& state, const std::vector<Vec3>&, SimulateResult& result) const {
  for (const Total& total : totals_)
    result.loads.push_back({total.name, total.course.at(state) * total.force});
}

}  // namespace flexel
