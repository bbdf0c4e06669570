// The result of a run as JSON and as lines for people.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/program.h"
#include "formats/units.h"
#include "simulate/simulate.h"

namespace flexel {
namespace {

using Json = nlohmann::ordered_json;

Json vector(const Vec3& value) {
  return Json::array({value.x(), value.y(), value.z()});
}

// Components that are only rounding beside the largest are shown as 0.
Vec3 without_rounding(Vec3 value) {
  for (double& each : value)
    if (std::abs(each) < 1e-6 * value.cwiseAbs().maxCoeff()) each = 0;
  return value;
}

std::string lengths(const Vec3& exact) {
  const Vec3 value = without_rounding(exact);
  return fmt::format("({}, {}, {})", human_length(value.x()), human_length(value.y()),
                     human_length(value.z()));
}

std::string forces(const Vec3& exact) {
  const Vec3 value = without_rounding(exact);
  return fmt::format("({}, {}, {})", human_force(value.x()), human_force(value.y()), human_force(value.z()));
}

}  // namespace

std::string summary_json(const SimulateResult& result, const Body& body) {
  Json json;
  json["program"] = "flexel-simulate";
  json["version"] = version();
  json["elements"] = body.element_count();
  json["cells"] = body.cell_count();
  json["stray_cells"] = result.stray_cells;
  json["parts"] = Json::array();
  for (const Part& part : body.parts)
    json["parts"].push_back(
        {{"name", part.name}, {"material", part.material}, {"spacing", vector(part.lattice.spacing)}});
  json["mass"] = result.mass;
  json["largest_displacement"] = result.largest_displacement;
  json["largest_displacement_at"] = vector(result.largest_displacement_at);
  json["probes"] = Json::array();
  for (const ProbeResult& probe : result.probes)
    json["probes"].push_back(
        {{"name", probe.name}, {"at", vector(probe.where)}, {"displacement", vector(probe.displacement)}});
  json["loads"] = Json::array();
  for (const AppliedLoad& load : result.loads)
    json["loads"].push_back({{"name", load.name}, {"force", vector(load.force)}});
  json["reactions"] = Json::array();
  for (const Reaction& reaction : result.reactions)
    json["reactions"].push_back({{"name", reaction.name}, {"force", vector(reaction.force)}});
  json["bonds"] = Json::array();
  for (const BondedParts& bond : result.bonds)
    json["bonds"].push_back({{"parts", bond.parts}, {"area", bond.area}});
  json["imbalance"] = vector(result.imbalance);
  json["elastic_energy"] = result.elastic_energy;
  json["smallest_jacobian"] = result.smallest_jacobian;
  if (result.smallest_corner_jacobian) {
    json["smallest_corner_jacobian"] = *result.smallest_corner_jacobian;
    json["smallest_corner_at"] = vector(result.smallest_corner_at);
  }
  if (result.timed) {
    json["timed"] = {{"time", result.timed->time},
                     {"steps", result.timed->steps},
                     {"step", result.timed->step},
                     {"isa", result.timed->isa}};
    for (const auto& [name, joules] : result.timed->books) json["timed"]["books"][name] = joules;
  } else {
    json["load_steps"] = result.load_steps;
    json["newton_iterations"] = result.newton_iterations;
    json["cg_iterations"] = result.cg_iterations;
    json["relative_residual"] = result.relative_residual;
  }
  json["seconds"] = result.seconds;
  json["time"] = Json::array();
  for (const PassShare& pass : result.passes)
    json["time"].push_back({{"name", pass.name}, {"why", pass.why}, {"seconds", pass.seconds}});
  return json.dump(2) + "\n";
}

std::vector<std::string> summary_lines(const SimulateResult& result) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("largest displacement {} at {}", human_length(result.largest_displacement),
                              lengths(result.largest_displacement_at)));
  for (const ProbeResult& probe : result.probes)
    lines.push_back(fmt::format("probe \"{}\" moved {}: {}", probe.name,
                                human_length(probe.displacement.norm()), lengths(probe.displacement)));
  for (const AppliedLoad& load : result.loads)
    lines.push_back(fmt::format("load \"{}\": {}", load.name, forces(load.force)));
  for (const Reaction& reaction : result.reactions)
    lines.push_back(fmt::format("reaction of \"{}\": {}", reaction.name, forces(reaction.force)));
  for (const BondedParts& bond : result.bonds)
    lines.push_back(fmt::format("\"{}\" and \"{}\" are bonded over {:.4g} mm2", bond.parts[0], bond.parts[1],
                                bond.area * 1e6));
  const std::string corner = result.smallest_corner_jacobian
                                 ? fmt::format(" (at a corner {:.4g})", *result.smallest_corner_jacobian)
                                 : "";
  if (result.timed) {
    lines.push_back(
        fmt::format("{} steps of {:.4g} s to {:.6g} s in {:.2f} s (kernel {}), elastic energy {:.4g} J, "
                    "smallest J {:.4g}{}",
                    result.timed->steps, result.timed->step, result.timed->time, result.seconds,
                    result.timed->isa, result.elastic_energy, result.smallest_jacobian, corner));
    std::string books;
    for (const auto& [name, joules] : result.timed->books)
      books += fmt::format("{}{} {:.4g} J", books.empty() ? "" : ", ", name, joules);
    if (!books.empty()) lines.push_back("books: " + books);
    return lines;
  }
  lines.push_back(
      fmt::format("elastic energy {:.4g} J, smallest J {:.4g}{}, {} load step(s), {} Newton and {} CG "
                  "iterations, residual "
                  "{:.1e}, {:.2f} s",
                  result.elastic_energy, result.smallest_jacobian, corner, result.load_steps,
                  result.newton_iterations, result.cg_iterations, result.relative_residual, result.seconds));
  return lines;
}

}  // namespace flexel
