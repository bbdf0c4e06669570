// The lattices are made by the events themselves, on a copy.
#include "simulate/time/rehearsal.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/events/adaptive_resolution.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/events/resolution.h"
#include "simulate/models/rest_shape.h"
#include "simulate/probes/probes.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {
namespace {

// Others remember places of the lattice.
bool is_carried(const std::string& effect) {
  for (const char* name : {Gravity::name, Loads::name, Supports::name, Bonds::name, Damping::name,
                           InitialVelocity::name, Drag::name, Contact::name, ContactLosses::name})
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

// Effects that are there, and what they remember.
void refuse_what_remembers(const Scene& scene, const std::string& origin, bool live) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(origin, fmt::format("resolution changes in no run {}: leave one of them out", what));
  };
  if (live) refuse("that is led or watched live");
  const Contact::Parameters& contact = scene.get<Contact>();
  if (!contact.on) return;
  if (contact.sticks())
    refuse("with contact that sticks (\"stick\" or \"glue\"), which remembers places of the lattice");
  if (contact.parting > 0)
    refuse(
        "with contact that lets out what overlaps (\"overlap\" = \"part\"), which remembers places of the "
        "lattice");
}

// A copy of the body at rest, on which changes are tried.
class Rehearsal {
 public:
  Rehearsal(const Body& body, const Scene& scene) : body_(body), scene_(scene) {
    start_.settled = settled_displacement(body);
    start_.fused = fused_points(body);
  }
  void apply(const Event& event) {
    Progress quiet("flexel", Progress::Mode::quiet);
    const Problem problem = timed_problem(body_, scene_, start_);
    State rest;
    rest.displacement.assign(body_.element_count(), Vec3::Zero());
    rest.velocity = rest.displacement;
    EventContext context{body_, rest, start_.fused, start_.settled, problem, quiet};
    (void)event.apply(context);
  }
  [[nodiscard]] const Body& body() const { return body_; }

 private:
  Body body_;
  const Scene& scene_;
  SegmentStart start_;
};

// Level by level as many parts as there is room for.
void rehearse_levels(const Body& body, const Scene& scene, ResolutionChange to, int levels) {
  const AdaptiveSettings& settings = *scene.run.adaptive;
  Rehearsal rehearsal(body, scene);
  for (int level = 0; level < levels; ++level) {
    bool any = false;
    std::string no_room;
    for (const std::uint32_t p : AdaptiveResolution::parts_of(settings, body)) {
      const Body& now = rehearsal.body();
      const Part& part = now.parts[p];
      const auto elements = static_cast<double>(now.element_count());
      const double then = elements - (part.element_end - part.element_begin) +
                          static_cast<double>(finer_element_count(now, part));
      const std::string why =
          to == ResolutionChange::finer ? AdaptiveResolution::beyond_limits(settings, then, elements) : "";
      if (!why.empty()) {
        if (no_room.empty())
          no_room = fmt::format("part \"{}\" has no room to become finer: {}", part.name, why);
        continue;
      }
      rehearsal.apply(make_event(ResolutionEvent(to, p, "", settings.origin), 0, settings.origin));
      any = true;
    }
    if (!any && level == 0)
      throw InputError(settings.origin,
                       no_room + "; allow more, voxelize with a larger --size, or leave \"resolution\" out");
    if (!any) return;
    look_for_what_it_names(rehearsal.body(), scene, settings.origin);
  }
}

void rehearse_adaptive(const Body& body, const Scene& scene, bool live) {
  const AdaptiveSettings& settings = *scene.run.adaptive;
  if (!scene.events.empty())
    throw InputError(settings.origin,
                     fmt::format("resolution = \"adaptive\" takes no events, such as {} ({}): leave one of "
                                 "them out",
                                 scene.events.front().name, scene.events.front().origin));
  refuse_what_remembers(scene, settings.origin, live);
  look_for_what_it_names(body, scene, settings.origin);
  rehearse_levels(body, scene, ResolutionChange::coarser, settings.coarsest);
  rehearse_levels(body, scene, ResolutionChange::finer, settings.finest);
}

}  // namespace

void rehearse_resolution(const Body& body, const Scene& scene, bool live) {
  if (scene.run.adaptive) return rehearse_adaptive(body, scene, live);
  const auto changes = [](const Event& event) { return event.name == ResolutionEvent::name; };
  const auto first = std::find_if(scene.events.begin(), scene.events.end(), changes);
  if (first == scene.events.end()) return;
  const auto other = std::find_if_not(scene.events.begin(), scene.events.end(), changes);
  if (other != scene.events.end())
    throw InputError(first->origin,
                     fmt::format("resolution changes in no run with other events, such as {} ({}): "
                                 "leave one of them out",
                                 other->name, other->origin));
  refuse_what_remembers(scene, first->origin, live);
  look_for_what_it_names(body, scene, first->origin);
  Rehearsal rehearsal(body, scene);
  for (const Event& event : scene.events) {
    rehearsal.apply(event);
    look_for_what_it_names(rehearsal.body(), scene, event.origin);
  }
}

}  // namespace flexel::simulate
