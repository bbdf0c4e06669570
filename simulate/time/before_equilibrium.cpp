// As at the beginning of a timed run, without its clock.
#include "simulate/time/before_equilibrium.h"

#include <fmt/format.h>

#include "formats/lattice/fused_points.h"
#include "simulate/models/rest_shape.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {

void happen_before_equilibrium(Body& body, Scene scene, Progress& progress) {
  for (const Event& event : scene.events)
    if (event.prepare)
      for (std::string& name : event.prepare()) scene.coming_parts.push_back(std::move(name));
  State state = state_of(body);
  SegmentStart start;
  start.settled = settled_displacement(body);
  start.fused = fused_points(body);
  body.notes.erase(kFusedNote);  // events change start.fused and the numbers of elements
  for (const Event& event : scene.events) {
    const Problem problem = timed_problem(body, scene, start);
    EventContext context{body, state, start.fused, start.settled, problem, progress};
    const std::string what = event.apply(context);
    progress.say(fmt::format("{}: {}", event.name, what));
  }
  set_fused_points(body, start.fused);
  body.position.resize(body.element_count());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    body.position[e] = body.rest[e] + state.displacement[e];
}

}  // namespace flexel::simulate
