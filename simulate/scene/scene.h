// Scene: what happens to a body. Read from TOML (docs/reference/scene.md gives every key and unit) or filled by a
// program:
//     Scene scene;
//     scene.material = "steel";
//     scene.get<Supports>().ties.push_back(make_fix(parse_where("xmin", "--fix")));
//     scene.get<Loads>().loads.push_back(make_push(parse_where("part/3", "--push"), {0, 0, -100}));
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/events/event.h"
#include "simulate/input/adaptive_settings.h"
#include "simulate/input/infill.h"
#include "simulate/input/materials.h"
#include "simulate/input/scene_selection.h"
#include "simulate/scene/effects.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// [parts.NAME]
struct PartSettings {
  std::string material;  // "" : the scene's default, else the body's own
  std::string model;     // "" : cells at corner placement, paper at centre placement
  std::string hooke;     // of model paper: "paper" ("" too), "ganovelli" or "isotropic"
  Infill infill = {};    // of its own `material`, else of the scene's
  std::string origin;
  std::optional<Mat3> axes = {};  // of an orthotropic material, columns, world frame; nothing: the world's
};

// A material point whose displacement is reported; `at` (rest, world frame, m) or the mean over a selection.
struct Probe {
  std::string name;
  std::optional<Vec3> at;
  std::optional<Selection> where;
  std::string origin;
};

enum class TimeMethod { symplectic_euler, explicit_euler, verlet, implicit_euler };

// [run]
struct RunSettings {
  // Timed runs; nothing in `time`: equilibrium.
  std::optional<double> time;  // s
  std::optional<double> step;  // s; nothing: from the stability bound
  TimeMethod method = TimeMethod::symplectic_euler;
  std::optional<int> frames;            // of a .pvd series, the first one not counted
  std::optional<double> history_every;  // s
  double tolerance = 1e-8;              // largest residual, relative to loads and reactions
  bool tolerance_given = false;         // by the scene's file
  int load_steps = 1;                   // at least; steps that fail are cut by themselves
  // after which the run gives up; each load step that ends in equilibrium allows 10 more. Nothing: 100, or 40
  // where the first linear answer is several times the size of the body
  std::optional<int> newton_iterations;
  std::optional<int> modes;     // natural vibrations that are wanted; nothing: equilibrium
  std::optional<int> buckling;  // shapes of buckling, likewise
  bool renormalise = false;     // the shape at the end becomes the rest shape (simulate/models/rest_shape.h)
  std::optional<AdaptiveSettings> adaptive;  // of timed runs; nothing: lattices stay as they are
};

struct Scene {
  std::string name = "scene";                 // for messages
  std::string text;                           // that it was parsed from; "" where a program filled it
  std::string material;                       // default of every part; "" : the body's own
  std::string model;                          // likewise; "" : by placement
  Infill infill = {};                         // of `material`; nothing: solid
  std::map<std::string, Material> materials;  // the scene's own; they go before the library
  std::map<std::string, PartSettings> parts;
  std::vector<Probe> probes;
  RunSettings run;
  std::vector<Event> events;              // ascending in time
  std::vector<std::string> coming_parts;  // that events will add; set when the run begins
  EffectParameters effects;

  template <class E>
  [[nodiscard]] typename E::Parameters& get() {
    return effects.get<E>();
  }
  template <class E>
  [[nodiscard]] const typename E::Parameters& get() const {
    return effects.get<E>();
  }
};

// Parses a scene. `name` is the file's name for messages. Throws InputError("name:line", ...): wrong TOML, an
// unknown key (with the nearest), a missing unit, a wrong kind, keys that exclude each other.
[[nodiscard]] Scene parse_scene(const std::string& text, const std::string& name);

// Reads the file ("-": stdin) and parses it.
[[nodiscard]] Scene read_scene(const std::string& path);

// Entries for a scene that a program fills; their names are the selection in words.
[[nodiscard]] Tie make_fix(Selection where);
[[nodiscard]] Tie make_move(Selection where, const Vec3& displacement);  // m
[[nodiscard]] Load make_push(Selection where, const Vec3& force);        // N, in total
[[nodiscard]] Load make_pressure(Selection where, double pressure);      // Pa

// The material of each part: that of [parts.NAME], else the scene's default, else the body's own, with what
// its infill leaves of it (simulate/input/infill.h). Throws InputError: none (and what to write), an unknown name
// (with the nearest), a problem for a part that the body does not have, a model or placement that cannot be
// run.
[[nodiscard]] std::vector<Model> models_of_parts(const Scene& scene, const Body& body);
[[nodiscard]] std::vector<HookeConstant> hooke_of_parts(const Scene& scene, const Body& body);
[[nodiscard]] std::vector<Material> materials_of_parts(const Scene& scene, const Body& body);

}  // namespace flexel::simulate
