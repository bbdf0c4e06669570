// The list of events. A new one is added here and nowhere else.
#pragma once
#include <fmt/format.h>

#include "base/error.h"
#include "base/nearest_word.h"
#include "simulate/events/add.h"
#include "simulate/events/carve.h"
#include "simulate/events/edit.h"
#include "simulate/events/fuse.h"
#include "simulate/events/renormalise.h"
#include "simulate/events/resolution.h"

namespace flexel::simulate {

template <class... E>
struct EventList {
  // `every` and `until`; how often it happens by `until`, of the run's time where that is not given, is left to the caller.
  static void parse_turns(TableReader& reader, bool timed, Event& event) {
    const SceneValue* every = reader.find("every");
    const SceneValue* until = reader.find("until");
    if (const SceneValue* given = every ? every : until; given && !timed)
      reader.fail(given->line, "at equilibrium an event happens once: leave \"every\" and \"until\" out");
    if (until && !every)
      reader.fail(until->line, "\"until\" ends what happens \"every\" so often: give that too");
    if (!every) return;
    event.every = reader.to_quantity(*every, Dimension::time, "every");
    if (!(event.every > 0)) reader.fail(every->line, "\"every\" needs to be above 0");
    if (until) event.until = reader.to_quantity(*until, Dimension::time, "until");
  }

  // [[event]] of a scene; `timed`: of a run in time, where it has a time, at equilibrium it has none (0). Throws
  // InputError.
  [[nodiscard]] static Event parse(TableReader& reader, bool timed) {
    const SceneValue* given = reader.find("at");
    if (given && !timed)
      reader.fail(given->line,
                  "\"at\" is a time of a timed run: give [run] time = \"1 s\", or leave \"at\" out: at "
                  "equilibrium events happen before the loads act");
    const double at =
        timed ? reader.to_quantity(reader.require("at", "\"0.2 s\""), Dimension::time, "at") : 0;
    const SceneValue& what = reader.require("do", "\"renormalise\"");
    std::optional<Event> event;
    const auto attempt = [&](auto parse, const char* name) {
      if (!event && what.text == name) event = make_event(parse(reader), at, reader.place());
    };
    (attempt([](TableReader& r) { return E::parse(r); }, E::name), ...);
    if (!event) {
      const std::vector<std::string> names{E::name...};
      reader.fail(what.line, fmt::format("no event \"{}\"{}; known: {}", what.text,
                                         did_you_mean(what.text, names), fmt::join(names, ", ")));
    }
    parse_turns(reader, timed, *event);
    reader.finish();
    return std::move(*event);
  }
};

using Events = EventList<Renormalise, Edit, Carve, Fuse, Add, ResolutionEvent>;

}  // namespace flexel::simulate
