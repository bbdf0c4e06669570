// flexel export: the part and the scene as the input of another program, for detailed analysis.
#include <fmt/format.h>

#include <limits>

#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "base/program/progress_stretch.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "base/version.h"
#include "flexel/commands.h"
#include "flexel/export/calculix_file.h"
#include "flexel/export/hex_mesh.h"
#include "flexel/export/tet_mesh.h"
#include "flexel/export/translate.h"
#include "flexel/job.h"
#include "flexel/lammps/exported.h"
#include "flexel/measure/coordinates.h"
#include "formats/lattice/body_file.h"
#include "simulate/matter/fragments.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

constexpr double kTetrahedraAcross = 30;  // of the part's diagonal, without --size
constexpr std::size_t kLookCells = 3000;

struct ExportArguments {
  JobArguments job;
  std::string output, mesh = "hex", element = "C3D8I", nlgeom = "auto", summary;
  bool calculix = false, lammps = false, quiet = false, json = false;
  int threads = 0;
};

void declare(CommandLine& app, ExportArguments& arguments) {
  declare_job(app, arguments.job);
  app.add_flag("--calculix", arguments.calculix,
               "For CalculiX (ccx), as an .inp file (docs/guide/export.md)");
  app.add_flag("--lammps", arguments.lammps,
               "A timed run of models springs and paper for LAMMPS (lmp), as OUT.in, OUT.data and OUT.vtu");
  app.add_option("-o,--output", arguments.output, "The file; -: stdout").type_name("FILE").required();
  app.add_option("--placement", arguments.job.placement,
                 "With --lammps: elements at the voxels' corner or centre (model \"paper\")")
      .type_name("WHERE")
      .show_default();
  app.add_option("--mesh", arguments.mesh,
                 "hex: the lattice's cells; tet: second-order tetrahedra, by the program gmsh")
      .type_name("KIND")
      .show_default();
  app.add_option("--element", arguments.element, "Of hexahedra: C3D8I or C3D8")
      .type_name("NAME")
      .show_default();
  app.add_option("--nlgeom", arguments.nlgeom, "Large deflections: on, off, or as a coarse run tells")
      .type_name("auto|on|off")
      .show_default();
  app.add_option("--summary", arguments.summary, "Write what was written as JSON (docs/guide/export.md)")
      .type_name("FILE");
  app.add_flag("--json", arguments.json, "Print the summary as JSON to stdout (docs/reference/json.md)");
  add_threads_option(app, arguments.threads);
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
}

void choose(const char* option, const std::string& word, const std::vector<std::string>& known) {
  if (std::find(known.begin(), known.end(), word) == known.end())
    throw InputError(fmt::format("{}: no \"{}\"{}; choose {}", option, word, did_you_mean(word, known),
                                 fmt::join(known, ", ")));
}

// Throws InputError: neither target or both, an option of the other.
void check_target(const ExportArguments& arguments, const CommandLine& app) {
  if (arguments.calculix == arguments.lammps)
    throw InputError(arguments.lammps ? "give --calculix or --lammps, not both"
                                      : "for which program? add --calculix or --lammps");
  for (const char* option : {"--mesh", "--element", "--nlgeom"})
    if (arguments.lammps && app.has(option))
      throw InputError(fmt::format("{} is for --calculix: LAMMPS gets the elements themselves", option));
  if (arguments.calculix && app.has("--placement"))
    throw InputError("--placement is for --lammps: CalculiX gets cells");
}

void check(const ExportArguments& arguments) {
  choose("--mesh", arguments.mesh, {"hex", "tet"});
  choose("--element", arguments.element, {"C3D8I", "C3D8"});
  choose("--nlgeom", arguments.nlgeom, {"auto", "on", "off"});
  if (arguments.mesh == "tet" && arguments.job.count)
    throw InputError("--count is for --mesh hex; give --size, the largest edge of a tetrahedron");
  if (arguments.mesh == "tet" && arguments.element == "C3D8")
    throw InputError("--element is for --mesh hex; tetrahedra are C3D10");
  std::vector<std::string> inputs = arguments.job.parts;
  inputs.push_back(arguments.job.scene);
  check_outputs({{arguments.output}, {arguments.summary}, {arguments.json ? "-" : ""}}, inputs,
                arguments.job.force);
}

simulate::Problem problem_of(const Body& body, const simulate::Scene& scene) {
  const simulate::Fragments fragments = simulate::find_fragments(body);
  return {body,
          materials_of_parts(scene, body),
          stray_cells(fragments),
          models_of_parts(scene, body),
          hooke_of_parts(scene, body),
          {},
          {},
          {}};
}

std::vector<std::string> head(const ExportArguments& arguments, const mesh_export::Analysis& analysis) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("CalculiX input by flexel {}: {}{}", version(),
                              fmt::join(arguments.job.parts, ", "),
                              arguments.job.scene.empty() ? "" : ", scene " + arguments.job.scene));
  for (const Part& part : analysis.mesh.body.parts)
    if (analysis.mesh.kind == mesh_export::AnalysisMesh::Kind::hexahedra)
      lines.push_back(fmt::format("part {}: {} of spacing {:.6g} x {:.6g} x {:.6g} mm", part.name,
                                  arguments.element, 1e3 * part.lattice.spacing.x(),
                                  1e3 * part.lattice.spacing.y(), 1e3 * part.lattice.spacing.z()));
    else
      lines.push_back(fmt::format("part {}: C3D10, by gmsh", part.name));
  return lines;
}

using Json = nlohmann::ordered_json;

Json faces_json(const mesh_export::AnalysisMesh& mesh, const mesh_export::CalculixNames& names) {
  const std::vector<double> areas = side_areas(mesh);
  const std::vector<std::uint32_t> numbers = face_numbers(mesh.body.surface);
  Json faces = Json::array();
  for (std::size_t f = 0; f < mesh.sides.size(); ++f)
    faces.push_back({{"selection", fmt::format("{}/{}", mesh.body.parts[mesh.body.surface.faces[f].part].name,
                                               numbers[f])},
                     {"nodes", "N_" + names.faces[f]},
                     {"surface", "S_" + names.faces[f]},
                     {"sides", mesh.sides[f].size()},
                     {"area", areas[f]}});
  return faces;
}

Json probes_json(const mesh_export::Analysis& analysis, const mesh_export::CalculixNames& names) {
  Json probes = Json::array();
  for (std::size_t i = 0; i < analysis.probes.size(); ++i) {
    Json probe = {{"name", analysis.probes[i].name},
                  {"set", "N_" + names.probes[i]},
                  {"distance", analysis.probes[i].distance},
                  {"nodes", Json::array()},
                  {"weights", Json::array()}};
    for (const auto& [node, weight] : analysis.probes[i].weights) {
      probe["nodes"].push_back(node + 1);
      probe["weights"].push_back(weight);
    }
    probes.push_back(probe);
  }
  return probes;
}

std::string summary(const mesh_export::Analysis& analysis, const ExportArguments& arguments) {
  const mesh_export::AnalysisMesh& mesh = analysis.mesh;
  const mesh_export::CalculixNames names = calculix_names(analysis);
  const std::vector<double> volumes = section_volumes(mesh);
  const std::vector<std::uint8_t> used = used_nodes(mesh);
  Json json;
  json["program"] = "flexel export";
  json["version"] = version();
  json["file"] = arguments.output;
  json["element"] = mesh.kind == mesh_export::AnalysisMesh::Kind::tetrahedra ? "C3D10" : arguments.element;
  json["nodes"] = std::count(used.begin(), used.end(), 1);
  json["elements"] = mesh.element_count();
  double mass = 0;
  json["sections"] = Json::array();
  for (std::size_t s = 0; s < mesh.sections.size(); ++s) {
    const mesh_export::MeshSection& each = mesh.sections[s];
    mass += volumes[s] * analysis.materials[each.part].density;
    json["sections"].push_back({{"part", mesh.body.parts[each.part].name},
                                {"material", analysis.materials[each.part].name},
                                {"fill", each.fill},
                                {"elements", each.elements},
                                {"volume", volumes[s]}});
  }
  json["mass"] = mass;
  json["faces"] = faces_json(mesh, names);
  json["supports"] = Json::array();
  for (std::size_t i = 0; i < analysis.supports.size(); ++i)
    json["supports"].push_back({{"name", analysis.supports[i].name},
                                {"set", "N_" + names.supports[i]},
                                {"nodes", analysis.supports[i].nodes.size()},
                                {"equations", analysis.supports[i].equations.size()}});
  json["loads"] = Json::array();
  for (const mesh_export::AnalysisLoad& load : analysis.loads)
    json["loads"].push_back({{"name", load.name},
                             {"kind", load.kind},
                             {"nodes", load.forces.size()},
                             {"force", coordinates(load.total)}});
  json["gravity"] = analysis.gravity ? Json(coordinates(*analysis.gravity)) : Json(nullptr);
  json["ties"] = Json::array();
  for (const mesh_export::TiedFaces& tie : analysis.ties)
    json["ties"].push_back({mesh.body.parts[tie.part[0]].name, mesh.body.parts[tie.part[1]].name});
  json["probes"] = probes_json(analysis, names);
  json["nlgeom"] = analysis.large_deflection;
  json["why_nlgeom"] = analysis.why_deflection;
  json["notes"] = mesh.notes;
  json["warnings"] = analysis.warnings;
  return json_text(json, 2) + "\n";
}

void report(const mesh_export::Analysis& analysis, Progress& progress) {
  const mesh_export::AnalysisMesh& mesh = analysis.mesh;
  const std::vector<std::uint8_t> used = used_nodes(mesh);
  progress.say(fmt::format(
      "{} {} on {} nodes, {} surfaces of CAD faces, {} support(s), {} load(s); {} deflection ({})",
      human_count(mesh.element_count()),
      mesh.kind == mesh_export::AnalysisMesh::Kind::tetrahedra ? "tetrahedra" : "hexahedra",
      human_count(static_cast<std::size_t>(std::count(used.begin(), used.end(), 1))),
      std::count_if(mesh.sides.begin(), mesh.sides.end(), [](const auto& each) { return !each.empty(); }),
      analysis.supports.size(), analysis.loads.size(), analysis.large_deflection ? "large" : "small",
      analysis.why_deflection));
  for (std::size_t p = 0; p < analysis.materials.size(); ++p)
    if (const std::string line = infill_line(mesh.body.parts[p].name, analysis.materials[p]); !line.empty())
      progress.say(line);
  for (const std::string& each : mesh.notes) progress.say(each);
  for (const std::string& each : analysis.warnings) progress.warn(each);
}

// Voxelised, or meshed by gmsh; the scene gets its pushes and moves, and is refused where it has no
// translation.
mesh_export::Analysis analyse(const ExportArguments& arguments, Job& job, const Surface& surface,
                              Progress& progress) {
  const std::vector<std::string> dropped = mesh_export::drop_models(job.scene);
  mesh_export::Analysis analysis;
  if (arguments.mesh == "hex") {
    voxelize::VoxelizeResult voxels = voxelize::voxelize(surface, job.voxelize, progress);
    voxelize::report(voxels, progress);
    add_actions(job, voxels.body);
    const simulate::Problem problem = problem_of(voxels.body, job.scene);
    mesh_export::refuse_untranslatable(job.scene, problem);
    progress.stage("translate");
    analysis = mesh_export::translate(mesh_export::hexahedra(problem), job.scene, problem);
  } else {
    voxelize::VoxelizeOptions look = job.voxelize;
    look.size.reset();
    look.count = kLookCells;
    progress.stage("look");
    ProgressStretch stretch(progress, 0, 1);
    const Body body = voxelize::voxelize(surface, look, stretch.inner()).body;
    add_actions(job, body);
    mesh_export::refuse_untranslatable(job.scene, problem_of(body, job.scene));
    progress.stage("gmsh");
    mesh_export::TetrahedraOptions options;
    options.size = job.voxelize.size.value_or(bounding_box(surface.vertices).diagonal() / kTetrahedraAcross);
    options.threads = arguments.threads;
    mesh_export::AnalysisMesh mesh = tetrahedra(arguments.job.parts, surface, options, progress);
    if (const std::size_t folded = folded_tetrahedra(mesh); folded > 0)
      throw InputError(arguments.job.parts.front(),
                       fmt::format("gmsh's mesh folds in {} of {} tetrahedra; use a smaller --size",
                                   human_count(folded), human_count(mesh.element_count())));
    progress.stage("translate");
    const simulate::Problem problem = problem_of(mesh.body, job.scene);
    analysis = mesh_export::translate(std::move(mesh), job.scene, problem);
  }
  analysis.warnings.insert(analysis.warnings.end(), dropped.begin(), dropped.end());
  return analysis;
}

// The outputs of --lammps, checked.
lammps::ExportNames lammps_names(const ExportArguments& arguments) {
  lammps::ExportNames names = lammps::export_names(arguments.output);
  std::vector<std::string> inputs = arguments.job.parts;
  inputs.push_back(arguments.job.scene);
  check_outputs(
      {{names.script}, {names.data}, {names.body}, {arguments.summary}, {arguments.json ? "-" : ""}}, inputs,
      arguments.job.force);
  return names;
}

bool is_body(const JobArguments& arguments) {
  return arguments.parts.size() == 1 && extension(arguments.parts.front()) == "vtu";
}

// A body goes as it is, in its state; options that make one have no say.
Body body_for_lammps(const JobArguments& arguments, Job& job, const CommandLine& app, Progress& progress) {
  if (is_body(arguments)) {
    for (const char* option : {"--size", "--count", "--heal", "--unit", "--edge", "--placement"})
      if (app.has(option))
        throw InputError(
            fmt::format("{} is for parts: {} is a body already", option, arguments.parts.front()));
    return read_body(arguments.parts.front());
  }
  const Surface surface = read_parts(arguments.parts, job.import, progress);
  check_parts(job, surface);
  voxelize::VoxelizeResult voxels = voxelize::voxelize(surface, job.voxelize, progress);
  voxelize::report(voxels, progress);
  return std::move(voxels.body);
}

int export_to_lammps(const ExportArguments& arguments, const CommandLine& app) {
  Job job;
  lammps::ExportNames names;
  const auto plan = [&] {
    names = lammps_names(arguments);
    job = plan_job(arguments.job);
  };
  if (is_body(arguments.job))
    plan();
  else
    plan_after_files(arguments.job, plan);
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("import");
  Body body = body_for_lammps(arguments.job, job, app, progress);
  add_actions(job, body);
  progress.stage("translate");
  OutputsTogether outputs({names.script, names.data, names.body, arguments.summary});
  const std::string summary = lammps::export_run(
      body, job.scene, names,
      {fmt::format("LAMMPS input by flexel {}: {}{}", version(), fmt::join(arguments.job.parts, ", "),
                   arguments.job.scene.empty() ? "" : ", scene " + arguments.job.scene)},
      progress);
  progress.finish();
  if (!arguments.summary.empty()) write_text(summary, arguments.summary);
  outputs.appear();
  if (arguments.json) write_text(summary, "-");
  return kExitDone;
}

}  // namespace

int export_command(int argc, char** argv) {
  ExportArguments arguments;
  CommandLine app{"Writes the part and its scene as the input of another program, for detailed analysis.",
                  "flexel export"};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  check_target(arguments, app);
  if (arguments.lammps) return export_to_lammps(arguments, app);
  Job job;
  plan_after_files(arguments.job, [&] {
    check(arguments);
    job = plan_job(arguments.job);
  });
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("import");
  // gmsh meshes the geometry itself: only where faces lie is asked of the surface
  if (arguments.mesh == "tet" && arguments.job.edge.empty())
    job.import.largest_edge = std::numeric_limits<double>::infinity();
  const Surface surface = read_parts(arguments.job.parts, job.import, progress);
  check_parts(job, surface);
  mesh_export::Analysis analysis = analyse(arguments, job, surface, progress);
  if (arguments.nlgeom == "auto") {
    progress.stage("look at the deflection");
    analysis.large_deflection = mesh_export::large_deflection(surface, job.scene, arguments.threads,
                                                              analysis.why_deflection, progress);
  } else {
    analysis.large_deflection = arguments.nlgeom == "on";
    analysis.why_deflection = "--nlgeom " + arguments.nlgeom;
  }
  progress.finish();
  report(analysis, progress);
  mesh_export::CalculixOptions options;
  options.element = arguments.element;
  options.head = head(arguments, analysis);
  OutputsTogether outputs({arguments.output, arguments.summary});
  write_text(calculix_file(analysis, options), arguments.output);
  if (!arguments.summary.empty()) write_text(summary(analysis, arguments), arguments.summary);
  outputs.appear();
  if (arguments.json) write_text(summary(analysis, arguments), "-");
  return kExitDone;
}

}  // namespace flexel::commands
