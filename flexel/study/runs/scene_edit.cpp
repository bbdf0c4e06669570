// The scene is parsed, changed as a tree and written again; flexel-simulate reads and checks the result.
#define TOML_EXCEPTIONS 1
#include "flexel/study/runs/scene_edit.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <sstream>

#include "base/error.h"
#include "base/units.h"
#include "simulate/input/key_depth.h"
#include "simulate/scene/effects.h"

namespace flexel::study {
namespace {

// What acts and can be left out, by its key: what the effects say of themselves, and events. Supports ([[fix]])
// are not among it: without them there is another problem, not a cheaper one.
std::vector<std::string> effect_keys() {
  std::vector<std::string> keys;
  for (const simulate::EffectRow& row : simulate::effect_rows())
    keys.insert(keys.end(), row.can_leave_out.begin(), row.can_leave_out.end());
  keys.push_back("event");
  return keys;
}

toml::table parse(const std::string& text, const std::string& name) {
  simulate::refuse_long_keys(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw InputError(name + ":" + std::to_string(error.source().begin.line),
                     std::string(error.description()));
  }
}

std::string text_at(const toml::table& table, const char* key) {
  return table[key].value_or(std::string());
}

// "load 2 (bracket/2)": identifies one of several.
std::string entry_name(const std::string& key, const toml::array& entries, std::size_t index) {
  if (entries.size() == 1) return key;
  std::string name = fmt::format("{} {}", key, index + 1);
  if (const toml::table* entry = entries[index].as_table()) {
    std::string own = text_at(*entry, "name");
    if (own.empty()) own = text_at(*entry, "where");
    if (!own.empty()) name += " (" + own + ")";
  }
  return name;
}

std::vector<SceneEffect> effects_of(const toml::table& scene) {
  std::vector<SceneEffect> effects;
  for (const std::string& key : effect_keys()) {
    const toml::node* node = scene.get(key);
    if (node == nullptr) continue;
    if (const toml::array* entries = node->as_array()) {
      for (std::size_t i = 0; i < entries->size(); ++i)
        effects.push_back({entry_name(key, *entries, i), key, i});
    } else if (!node->is_boolean() || node->as_boolean()->get()) {
      effects.push_back({key, key, 0});
    }
  }
  return effects;
}

toml::table& table_at(toml::table& parent, const std::string& key) {
  if (toml::node* found = parent.get(key); found != nullptr && found->is_table()) return *found->as_table();
  parent.insert_or_assign(key, toml::table{});
  return *parent.get(key)->as_table();
}

void leave_out(toml::table& scene, const std::string& name) {
  for (const SceneEffect& effect : effects_of(scene)) {
    if (effect.name != name) continue;
    toml::array* entries = scene.get(effect.key)->as_array();
    if (entries != nullptr && entries->size() > 1)
      entries->erase(entries->begin() + static_cast<std::ptrdiff_t>(effect.index));
    else
      scene.erase(effect.key);
    return;
  }
  throw InputError("the scene has no effect \"" + name + "\" to leave out");
}

// `add` events name body files, relative to the scene.
void make_paths_absolute(toml::table& scene, const std::filesystem::path& folder) {
  toml::array* events = scene["event"].as_array();
  if (events == nullptr) return;
  for (toml::node& each : *events)
    if (toml::table* event = each.as_table())
      if (const std::string body = text_at(*event, "body"); !body.empty())
        event->insert_or_assign("body", std::filesystem::absolute(folder / body).string());
}

}  // namespace

SceneFacts scene_facts(const std::string& text, const std::string& name) {
  const toml::table scene = parse(text, name);
  SceneFacts facts;
  if (const toml::table* run = scene["run"].as_table()) {
    if (const std::string time = text_at(*run, "time"); !time.empty()) {
      facts.timed = true;
      facts.duration = parse_quantity(time, Dimension::time);
      facts.own_step = run->contains("step");
      facts.integrator = (*run)["method"].value_or(std::string("symplectic"));
    }
    facts.tolerance = (*run)["tolerance"].value_or(facts.tolerance);
  }
  if (const toml::array* probes = scene["probe"].as_array())
    for (const toml::node& each : *probes)
      if (const toml::table* probe = each.as_table()) facts.probes.push_back(text_at(*probe, "name"));
  facts.model = text_at(scene, "model");
  if (const toml::table* parts = scene["parts"].as_table())
    for (const auto& [part, settings] : *parts)
      if (settings.is_table())
        if (const std::string model = text_at(*settings.as_table(), "model"); !model.empty())
          facts.model = model;
  facts.effects = effects_of(scene);
  return facts;
}

std::string edited_scene(const std::string& text, const std::string& name,
                         const std::filesystem::path& folder, const std::vector<std::string>& parts,
                         const Configuration& configuration) {
  toml::table scene = parse(text, name);
  make_paths_absolute(scene, folder);
  if (!configuration.without.empty()) leave_out(scene, configuration.without);
  for (const std::string& part : parts) {
    if (configuration.model.empty()) break;
    toml::table& settings = table_at(table_at(scene, "parts"), part);
    settings.insert_or_assign("model", configuration.model);
    settings.erase("hooke");
    if (!configuration.hooke.empty()) settings.insert_or_assign("hooke", configuration.hooke);
  }
  toml::table& run = table_at(scene, "run");
  if (configuration.tolerance) run.insert_or_assign("tolerance", *configuration.tolerance);
  if (!configuration.integrator.empty()) {
    if (run.get("method") == nullptr || text_at(run, "method") != configuration.integrator)
      run.erase("step");  // that of another method
    run.insert_or_assign("method", configuration.integrator);
  }
  if (configuration.step) run.insert_or_assign("step", fmt::format("{:.9g} s", *configuration.step));
  std::ostringstream out;
  out << toml::toml_formatter{scene} << '\n';
  return out.str();
}

}  // namespace flexel::study
