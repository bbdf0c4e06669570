// Origins, file and line, tell events apart.
#include "simulate/events/repeated_events.h"

#include <fmt/format.h>

namespace flexel::simulate {

std::string RepeatedEvents::apply(const Event& event, EventContext& context) {
  if (event.turns == 1) return event.apply(context);
  Turns& turns = turns_[event.origin];
  ++turns.happened;
  try {
    turns.last = event.apply(context);
    ++turns.found;
  } catch (const EmptySelectionError& error) {
    turns.nothing = error.what();
  }
  if (event.turn + 1 < event.turns) return "";
  if (turns.found > 0)
    return fmt::format("{} of {} times, at last {}", turns.found, turns.happened, turns.last);
  context.progress.warn(
      fmt::format("{}: {} found nothing in {} times{}: {}", event.origin, event.name, turns.happened,
                  turns.happened < event.turns ? " since the run was resumed" : "", turns.nothing));
  return "";
}

}  // namespace flexel::simulate
