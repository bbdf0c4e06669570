// The job's own part of a command line, checked before any stage runs.
#include "flexel/job.h"

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/size_warning.h"
#include "formats/units.h"

namespace flexel {
namespace {

// The material must be known before the work begins: without one there is no resistance to compute.
void check_material(const JobArguments& arguments, const Scene& scene) {
  std::vector<std::string> known;
  for (const auto& [name, material] : scene.materials) known.push_back(name);
  for (const Material& material : material_library()) known.push_back(material.name);
  if (arguments.material.empty() && arguments.scene.empty())
    throw InputError(
        fmt::format("no material: add --material NAME; the library has {}", fmt::join(known, ", ")));
  if (arguments.material.empty() || scene.materials.count(arguments.material) ||
      library_material(arguments.material))
    return;
  const std::string hint = did_you_mean(arguments.material, known);
  throw InputError(
      fmt::format("--material: no material \"{}\"{}", arguments.material,
                  hint.empty() ? fmt::format("; the library has {}", fmt::join(known, ", ")) : hint));
}

void plan_scene(const JobArguments& arguments, Job& job) {
  if (!arguments.scene.empty())
    job.scene = read_scene(arguments.scene);
  else
    job.scene.name = "flexel deform";
  check_material(arguments, job.scene);
  if (!arguments.material.empty()) job.scene.material = arguments.material;
  for (const std::string& where : arguments.fixes)
    job.scene.get<Ties>().ties.push_back(make_fix(parse_where(where, "--fix")));
  for (const std::string& text : arguments.pushes) job.pushes.push_back(parse_push(text));
  for (const std::string& text : arguments.moves) job.moves.push_back(parse_move(text));
  if (arguments.scene.empty() && job.pushes.empty() && job.moves.empty())
    throw InputError(
        "nothing acts on the part: add --push \"WHERE: 0 0 -50 N\", --move \"WHERE: 0 0 -2 mm\" or --scene "
        "FILE");
}

}  // namespace

void declare_job(CLI::App& app, JobArguments& arguments) {
  app.add_option("part", arguments.parts, "STEP, IGES, BREP, STL, OBJ, PLY, OFF, glTF or 3MF files; -: stdin")
      ->required()
      ->type_name("PART");
  app.add_option("--scene", arguments.scene, "Scene file (TOML; docs/scene.md)")->type_name("FILE");
  app.add_option("--fix", arguments.fixes,
                 "Hold this surface: \"xmin\", \"part/3\" (`flexel info` lists faces)")
      ->type_name("WHERE")
      ->allow_extra_args(false);
  app.add_option("--push", arguments.pushes,
                 "Push a surface: \"xmax: 0 0 -50 N\", \"part/3: 50 N\" (inwards), \"part/3: 2 MPa\"")
      ->type_name("WHERE:FORCE")
      ->allow_extra_args(false);
  app.add_option("--move", arguments.moves, "Move a surface: \"xmax: 0 0 -2 mm\", \"part/3: 2 mm\" (inwards)")
      ->type_name("WHERE:LENGTH")
      ->allow_extra_args(false);
  app.add_option("--material", arguments.material,
                 "What the parts are made of: steel, PLA, ... (docs/scene.md)")
      ->type_name("NAME");
  app.add_option("--size", arguments.size, "Spacing of the lattice (\"2 mm\")")->type_name("LENGTH");
  app.add_option("--count", arguments.count, "Or: about this many cells")->type_name("N");
  app.add_option("--heal", arguments.heal, "Broken surfaces: auto, wrap or none (docs/healing.md)")
      ->type_name("HOW")
      ->capture_default_str();
  app.add_option("--unit", arguments.unit, "Unit of files that carry none (default mm)")->type_name("UNIT");
  app.add_option("--edge", arguments.edge,
                 "STEP: longest edge of the mesh (default a 64th of the solid's diagonal)")
      ->type_name("LENGTH");
  app.add_flag("--force", arguments.force, "Let results replace files that are read");
}

Job plan_job(const JobArguments& arguments) {
  Job job;
  if (std::count(arguments.parts.begin(), arguments.parts.end(), "-") + (arguments.scene == "-") > 1)
    throw InputError("only one input can come from stdin");
  if (!arguments.unit.empty()) job.import.unit = length_unit(arguments.unit);
  if (!arguments.edge.empty()) {
    job.import.largest_edge = parse_quantity(arguments.edge, Dimension::length);
    if (!(*job.import.largest_edge > 0)) throw InputError("--edge: must be above zero");
  }
  if (!arguments.size.empty() && arguments.count) throw InputError("give --size or --count, not both");
  if (!arguments.size.empty()) {
    job.voxelize.size = parse_quantity(arguments.size, Dimension::length);
    if (!(*job.voxelize.size > 0)) throw InputError("--size: must be above zero");
  }
  if (arguments.count && *arguments.count == 0) throw InputError("--count: must be above zero");
  job.voxelize.count = arguments.count;
  job.voxelize.heal = heal_choice(arguments.heal);
  job.voxelize.placement = placement_choice(arguments.placement);
  plan_scene(arguments, job);
  return job;
}

Surface read_parts(const std::vector<std::string>& paths, const ImportOptions& options, Progress& progress) {
  Surface surface = import_surface(paths.front(), options);
  for (std::size_t p = 1; p < paths.size(); ++p) append(surface, import_surface(paths[p], options));
  for (const std::string& line : size_warnings(surface)) progress.warn(line);
  return surface;
}

void add_actions(Job& job, const Body& body) {
  for (const Action& push : job.pushes) add_push(job.scene, push, body);
  for (const Action& move : job.moves) add_move(job.scene, move, body);
}

}  // namespace flexel
