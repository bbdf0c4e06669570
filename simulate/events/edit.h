// edit: what cells and elements are made of changes, by factors on stiffness (and with it damping, strength
// and yield stress), on the time of the damping and on mass, and by a traction more or less that their
// surface sticks with. Velocities stay. docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

class Edit {
 public:
  static constexpr const char* name = "edit";
  [[nodiscard]] static Edit parse(TableReader& reader);
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  EventRegion region_;
  double stiffness_ = 1, damping_ = 1, density_ = 1;  // factors
  double stick_ = 0;                                  // Pa, more
};

}  // namespace flexel::simulate
