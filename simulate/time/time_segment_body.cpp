// Between an act and what is around it: what it is made from, what it leaves in the body, its plan in words.
#include "simulate/time/time_segment.h"

#include <fmt/format.h>

#include <cmath>

#include "simulate/contact/pairs/stuck_places.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/rigid.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace flexel::simulate {

Problem timed_problem(const Body& body, const Scene& scene, const SegmentStart& beginning) {
  return {body,
          materials_of_parts(scene, body),
          {},
          models_of_parts(scene, body),
          hooke_of_parts(scene, body),
          {},
          scene.run.time,
          beginning.settled,
          RigidParts::rigidity(scene.get<RigidParts>(), body)};
}

void TimeSegment::store(const State& state) {
  body_.position.resize(body_.element_count());
  Column velocity;
  velocity.components = 3;
  velocity.values.reserve(3 * body_.element_count());
  for (std::size_t e = 0; e < body_.element_count(); ++e) {
    body_.position[e] = body_.rest[e] + state.displacement[e];
    velocity.values.insert(velocity.values.end(), state.velocity[e].begin(), state.velocity[e].end());
  }
  body_.element_columns["velocity"] = std::move(velocity);
  if (stepper_->mark_broken(body_.broken)) derive_connections(body_);
  stepper_->write_memory(body_.cell_count(), body_.cell_columns);
  if (yield_) yield_->write(body_);
  set_fused_points(body_, fused());
  store_stuck();
}

void TimeSegment::store_stuck() {
  body_.notes.erase(kStuckNote);
  for (const ActiveEffect& effect : effects_)
    if (effect.name == Contact::name) set_stuck_places(body_, stuck_in(effect->transfer_state()));
}

void TimeSegment::unload() {
  std::vector<Vec3>().swap(body_.position);
  body_.element_columns.erase("velocity");
#ifdef __GLIBC__
  malloc_trim(0);  // likewise what was freed since the body was read
#endif
}

void TimeSegment::explain(const Clock& clock) const {
  const double left = clock.until - *state_.time;
  progress_.say(fmt::format(
      "plan: cells (the parts' models), {} {}steps of {:.4g} s, {}",
      static_cast<std::uint64_t>(std::llround(left / clock.step)), is_implicit() ? "implicit " : "",
      clock.step,
      is_implicit() ? std::string("Newton's method") : fmt::format("kernel {}", stepper().isa())));
  if (staged_)
    progress_.say(fmt::format(
        "plan: every step has {} stages for the damping, which in one would cut it by more than 2",
        damping_stages(clock.step * clock.damping_rate).size()));
  for (const ActiveEffect& effect : effects_)
    progress_.say(fmt::format("plan: {} ({})", effect.name, effect.why));
  for (const Event& event : scene_.events)
    progress_.say(fmt::format("plan: at {:.4g} s {} ({})", event.at, event.name, event.origin));
}

}  // namespace flexel::simulate
