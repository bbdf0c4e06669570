// What an event is: something that changes the body itself at a time of a timed run (Jansson and Vergeest,
// sections 4.1 and 6.1), between two acts (simulate/time/time_segment.h). The kernel knows nothing of events, and a
// run without any is one act.
//
// An event E is one header (with its .cpp) in simulate/events and one entry of simulate/scene/events.h. It owns
//   E::name                                 what a scene calls it, `do = "carve"`
//   static E parse(TableReader&)            reads its own keys of [[event]]
//   std::vector<std::string> prepare()      before the run: reads what it needs; the parts that it will add
//   std::string apply(EventContext&) const        changes the context; says what it did
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "formats/lattice/fused_points.h"
#include "simulate/input/scene_selection.h"
#include "simulate/input/scene_table.h"
#include "simulate/input/selection.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// What an event acts on; all of it agrees when it begins and when it ends.
struct EventContext {
  Body& body;                      // as TimeSegment::store leaves it
  State& state;                    // displacement, velocity
  std::vector<FusedPoint>& fused;  // so far
  std::vector<Vec3>& settled;      // (elements) m, or empty: Problem::settled
  const Problem& problem;          // of the body as it was before the events of this time
  Progress& progress;
  std::size_t turn = 0, turns = 1;  // of an event that happens again and again: which time of how many
};

struct Event {
  double at = 0;  // s, of the run
  std::string name, origin;
  double every = 0;             // s, between its times; 0: it happens once
  std::optional<double> until;  // s, the last of them; nothing: the end of the run
  std::size_t turn = 0, turns = 1;
  std::function<std::vector<std::string>()> prepare;
  std::function<std::string(EventContext&)> apply;
};

template <class E>
[[nodiscard]] Event make_event(E made, double at, std::string origin) {
  const auto event = std::make_shared<E>(std::move(made));
  Event result;
  result.at = at;
  result.name = E::name;
  result.origin = std::move(origin);
  result.apply = [event](EventContext& context) { return event->apply(context); };
  if constexpr (requires(E & e) { e.prepare(); }) result.prepare = [event] { return event->prepare(); };
  return result;
}

// Where an event acts: the keys "where", "positions" and "with".
struct EventRegion {
  std::optional<Selection> where;  // nothing: everything
  bool at_rest = false;            // shapes are looked for at rest instead of where matter is now
  // A part that `where`, boxes, spheres and half-spaces at its place at rest, moves with as a rigid body; the part itself is left out. "": none
  std::string with;
  std::string origin;
};
[[nodiscard]] EventRegion parse_region(TableReader& reader);
[[nodiscard]] std::string describe(const EventRegion& region);

// The elements of a region, and the cells: those that have more than half of their elements in it, and those
// under its surface. Throws InputError: nothing is selected; EmptySelectionError where boxes, spheres and half-spaces hold
// nothing.
struct Chosen {
  std::vector<std::uint8_t> elements;  // (elements)
  std::vector<std::uint8_t> cells;     // (cells)
};
[[nodiscard]] Chosen choose(const EventRegion& region, const Body& body, const State& state);

}  // namespace flexel::simulate
