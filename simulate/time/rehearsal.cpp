// The lattices are made by the events themselves, on a copy.
#include "simulate/time/rehearsal.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/events/resolution.h"
#include "simulate/models/rest_shape.h"
#include "simulate/probes/probes.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {
namespace {

// Others remember places of the lattice.
bool is_carried(const std::string& effect) {
  for (const char* name : {Gravity::name, Loads::name, Supports::name, Bonds::name, Damping::name,
                           InitialVelocity::name, Drag::name})
    if (effect == name) return true;
  return false;
}

void look_for_what_it_names(const Body& body, const Scene& scene, const std::string& origin) {
  const Problem problem = timed_problem(body, scene, {});
  (void)place_probes(scene, problem);
  for (const ActiveEffect& effect : active_effects(scene.effects, problem))
    if (!is_carried(effect.name))
      throw InputError(origin,
                       fmt::format("resolution changes in no run with {} ({}), which remembers places of "
                                   "the lattice: leave one of them out",
                                   effect.name, effect.why));
}

}  // namespace

void rehearse_resolution(const Body& body, const Scene& scene, bool live) {
  const auto changes = [](const Event& event) { return event.name == ResolutionEvent::name; };
  const auto first = std::find_if(scene.events.begin(), scene.events.end(), changes);
  if (first == scene.events.end()) return;
  const auto other = std::find_if_not(scene.events.begin(), scene.events.end(), changes);
  if (other != scene.events.end())
    throw InputError(first->origin,
                     fmt::format("resolution changes in no run with other events, such as {} ({}): "
                                 "leave one of them out",
                                 other->name, other->origin));
  if (live)
    throw InputError(first->origin,
                     "resolution changes in no run that is led or watched live: leave one out");
  Body copy = body;
  look_for_what_it_names(copy, scene, first->origin);
  Progress quiet("flexel", Progress::Mode::quiet);
  SegmentStart start;
  start.settled = settled_displacement(body);
  start.fused = fused_points(body);
  for (const Event& event : scene.events) {
    const Problem problem = timed_problem(copy, scene, start);
    State rest;
    rest.displacement.assign(copy.element_count(), Vec3::Zero());
    rest.velocity = rest.displacement;
    EventContext context{copy, rest, start.fused, start.settled, problem, quiet};
    (void)event.apply(context);
    look_for_what_it_names(copy, scene, event.origin);
  }
}

}  // namespace flexel::simulate
