// The effects that a scene can name. A new one is a row of effects.cpp, and nothing else knows its name.
#pragma once
#include <any>
#include <map>
#include <typeindex>
#include <vector>

#include "simulate/effects/effect.h"
#include "simulate/scene/scene_key.h"

namespace flexel::simulate {

// What a scene says of each effect E: its E::Parameters, or their defaults where it says nothing.
class EffectParameters {
 public:
  template <class E>
  [[nodiscard]] typename E::Parameters& get() {
    std::any& held = held_[typeid(E)];
    if (!held.has_value()) held = typename E::Parameters{};
    return std::any_cast<typename E::Parameters&>(held);
  }
  template <class E>
  [[nodiscard]] const typename E::Parameters& get() const {
    static const typename E::Parameters none{};
    const auto found = held_.find(typeid(E));
    return found == held_.end() ? none : std::any_cast<const typename E::Parameters&>(found->second);
  }

 private:
  std::map<std::type_index, std::any> held_;
};

struct EffectRow {
  const char* name;
  const char* help;  // one line
  ActsIn acts;
  const char* models;  // of the parts that it acts on
  // Tables whose removal from a scene leaves this effect out, and a problem that can still be solved.
  std::vector<std::string> can_leave_out;
  std::vector<SceneKey> keys;
  void (*parse)(TableReader& scene, EffectParameters& parameters);
  void (*make)(const EffectParameters& parameters, const Problem& problem, std::vector<ActiveEffect>& to);
};

[[nodiscard]] const std::vector<EffectRow>& effect_rows();

// Throws InputError.
void parse_effects(TableReader& scene, EffectParameters& parameters);

// The effects that the scene calls for, each with the time that making it took. Throws InputError.
[[nodiscard]] std::vector<ActiveEffect> active_effects(const EffectParameters& parameters,
                                                       const Problem& problem);

// Throws InputError(scene, ...) naming an effect that has no meaning in this kind of run: `run` is ActsIn::all at
// equilibrium, ActsIn::relaxation_and_time where dynamic relaxation looks for it.
void refuse_timed(const std::vector<ActiveEffect>& effects, ActsIn run, const std::string& scene);

}  // namespace flexel::simulate
