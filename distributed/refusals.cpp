// Effects are allowed by name: one that comes new is refused until somebody has thought about it.
#include "distributed/refusals.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/models/rest_shape.h"
#include "simulate/thermal/thermal.h"
#include "simulate/time/dynamic_relaxation.h"

namespace flexel::distributed {
namespace {

using namespace simulate;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw InputError(where,
                   fmt::format("flexel-simulate-mpi has no {}; leave it out, or run flexel-simulate", what));
}

}  // namespace

void refuse_unsupported(const Scene& scene) {
  if (scene.run.time) refuse(scene.name, "timed runs ([run] time)");
  if (scene.run.modes) refuse(scene.name, "vibrations ([run] modes)");
  if (scene.run.buckling) refuse(scene.name, "buckling ([run] buckling)");
  if (scene.run.renormalise) refuse(scene.name, "new rest shapes ([run] renormalise)");
  if (!scene.events.empty()) refuse(scene.name, "events ([[event]])");
  if (scene.get<Contact>().on) refuse(scene.name, "contact");
  if (settles(scene)) refuse(scene.name, "rigid parts and manipulators");
  if (scene.get<Thermal>().expands()) refuse(scene.name, "heat and shrinkage ([thermal], [shrinkage])");
  if (scene.get<Thermal>().conducts())
    refuse(scene.name, "conduction of heat ([[temperature]], [[heat]], [[convection]])");
  for (const Tie& tie : scene.get<Supports>().ties)
    if (tie.link) refuse(tie.origin, fmt::format("rigid links (load \"{}\", link = \"rigid\")", tie.name));
  for (const Load& load : scene.get<Loads>().loads)
    if (load.follower)
      refuse(load.origin, fmt::format("loads that turn (load \"{}\", follower = true)", load.name));
}

void refuse_unsupported(const Scene& scene, const Body& body) {
  const std::vector<Model> models = models_of_parts(scene, body);
  for (std::size_t p = 0; p < models.size(); ++p) {
    const char* name = models[p] == Model::springs     ? "springs"
                       : models[p] == Model::paper     ? "paper"
                       : models[p] == Model::quadratic ? "quadratic"
                                                       : nullptr;
    if (name)
      refuse(scene.name, fmt::format("model \"{}\" (part \"{}\"), only \"cells\"", name, body.parts[p].name));
  }
  if (RestShapes(body).any())
    refuse(scene.name,
           "rest shapes, which an earlier run left in the body: begin with the body as voxelized");
}

void refuse_unsupported(const Scene& scene, const std::vector<ActiveEffect>& effects) {
  constexpr std::array<std::string_view, 3> kAllowed = {Gravity::name, Loads::name, Supports::name};
  for (const ActiveEffect& effect : effects)
    if (std::find(kAllowed.begin(), kAllowed.end(), effect.name) == kAllowed.end())
      refuse(scene.name, fmt::format("{} ({})", effect.name, effect->why()));
}

}  // namespace flexel::distributed
