// The scene of a job: a scene file, and options added to it.
#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/units.h"
#include "flexel/job.h"
#include "simulate/effects/gravity.h"
#include "simulate/input/material_names.h"
#include "simulate/input/part_names.h"
#include "simulate/input/scene_words.h"

namespace flexel::commands {
namespace {

// "knob=PLA" is of part "knob", "PLA" of every part that has none of its own ("").
struct OfPart {
  std::string part, value;
};

OfPart split_part(const std::string& text, const char* option, const char* example) {
  const std::size_t equals = text.rfind('=');
  OfPart split;
  if (equals != std::string::npos) split.part = text.substr(0, equals);
  split.value = equals == std::string::npos ? text : text.substr(equals + 1);
  if (split.value.empty() || (equals != std::string::npos && split.part.empty()))
    throw InputError(
        fmt::format("{} \"{}\": write {} {} or {} PART={}", option, text, option, example, option, example));
  return split;
}

simulate::PartSettings& settings_of(simulate::Scene& scene, const std::string& part, const char* option) {
  simulate::PartSettings& settings = scene.parts[part];
  if (settings.origin.empty()) settings.origin = option;
  return settings;
}

// Where an option names a part twice (or all of them), the last would win without a word.
void refuse_twice(const std::vector<std::string>& texts, const char* option, const char* example) {
  std::vector<std::string> parts;
  for (const std::string& text : texts) parts.push_back(split_part(text, option, example).part);
  std::sort(parts.begin(), parts.end());
  const auto twice = std::adjacent_find(parts.begin(), parts.end());
  if (twice == parts.end()) return;
  throw InputError(
      twice->empty()
          ? fmt::format("{} is given twice: leave one out, or say of which part it is: {} \"PART={}\"",
                        option, option, example)
          : fmt::format("{} is given twice for part \"{}\": leave one out", option, *twice));
}

// A material must be known before the work begins.
void plan_materials(const JobArguments& arguments, simulate::Scene& scene) {
  std::vector<std::string> known;
  for (const auto& [name, material] : scene.materials) known.push_back(name);
  for (const simulate::Material& material : simulate::material_library()) known.push_back(material.name);
  refuse_twice(arguments.materials, "--material", "PLA");
  for (const std::string& text : arguments.materials) {
    const OfPart given = split_part(text, "--material", "PLA");
    const auto is_given = [&](const auto& own) {
      return simulate::same_material_name(own.first, given.value);
    };
    if (!simulate::library_material(given.value) &&
        std::none_of(scene.materials.begin(), scene.materials.end(), is_given)) {
      const std::string hint = did_you_mean(given.value, known);
      throw InputError(
          fmt::format("--material: no material \"{}\"{}", given.value,
                      hint.empty() ? fmt::format("; the library has {}", fmt::join(known, ", ")) : hint));
    }
    (given.part.empty() ? scene.material : settings_of(scene, given.part, "--material").material) =
        given.value;
  }
}

void plan_infill(const JobArguments& arguments, simulate::Scene& scene) {
  const std::optional<double> shell =
      arguments.shell.empty() ? std::nullopt
                              : std::optional<double>(parse_quantity(arguments.shell, Dimension::length));
  refuse_twice(arguments.infills, "--infill", "20%");
  for (const std::string& text : arguments.infills) {
    const OfPart given = split_part(text, "--infill", "20%");
    simulate::Infill& infill =
        given.part.empty() ? scene.infill : settings_of(scene, given.part, "--infill").infill;
    infill.share = parse_quantity(given.value, Dimension::share);
    if (shell) infill.shell = shell;
    check_infill(infill, "--infill");
  }
  if (shell && arguments.infills.empty()) scene.infill.shell = shell;
  check_infill(scene.infill, "--shell");
}

}  // namespace

void refuse_modes(const simulate::Scene& scene) {
  if (!scene.run.modes && !scene.run.buckling) return;
  throw InputError(
      scene.name,
      fmt::format("[run] {} is for flexel-simulate: flexel-voxelize PART --moments -o body.vtu, then "
                  "flexel-simulate SCENE body.vtu -o shapes.pvd",
                  scene.run.modes ? "modes" : "buckling"));
}

void declare_matter(CommandLine& app, JobArguments& arguments) {
  const auto add = [&](const char* name, std::vector<std::string>& values, const char* what,
                       const char* type) {
    app.add_option(name, values, what).type_name(type).one_value_each();
  };
  add("--material", arguments.materials,
      "What the parts are made of: steel, PLA, ... (docs/reference/scene.md); of one part: \"knob=PLA\"",
      "[PART=]NAME");
  app.add_option("--model", arguments.model,
                 "How the parts resist: cells, quadratic (small strains; exact on thin and slanted walls), "
                 "springs or paper")
      .type_name("NAME");
  add("--infill", arguments.infills, "Printed with this infill: 20%; of one part: \"knob=20%\" (an estimate)",
      "[PART=]SHARE");
  app.add_option("--shell", arguments.shell, "With --infill: thickness of the solid walls (\"1 mm\")")
      .type_name("LENGTH");
}

void declare_scene(CommandLine& app, JobArguments& arguments) {
  const auto add = [&](const char* name, std::vector<std::string>& values, const char* what,
                       const char* type) {
    app.add_option(name, values, what).type_name(type).one_value_each();
  };
  app.add_option("--scene", arguments.scene, "Scene file (TOML; docs/reference/scene.md)").type_name("FILE");
  add("--fix", arguments.fixes, "Hold this surface: \"xmin\", \"part/3\" (`flexel info` lists faces)",
      "WHERE");
  add("--push", arguments.pushes,
      "Push a surface: \"xmax: 0 0 -50 N\", \"part/3: 50 N\" (inwards), \"part/3: 2 MPa\"; with \", "
      "follower\" it turns with the surface",
      "WHERE:FORCE");
  add("--move", arguments.moves, "Move a surface: \"xmax: 0 0 -2 mm\", \"part/3: 2 mm\" (inwards)",
      "WHERE:LENGTH");
  add("--torque", arguments.torques,
      "Turn a surface by a couple: \"xmax: 5 N m\" (about its axis), \"part/3: 0 0 5 N m\"; with \", "
      "follower\" "
      "it turns with the surface",
      "WHERE:TORQUE");
  add("--twist", arguments.twists,
      "Turn a surface by an angle: \"xmax: 10 deg\" (about its axis), \"part/3: 0 0 10 deg\"", "WHERE:ANGLE");
  add("--bearing", arguments.bearings, "Press on a hole as a pin does: \"part/3: 0 0 -200 N\"",
      "WHERE:FORCE");
  app.add_option("--gravity", arguments.gravity, "Weight: \"1 g\" (along -z), \"0 -9.81 0 m/s^2\"")
      .type_name("ACCELERATION");
  add("--probe", arguments.probes,
      "Say how far a point or a surface moves: \"tip: 80 5 3 mm\", \"tip: part/3\"", "NAME:POINT");
  declare_matter(app, arguments);
}

void refuse_idle(const JobArguments& arguments) {
  if (!arguments.flex && arguments.gravity.empty() && arguments.pushes.empty() && arguments.moves.empty() &&
      arguments.torques.empty() && arguments.twists.empty() && arguments.bearings.empty())
    throw InputError(
        "nothing acts on the part: add --push \"WHERE: 0 0 -50 N\", --move \"WHERE: 0 0 -2 mm\", --torque, "
        "--twist, --bearing, --gravity or --scene FILE");
  if (arguments.materials.empty()) {
    std::vector<std::string> known;
    for (const simulate::Material& material : simulate::material_library()) known.push_back(material.name);
    throw InputError(
        fmt::format("no material: add --material NAME; the library has {}", fmt::join(known, ", ")));
  }
}

void add_options(const JobArguments& arguments, Job& job) {
  plan_materials(arguments, job.scene);
  if (!arguments.model.empty()) job.scene.model = arguments.model;
  plan_infill(arguments, job.scene);
  for (const std::string& where : arguments.fixes)
    job.scene.get<simulate::Supports>().ties.push_back(
        simulate::make_fix(simulate::parse_where(where, "--fix")));
  for (const std::string& text : arguments.pushes) job.pushes.push_back(parse_push(text));
  for (const std::string& text : arguments.moves) job.moves.push_back(parse_move(text));
  for (const std::string& text : arguments.torques) job.torques.push_back(parse_torque(text));
  for (const std::string& text : arguments.twists) job.twists.push_back(parse_twist(text));
  for (const std::string& text : arguments.bearings) add_bearing(job.scene, parse_bearing(text));
  for (const std::string& text : arguments.probes) job.scene.probes.push_back(parse_probe(text));
  if (arguments.gravity.empty()) return;
  std::optional<Vec3>& acceleration = job.scene.get<simulate::Gravity>().acceleration;
  if (acceleration)
    throw InputError(job.scene.name, "has [gravity] acceleration already: leave --gravity out");
  acceleration = parse_gravity(arguments.gravity);
}

void plan_scene(const JobArguments& arguments, Job& job) {
  if (arguments.scene.empty()) {
    job.scene.name = simulate::kCommandLine;
    refuse_idle(arguments);
  } else {
    job.scene = simulate::read_scene(arguments.scene);
    refuse_modes(job.scene);
  }
  add_options(arguments, job);
  if (arguments.flex) job.flex = plan_flex(*arguments.flex);
}

void check_parts(const Job& job, const Surface& surface) {
  std::vector<std::string> names;
  for (const SurfacePart& part : surface.parts) names.push_back(part.name);
  for (const auto& [name, settings] : job.scene.parts)
    if (settings.origin.rfind("--", 0) == 0 && simulate::parts_called(names, surface.parts, name).empty())
      throw InputError(fmt::format("{}: no part \"{}\"{}", settings.origin, name,
                                   did_you_mean(name, names).empty()
                                       ? fmt::format("; the file has {}", fmt::join(names, ", "))
                                       : did_you_mean(name, names)));
  if (!job.scene.material.empty()) return;
  std::vector<bool> has_material(names.size(), false);
  for (const auto& [name, settings] : job.scene.parts)
    for (const std::uint32_t part : simulate::parts_called(names, surface.parts, name))
      has_material[part] = has_material[part] || !settings.material.empty();
  for (const std::string& name : names)
    if (!has_material[static_cast<std::size_t>(&name - names.data())])
      throw InputError(
          fmt::format("part \"{}\" has no material: add --material NAME for every part that has none "
                      "of its own, or --material \"{}=NAME\"",
                      name, name));
}

void add_actions(Job& job, const Body& body) {
  for (const Action& push : job.pushes) add_push(job.scene, push, body);
  for (const Action& move : job.moves) add_move(job.scene, move, body);
  for (const Action& torque : job.torques) add_torque(job.scene, torque, body);
  for (const Action& twist : job.twists) add_twist(job.scene, twist, body);
  if (job.flex) add_flex(job.scene, *job.flex, body);
}

}  // namespace flexel::commands
