// The general keys of a scene, those of all effects, and what is told of them.
#include "simulate/scene/scene_keys.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"
#include "simulate/scene/effects.h"

namespace flexel::simulate {
namespace {

using K = KeyKind;
using D = Dimension;

SceneKeyGroup material_keys() {
  const std::string m = "[materials.NAME]", p = "[parts.NAME]";
  return {
      "materials and parts",
      "what each part is made of and how it resists",
      "",
      "",
      {{"", "material", K::text, {}, "the body's", "of every part"},
       {"",
        "model",
        K::text,
        {},
        "by placement",
        "of every part: \"cells\", \"quadratic\", \"springs\" or \"paper\""},
       {"", "infill", K::quantity, D::share, "solid", "of a print, with the material beside it"},
       {"", "shell", K::quantity, D::length, "0", "solid walls around an infill"},
       {m, "law", K::text, {}, "\"neo-hooke\"", "or \"mooney-rivlin\", \"arruda-boyce\", \"orthotropic\""},
       {m, "young", K::quantity, D::pressure, "required", "Young's modulus; orthotropic: E1, E2, E3"},
       {m, "poisson", K::number, {}, "required", "above -1 and below 0.5; orthotropic: nu12, nu13, nu23"},
       {m, "shear", K::list, D::pressure, "required of its law", "of an orthotropic law: G12, G13, G23"},
       {m, "c10", K::quantity, D::pressure, "required of its law", "of Mooney and Rivlin's law"},
       {m, "c01", K::quantity, D::pressure, "required of its law", "of Mooney and Rivlin's law"},
       {m, "mu", K::quantity, D::pressure, "required of its law", "of Arruda and Boyce's law: n k T"},
       {m,
        "lambda_m",
        K::number,
        {},
        "required of its law",
        "of Arruda and Boyce's law: stretch at which chains end"},
       {m, "bulk", K::quantity, D::pressure, "required of its law",
        "bulk modulus, of Mooney and Rivlin's law, and Arruda and Boyce's"},
       {m, "density", K::quantity, D::density, "required", "of solid matter"},
       {m, "source", K::text, {}, "the scene's file", "where the figures come from"},
       {m, "yield", K::quantity, D::pressure, "none", "stress at which it flows"},
       {m, "hardening", K::quantity, D::pressure, "0", "stress per plastic strain"},
       {m, "uniform_elongation", K::number, {}, "none", "strain at the largest load: Voce's hardening"},
       {m, "strength", K::quantity, D::pressure, "none", "stress at which it breaks"},
       {m, "layer_strength", K::quantity, D::pressure, "none", "likewise across the layers of a print"},
       {m, "elongation", K::number, {}, "none", "plastic strain at which it breaks"},
       {m, "friction", K::number, {}, "that of [contact]", "coefficient"},
       {m, "damping", K::number, {}, "none", "share of the critical, for period of [damping]"},
       {p, "material", K::text, {}, "the scene's", "of this part"},
       {p, "model", K::text, {}, "the scene's", "\"cells\", \"quadratic\", \"springs\" or \"paper\""},
       {p, "axes", K::list, {}, "the world's", "of an orthotropic material: its first and second direction"},
       {p, "hooke", K::text, {}, "\"paper\"", "or \"ganovelli\", \"isotropic\": of model paper"},
       {p, "infill", K::quantity, D::share, "the scene's", "with the material beside it"},
       {p, "shell", K::quantity, D::length, "0", "solid walls around an infill"}}};
}

SceneKeyGroup run_keys() {
  const std::string r = "[run]", p = "[[probe]]";
  return {"run and probes",
          "what is computed and what is told of it",
          "",
          "",
          {{r, "until", K::text, {}, "\"equilibrium\"", "unless there is a time"},
           {r, "time", K::quantity, D::time, "", "of a timed run"},
           {r, "step", K::quantity, D::time, "the stable one", "of a timed run"},
           {r, "method", K::text, {}, "\"symplectic\"", "or \"verlet\", \"explicit\", \"implicit\""},
           {r, "frames", K::whole_number, {}, "50", "of a .pvd series"},
           {r, "history_every", K::quantity, D::time, "time / 1000", "between rows of --history"},
           {r, "tolerance", K::number, {}, "1e-8; 1e-5 with contact", "forces left over, relative"},
           {r, "load_steps", K::whole_number, {}, "1", "in which the load grows"},
           {r, "newton_iterations", K::whole_number, {}, "100", "after which the run gives up"},
           {r, "modes", K::whole_number, {}, "", "natural vibrations in place of equilibrium: how many"},
           {r, "buckling", K::whole_number, {}, "", "load factors and shapes of buckling: how many"},
           {r, "renormalise", K::flag, {}, "false", "the shape at the end becomes the rest shape"},
           {r, "resolution", K::text, {}, "\"fixed\"", "or \"adaptive\", of a timed run"},
           {p, "name", K::text, {}, "probe N", "for the summary"},
           {p, "at", K::vector, D::length, "", "a material point; or where"},
           {p, "where", K::selection, {}, "", "whose mean displacement is told"}}};
}

SceneKeyGroup event_keys() {
  const std::string e = "[[event]]";
  return {"events",
          "changes of the body at a time of a timed run, or before equilibrium is looked for",
          "equilibrium, timed runs",
          "",
          {{e, "at", K::quantity, D::time, "required; without a time none", "when"},
           {e, "do", K::text, {}, "required", "renormalise, edit, carve, fuse, add or resolution"},
           {e, "where", K::selection, {}, "everything", "of renormalise, edit, carve and fuse"},
           {e, "positions", K::text, {}, "\"now\"", "or \"rest\": the places that where means"},
           {e, "with", K::text, {}, "", "a part that the shapes of where move with"},
           {e, "every", K::quantity, D::time, "once", "between its times, from at on"},
           {e, "until", K::quantity, D::time, "the end of the run", "of every: the last time"},
           {e, "stiffness", K::number, {}, "1", "of edit: a factor"},
           {e, "damping", K::number, {}, "1", "of edit: a factor"},
           {e, "density", K::number, {}, "1", "of edit: a factor"},
           {e, "strength", K::number, {}, "1", "of edit: a factor, on elongation too"},
           {e, "yield", K::number, {}, "1", "of edit: a factor"},
           {e, "friction", K::number, {}, "1", "of edit: a factor"},
           {e, "radius", K::number, {}, "1", "of edit: a factor, of elements of model paper"},
           {e, "connections", K::text, {}, "", "of edit: \"inside\" or \"across\", those of model paper"},
           {e, "length", K::number, {}, "1", "of edit: a factor, of connections at rest"},
           {e, "stick", K::quantity, D::pressure, "0", "of edit: a traction more"},
           {e, "within", K::quantity, D::length, "required", "of fuse: over which distance"},
           {e, "body", K::text, {}, "required", "of add: a body's file"},
           {e, "velocity", K::vector, D::velocity, "0", "of add: what it comes with"},
           {e, "change", K::text, {}, "required", "of resolution: \"finer\" or \"coarser\""},
           {e, "part", K::text, {}, "every part", "of resolution: a part's name"}}};
}

SceneKeyGroup adaptive_keys() {
  const std::string a = "[adaptive]";
  return {
      "adaptive resolution",
      "when parts become finer and coarser, with resolution = \"adaptive\" in [run]",
      "timed runs",
      "cells",
      {{a, "parts", K::list, {}, "\"all\"", "names of parts that may change"},
       {a, "strain_jump", K::number, {}, "0.002", "difference of the strain of two cells that makes finer"},
       {a, "calm", K::number, {}, "0.25", "share of strain_jump under which a part is calm; at most 0.5"},
       {a, "contact", K::flag, {}, "true", "whether what touches a part, or is about to, makes it finer"},
       {a, "least_time", K::quantity, D::time, "time / 20", "that a part is calm before it becomes coarser"},
       {a, "finest", K::whole_number, {}, "1", "halvings of the spacing at most, from the start; to 4"},
       {a, "coarsest", K::whole_number, {}, "0", "doublings of the spacing at most, from the start; to 4"},
       {a,
        "max_elements",
        K::whole_number,
        {},
        "--max-elements",
        "of the body, beyond which nothing is finer"}}};
}

const char* name_of(ActsIn acts) {
  switch (acts) {
    case ActsIn::equilibrium:
      return "equilibrium";
    case ActsIn::all:
      return "equilibrium, timed runs";
    case ActsIn::relaxation_and_time:
      return "equilibrium with contact, timed runs";
    case ActsIn::time:
      break;
  }
  return "timed runs";
}

[[noreturn]] void refuse(const SceneMember& member, const std::string& title, const std::string& file,
                         const std::vector<std::string>& known) {
  std::string hint = did_you_mean(member.key, known);
  if (hint.empty()) hint = fmt::format("; known keys: {}", fmt::join(known, ", "));
  throw InputError(member.value.line > 0 ? fmt::format("{}:{}", file, member.value.line) : file,
                   fmt::format("unknown key \"{}\" in {}{}", member.key, title, hint));
}

void add(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

// Keys by their tables, and of the top of the scene those and the names of tables.
std::vector<std::string> known_in(const std::string& table) {
  std::vector<std::string> known;
  for (const SceneKeyGroup& group : scene_key_groups())
    for (const SceneKey& key : group.keys) {
      if (key.table == table) add(known, key.key);
      if (!table.empty() || key.table.empty() || key.table[0] != '[') continue;
      const std::size_t begin = key.table.find_first_not_of('[');
      add(known, key.table.substr(begin, key.table.find_first_of(".]") - begin));
    }
  return known;
}

void check_table(const SceneValue& table, const std::string& title, const std::string& file,
                 const std::vector<std::string>& known) {
  if (known.empty() || table.kind != SceneValue::Kind::table) return;
  for (const SceneMember& member : table.members)
    if (std::find(known.begin(), known.end(), member.key) == known.end()) refuse(member, title, file, known);
}

}  // namespace

std::vector<SceneKeyGroup> scene_key_groups() {
  std::vector<SceneKeyGroup> groups{material_keys(), run_keys()};
  for (const EffectRow& row : effect_rows())
    groups.push_back({row.name, row.help, name_of(row.acts), row.models, row.keys});
  groups.push_back(event_keys());
  groups.push_back(adaptive_keys());
  return groups;
}

std::string value_of(const SceneKey& key) {
  static constexpr const char* kNames[] = {"text",   "number",    "whole number", "true or false", "quantity",
                                           "vector", "direction", "selection",    "list",          "table"};
  const std::string name = kNames[static_cast<std::size_t>(key.kind)];
  if (!key.unit) return name;
  const std::string what = dimension_name(*key.unit);
  return key.kind == K::quantity ? what : fmt::format("{} of {}", name, what);
}

void refuse_unknown_keys(const SceneValue& scene, const std::string& file) {
  check_table(scene, "the scene", file, known_in(""));
  for (const auto& [key, value] : scene.members) {
    const std::string one = fmt::format("[{}]", key), several = fmt::format("[{}]", one);
    const std::vector<std::string> of_one = known_in(one), of_several = known_in(several);
    const bool array = of_one.empty();
    const std::vector<std::string>& known = array ? of_several : of_one;
    check_table(value, array ? several : one, file, known);
    for (const SceneValue& item : value.items) check_table(item, array ? several : one, file, known);
    const std::vector<std::string> of_named = known_in(fmt::format("[{}.NAME]", key));
    if (of_named.empty()) continue;
    for (const auto& [name, member] : value.members)
      check_table(member, fmt::format("[{}.{}]", key, name), file, of_named);
  }
}

}  // namespace flexel::simulate
