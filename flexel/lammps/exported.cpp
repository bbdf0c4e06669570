// The files and what is told of them.
#include "flexel/lammps/exported.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/units.h"
#include "base/version.h"
#include "flexel/lammps/imported.h"
#include "flexel/lammps/input_files.h"
#include "formats/lattice/body_file.h"
#include "simulate/contact/pairs/stuck_places.h"
#include "simulate/matter/stress.h"

namespace flexel::lammps {
namespace {

using Json = nlohmann::ordered_json;

Json vector_json(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

std::vector<std::string> warnings_of(const Particles& particles) {
  std::vector<std::string> warnings;
  if (!particles.step_given)
    warnings.push_back(
        fmt::format("LAMMPS keeps the step of {:.4g} s, where Flexel shortens it as matter stiffens: give "
                    "[run] step = \"{:.3g} s\" or "
                    "less, and look at the energies",
                    particles.step, particles.step));
  if (particles.damped())
    warnings.push_back(
        "[damping] runs in LAMMPS's own Python (fix python/invoke, numpy), which is slower than the bonds");
  return warnings;
}

Json supports_json(const Particles& particles) {
  Json all = Json::array();
  for (std::size_t g = 0; g < particles.supports.size(); ++g) {
    const SupportGroup& group = particles.supports[g];
    std::string axes;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (group.mask >> axis & 1) axes += "xyz"[axis];
    all.push_back({{"group", fmt::format("support{}", g + 1)},
                   {"axes", axes},
                   {"led", particles.leads(group)},
                   {"atoms", std::count(particles.support.begin(), particles.support.end(), g + 1)}});
  }
  return all;
}

Json run_json(const Particles& particles) {
  return {{"step", particles.step},
          {"steps", particles.steps},
          {"frames", particles.frames},
          {"method", particles.half_kick ? "verlet" : "symplectic"}};
}

std::string summary(const Particles& particles, const BondTypes& types, const ExportNames& names,
                    const std::vector<std::string>& warnings) {
  Json json;
  json["program"] = "flexel export";
  json["version"] = version();
  json["file"] = names.script;
  json["data"] = names.data;
  json["body"] = names.body;
  json["dump"] = names.dump;
  json["atoms"] = particles.mass.size();
  json["bonds"] = particles.springs.size();
  json["bond_types"] = types.types.size();
  double mass = 0;
  for (const double each : particles.mass) mass += each;
  json["mass"] = mass;
  json["damped"] = particles.damped();
  json["gravity"] = particles.gravity == Vec3::Zero() ? Json(nullptr) : vector_json(particles.gravity);
  json["loads"] = Json::array();
  for (const SteadyForce& each : particles.forces) {
    Vec3 total = Vec3::Zero();
    for (const Vec3& force : each.force) total += force;
    json["loads"].push_back(
        {{"force", vector_json(total)}, {"time", each.course.time}, {"factor", each.course.factor}});
  }
  json["supports"] = supports_json(particles);
  json["run"] = run_json(particles);
  json["warnings"] = warnings;
  return json_text(json, 2) + "\n";
}

// LAMMPS puts ASCII for characters beyond it, and in a dump's name a number for % and *.
bool lammps_takes(const std::string& name) {
  return std::all_of(name.begin(), name.end(), [](char c) {
    return c >= ' ' && c <= '~' && std::string_view("\"$&#%*").find(c) == std::string_view::npos;
  });
}

}  // namespace

ExportNames export_names(const std::string& script) {
  if (extension(script) != "in" || script.size() < 4)
    throw InputError(script, "LAMMPS's input script is a file OUT.in; OUT.data and OUT.vtu go beside it");
  if (!lammps_takes(stem(script)))
    throw InputError(
        script, "LAMMPS takes no name with \", $, &, #, %, * or characters beyond ASCII: choose another");
  const std::string base = script.substr(0, script.size() - 3);
  return {script, base + ".data", base + ".vtu", base + ".dump"};
}

std::string export_run(Body& body, const simulate::Scene& scene, const ExportNames& names,
                       std::vector<std::string> head, Progress& progress) {
  simulate::erase_stress_columns(body);    // of an earlier run
  body.notes.erase(simulate::kStuckNote);  // contact is refused
  const Particles particles = particles_of(body, scene, progress);
  const BondTypes types = bond_types(particles.springs);
  const std::vector<std::string> warnings = warnings_of(particles);
  for (const std::string& each : warnings) progress.warn(each);
  progress.say(fmt::format("{} atoms, {} bonds of {} type(s), {} steps of {:.4g} s",
                           human_count(particles.mass.size()), human_count(particles.springs.size()),
                           types.types.size(), particles.steps, particles.step));
  progress.stage("write");
  head.push_back(fmt::format(
      "run it in its folder: lmp -in {0}.in; then: flexel import-lammps {0}.dump {0}.vtu -o OUT.pvd",
      stem(names.script)));
  body.position = particles.position;
  const auto file = [](const std::string& path) { return stem(path) + "." + extension(path); };
  const std::uint64_t data =
      write_data(particles, types, fmt::format("LAMMPS data by flexel {}", version()), names.data);
  InputNames inside{file(names.data), file(names.dump), ""};
  inside.run = run_name(data, input_script(particles, types, head, inside));
  body.notes[kRunNote] = inside.run;
  write_body(body, names.body);
  write_text(input_script(particles, types, head, inside), names.script);
  return summary(particles, types, names, warnings);
}

}  // namespace flexel::lammps
