// renormalise: the present shape becomes the rest shape, and stress ends (Jansson and Vergeest, section 4.1).
// The lattice stays; simulate/models/rest_shape.h has what is remembered instead. docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

class Renormalise {
 public:
  static constexpr const char* name = "renormalise";
  [[nodiscard]] static Renormalise parse(TableReader& reader);
  // Throws DivergedError: a cell in the region is turned inside out.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  EventRegion region_;
};

}  // namespace flexel::simulate
