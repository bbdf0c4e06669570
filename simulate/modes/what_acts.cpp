// Supports, loads, gravity and bonds have a tangent; all else needs a time or has a threshold.
#include "simulate/modes/what_acts.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"

namespace flexel::simulate {

bool drives(const std::vector<ActiveEffect>& effects) {
  return std::any_of(effects.begin(), effects.end(), [](const ActiveEffect& each) { return each->drives(); });
}

void refuse_what_modes_lack(const Scene& scene, const std::vector<ActiveEffect>& effects) {
  const std::string what = scene.run.buckling ? "buckling" : "modes";
  if (scene.run.renormalise)
    throw InputError(scene.name,
                     fmt::format("[run] {} leaves the rest shape as it is: leave renormalise out", what));
  for (const ActiveEffect& effect : effects)
    if (effect.name != Supports::name && effect.name != Loads::name && effect.name != Gravity::name &&
        effect.name != Bonds::name)
      throw InputError(
          scene.name,
          effect.name == RigidParts::name
              ? fmt::format("[run] {} has no rigid parts: leave \"rigid\" of [parts.NAME] "
                            "and [[manipulator]] out",
                            what)
              : fmt::format("[run] {} has no {} ({}): leave it out", what, effect.name, effect.why));
  for (const ActiveEffect& effect : effects)
    if (effect->follows())
      throw InputError(
          scene.name,
          fmt::format("[run] {} has no loads with follower = true, whose stiffness is not symmetric: "
                      "leave follower out",
                      what));
  for (const Tie& tie : scene.get<Supports>().ties)
    if (tie.link)
      throw InputError(
          tie.origin,
          fmt::format("[run] {} has no rigid links (\"{}\"); use link = \"averaging\"", what, tie.name));
}

void refuse_buckled(const std::string& scene) {
  throw DivergedError(
      scene +
      ": under these loads the stiffness is not positive: the part has buckled, and vibrates about "
      "no such state; use smaller loads ([run] buckling = 1 tells how large they may be)");
}

}  // namespace flexel::simulate
