// edit: what cells and elements are made of changes (Jansson and Vergeest, sections 3.2 and 6.1.1: k, b, m, t, mu, r),
// by factors on stiffness (and with it damping, strength and yield stress), on the time of the damping, mass, strength,
// yield stress, friction and the radius of elements of model `paper`, and by a traction more or less that their surface
// sticks with. Or what connections of model `paper` are made of: k, b, t, mu and l, by factors. Velocities stay.
// docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

// Takes away what repeated edits remember between their turns, columns "edited_N", where a run ends before the last.
void forget_edits(Body& body);

class Edit {
 public:
  static constexpr const char* name = "edit";
  [[nodiscard]] static Edit parse(TableReader& reader);
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  enum class Of { elements, connections_inside, connections_across };
  [[nodiscard]] bool changes_elements_only() const;
  [[nodiscard]] std::string edit_connections(EventContext& context, const Chosen& chosen) const;

  EventRegion region_;
  Of of_ = Of::elements;
  double stiffness_ = 1, damping_ = 1, density_ = 1, strength_ = 1, yield_ = 1, friction_ = 1, radius_ = 1,
         length_ = 1;  // factors
  std::string origin_;
  double stick_ = 0;  // Pa, more
};

}  // namespace flexel::simulate
