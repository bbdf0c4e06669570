// Events that happen again and again, as what a tool does while it moves.
#pragma once
#include <map>
#include <string>

#include "simulate/events/event.h"

namespace flexel::simulate {

class RepeatedEvents {
 public:
  // What the event did, in words. One of several times may find nothing where it looks; it is told once, at its last time: how often
  // it found something, and a warning where it never did. "" before. Throws what the event throws.
  [[nodiscard]] std::string apply(const Event& event, EventContext& context);

 private:
  struct Turns {
    std::size_t happened = 0, found = 0;  // in this run, which may have begun at a checkpoint
    std::string last, nothing;            // what it did last, and why it did nothing
  };
  std::map<std::string, Turns> turns_;  // by origin
};

}  // namespace flexel::simulate
