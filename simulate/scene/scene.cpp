// Parses the scene's general tables (materials, parts, probes, run); each effect reads its own.
#include "simulate/scene/scene.h"

#include <algorithm>

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "base/files/files.h"
#include "simulate/input/hardening.h"
#include "simulate/input/infill.h"
#include "simulate/input/material_names.h"
#include "simulate/scene/events.h"
#include "simulate/scene/material_laws.h"
#include "simulate/scene/scene_keys.h"

namespace flexel::simulate {
namespace {

double required_quantity(TableReader& reader, const char* key, Dimension dimension, const char* example) {
  return reader.to_quantity(reader.require(key, example), dimension, key);
}

void parse_uniform_elongation(TableReader& reader, Material& material) {
  const std::optional<double> elongation = reader.number("uniform_elongation");
  if (!elongation) return;
  if (!(*elongation > 0)) reader.fail("\"uniform_elongation\" needs to be above 0");
  if (material.hardening > 0)
    reader.fail("\"hardening\" and \"uniform_elongation\" are two laws of hardening: leave one out");
  if (!(material.yield > 0) || !(material.strength > 0))
    reader.fail(
        "\"uniform_elongation\" needs \"yield\" and \"strength\", between which the material hardens");
  material.uniform_elongation = *elongation;
  if (!voce_hardening(material))
    reader.fail(
        "no hardening leads from \"yield\" to \"strength\" at \"uniform_elongation\", where the load is to "
        "be "
        "largest: the strength is too near to the yield stress, or the elongation hardly more than elastic");
}

Material parse_material(TableReader& reader, const std::string& name) {
  Material material;
  material.name = name;
  parse_law(reader, material);
  material.density = required_quantity(reader, "density", Dimension::density, "\"7850 kg/m3\"");
  material.source = reader.text("source").value_or(reader.file());
  const auto optional_limit = [&](const char* key) {
    const std::optional<double> value = reader.quantity(key, Dimension::pressure);
    if (value && !(*value > 0)) reader.fail(fmt::format("\"{}\" needs to be above 0", key));
    return value.value_or(0);
  };
  material.yield = optional_limit("yield");
  material.hardening = reader.quantity("hardening", Dimension::pressure).value_or(0);
  material.strength = optional_limit("strength");
  material.layer_strength = optional_limit("layer_strength");
  if (material.layer_strength > 0 && !(material.yield > 0) && !(material.strength > 0))
    reader.fail("\"layer_strength\" needs \"strength\" or \"yield\" beside it, along the layers");
  material.elongation = reader.number("elongation").value_or(0);
  parse_uniform_elongation(reader, material);
  material.contact_friction = reader.number("friction");
  material.damping = reader.number("damping").value_or(0);
  (void)reader.find("stick");      // simulate/effects/contact.cpp
  (void)reader.find("expansion");  // simulate/thermal/thermal.cpp
  (void)reader.find("conductivity");
  reader.finish();
  if (material.contact_friction && !(*material.contact_friction >= 0))
    reader.fail("\"friction\" needs to be 0 or more");
  if (!(material.damping >= 0)) reader.fail("\"damping\" needs to be 0 or more");
  if (!(material.hardening >= 0)) reader.fail("\"hardening\" needs to be 0 or more");
  if (!(material.elongation >= 0)) reader.fail("\"elongation\" needs to be above 0");
  if (!(material.young > 0)) reader.fail("\"young\" needs to be above 0");
  if (!(material.poisson > -1 && material.poisson < 0.5))
    reader.fail(fmt::format("\"poisson\" = {} needs to lie above -1 and below 0.5", material.poisson));
  // To either end: nearer, rounding leaves nothing of the softer of bulk and shear modulus.
  constexpr double kNearest = 1e-6;
  if (material.poisson < -1 + kNearest || material.poisson > 0.5 - kNearest)
    reader.fail(fmt::format(
        "\"poisson\" = {} is nearer to {} than rounding allows: take one from -0.999999 to 0.499999",
        material.poisson, material.poisson < 0 ? "-1" : "0.5"));
  if (!(material.density > 0)) reader.fail("\"density\" needs to be above 0");
  return material;
}

void parse_materials(TableReader& root, Scene& scene) {
  const SceneValue* table = root.find("materials");
  if (!table) return;
  TableReader materials(*table, root.file(), "[materials]");
  for (const auto& [name, value] : table->members) {
    TableReader reader(value, root.file(), fmt::format("[materials.{}]", name));
    for (const auto& [other, material] : scene.materials)
      if (same_material_name(other, name))
        reader.fail(
            fmt::format("[materials.{}] and [materials.{}] are one name: case, blanks, \"-\" and \"_\" do "
                        "not matter; rename one",
                        other, name));
    scene.materials[name] = parse_material(reader, name);
  }
}

void parse_parts(TableReader& root, Scene& scene) {
  const SceneValue* table = root.find("parts");
  if (!table) return;
  TableReader parts(*table, root.file(), "[parts]");
  for (const auto& [name, value] : table->members) {
    TableReader reader(value, root.file(), fmt::format("[parts.{}]", name));
    PartSettings settings;
    settings.origin = reader.place();
    settings.material = reader.text("material").value_or("");
    settings.model = reader.text("model").value_or("");
    settings.hooke = reader.text("hooke").value_or("");
    settings.infill = parse_infill(reader);
    settings.axes = parse_axes(reader);
    (void)reader.find("rigid");  // simulate/effects/rigid.h
    reader.finish();
    scene.parts[name] = settings;
  }
}

Probe parse_probe(TableReader& reader, std::size_t number) {
  Probe probe;
  probe.origin = reader.place();
  probe.name = reader.text("name").value_or(fmt::format("probe {}", number));
  probe.at = reader.vector("at", Dimension::length);
  if (const SceneValue* where = reader.find("where")) probe.where = parse_selection(*where, reader);
  reader.finish();
  if (probe.at.has_value() == probe.where.has_value())
    reader.fail(
        "[[probe]] needs either \"at\" (a point, for example [\"10 mm\", \"5 mm\", \"0 mm\"]) or \"where\" "
        "(a "
        "selection, whose mean it gives)");
  return probe;
}

// Results and columns of the books go by the names.
void refuse_second_probe(const Scene& scene, const TableReader& reader) {
  const std::string& name = scene.probes.back().name;
  const auto same = [&](const Probe& each) { return each.name == name; };
  if (std::count_if(scene.probes.begin(), scene.probes.end(), same) > 1)
    reader.fail(fmt::format("two [[probe]] are called \"{}\": give each a name of its own", name));
}

std::optional<int> whole_number(TableReader& reader, const char* key, int most) {
  const std::optional<double> value = reader.number(key);
  if (!value) return std::nullopt;
  if (!(*value >= 1 && *value <= most && *value == std::floor(*value)))
    reader.fail(fmt::format("\"{}\" needs to be a whole number from 1 to {}", key, most));
  return static_cast<int>(*value);
}

void parse_time(TableReader& reader, RunSettings& run) {
  run.time = reader.quantity("time", Dimension::time);
  run.step = reader.quantity("step", Dimension::time);
  run.history_every = reader.quantity("history_every", Dimension::time);
  run.frames = whole_number(reader, "frames", 1000000);
  const std::optional<std::string> method = reader.text("method");
  for (const auto& [key, value] :
       {std::pair{"time", run.time}, {"step", run.step}, {"history_every", run.history_every}})
    if (value && !(*value > 0)) reader.fail(fmt::format("\"{}\" needs to be above 0", key));
  constexpr double kLeastShare = 1e-12;  // of the time: no run gets to the end of more steps
  if (run.time && run.step && !(*run.step > kLeastShare * *run.time))
    reader.fail(reader.find("step")->line,
                fmt::format("\"step\" is under {:g} of \"time\", and no run takes so many steps: leave it "
                            "out, and the run chooses its own",
                            kLeastShare));
  if (run.time && reader.find("until")) reader.fail("[run] has both \"until\" and \"time\"; give one");
  if (!run.time && (run.step || run.history_every || run.frames || method))
    reader.fail("[run] has keys of a timed run but no \"time\", for example time = \"1 s\"");
  if (!method) return;
  if (*method == "symplectic")
    run.method = TimeMethod::symplectic_euler;
  else if (*method == "explicit")
    run.method = TimeMethod::explicit_euler;
  else if (*method == "verlet")
    run.method = TimeMethod::verlet;
  else if (*method == "implicit")
    run.method = TimeMethod::implicit_euler;
  else
    reader.fail(
        reader.find("method")->line,
        fmt::format("\"method\" = \"{}\"; choose \"symplectic\", \"verlet\", \"explicit\" or \"implicit\"",
                    *method));
}

void parse_modes(TableReader& reader, RunSettings& run) {
  constexpr int kMost = 1000;
  run.modes = whole_number(reader, "modes", kMost);
  run.buckling = whole_number(reader, "buckling", kMost);
  if (run.modes && run.buckling) reader.fail("[run] has both \"modes\" and \"buckling\"; give one");
  const char* wanted = run.modes ? "modes" : "buckling";
  if ((run.modes || run.buckling) && run.time)
    reader.fail(reader.find(wanted)->line,
                fmt::format("[run] has both \"{}\" and \"time\": a timed run has none; give one", wanted));
}

RunSettings parse_run(TableReader& root) {
  RunSettings run;
  const SceneValue* table = root.find("run");
  if (!table) {
    if (const SceneValue* adaptive = root.find("adaptive"))
      root.fail(adaptive->line, "[adaptive] needs resolution = \"adaptive\" in [run]");
    return run;
  }
  TableReader reader(*table, root.file(), "[run]");
  if (const std::optional<std::string> until = reader.text("until"); until && *until != "equilibrium")
    reader.fail(
        reader.find("until")->line,
        fmt::format("\"until\" = \"{}\": only \"equilibrium\", or leave it out and give time = \"1 s\"",
                    *until));
  parse_time(reader, run);
  run.tolerance = reader.number("tolerance").value_or(run.tolerance);
  run.tolerance_given = reader.find("tolerance") != nullptr;
  run.load_steps = whole_number(reader, "load_steps", 10000).value_or(run.load_steps);
  run.newton_iterations = whole_number(reader, "newton_iterations", 1000000);
  parse_modes(reader, run);
  run.adaptive = parse_adaptive(root, reader);
  if (const SceneValue* value = reader.find("renormalise")) {
    if (value->kind != SceneValue::Kind::boolean)
      reader.fail(value->line, "\"renormalise\" needs to be true or false");
    run.renormalise = value->flag;
  }
  reader.finish();
  if (!(run.tolerance >= 1e-12 && run.tolerance <= 1e-2))
    reader.fail(fmt::format("\"tolerance\" = {} needs to lie between 1e-12 and 1e-2", run.tolerance));
  return run;
}

// One after the other; at an event the run begins anew, so they are no steps.
void add_turns(const Event& event, double duration, const TableReader& reader, std::vector<Event>& events) {
  constexpr double kMostTurns = 10'000;
  const double until = event.until.value_or(duration);
  if (!(until >= event.at && until <= duration))
    reader.fail(
        fmt::format("\"until\" = {:.6g} s is not between \"at\" and the end of the run, {:.6g} s to {:.6g} s",
                    until, event.at, duration));
  const double turns = std::floor((until - event.at) / event.every * (1 + 1e-12)) + 1;
  if (turns > kMostTurns)
    reader.fail(fmt::format("\"every\" would be {:.6g} times, and at most {:.0f} are: give a longer time",
                            turns, kMostTurns));
  for (double turn = 0; turn < turns; ++turn) {
    Event one = event;
    one.at = std::min(event.at + turn * event.every, duration);
    one.turn = static_cast<std::size_t>(turn);
    one.turns = static_cast<std::size_t>(turns);
    events.push_back(std::move(one));
  }
}

void parse_events(TableReader& root, Scene& scene) {
  for (const SceneValue* table : root.tables("event")) {
    TableReader reader(*table, root.file(), "[[event]]");
    Event event = Events::parse(reader, scene.run.time.has_value());
    if (scene.run.time && !(event.at >= 0 && event.at <= *scene.run.time))
      reader.fail(
          fmt::format("\"at\" = {:.6g} s is not within the run, 0 s to {:.6g} s", event.at, *scene.run.time));
    if (event.every > 0 && std::any_of(scene.events.begin(), scene.events.end(), [&](const Event& other) {
          return other.turns > 1 && other.origin == event.origin;  // by which they are told apart
        }))
      reader.fail("two events with \"every\" begin on one line: give each a line of its own");
    if (event.every > 0)
      add_turns(event, *scene.run.time, reader, scene.events);
    else
      scene.events.push_back(std::move(event));
  }
  std::stable_sort(scene.events.begin(), scene.events.end(),
                   [](const Event& a, const Event& b) { return a.at < b.at; });
}

}  // namespace

Scene parse_scene(const std::string& text, const std::string& name) {
  const SceneValue tree = read_toml(text, name);
  TableReader root(tree, name, "the scene");
  refuse_unknown_keys(tree, name);
  Scene scene;
  scene.name = name;
  scene.text = text;
  scene.material = root.text("material").value_or("");
  scene.model = root.text("model").value_or("");
  scene.infill = parse_infill(root);
  parse_materials(root, scene);
  parse_parts(root, scene);
  for (const SceneValue* table : root.tables("probe")) {
    TableReader reader(*table, name, "[[probe]]");
    scene.probes.push_back(parse_probe(reader, scene.probes.size() + 1));
    refuse_second_probe(scene, reader);
  }
  scene.run = parse_run(root);
  parse_events(root, scene);
  parse_effects(root, scene.effects);
  root.finish();
  return scene;
}

Scene read_scene(const std::string& path) {
  const Bytes bytes = read_all(path);
  return parse_scene(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
                     path == "-" ? "stdin" : path);
}

Tie make_fix(Selection where) {
  Tie tie;
  tie.name = describe(where);
  tie.origin = where.origin;
  tie.where = std::move(where);
  return tie;
}

Tie make_move(Selection where, const Vec3& displacement) {
  Tie tie = make_fix(std::move(where));
  tie.is_move = true;
  tie.motion.translation = displacement;
  return tie;
}

Load make_push(Selection where, const Vec3& force) {
  Load load;
  load.name = describe(where);
  load.origin = where.origin;
  load.where = std::move(where);
  load.force = force;
  return load;
}

Load make_pressure(Selection where, double pressure) {
  Load load = make_push(std::move(where), Vec3::Zero());
  load.force.reset();
  load.pressure = pressure;
  return load;
}

}  // namespace flexel::simulate
