// renormalise: the present shape becomes the rest shape, and stress ends (Jansson and Vergeest, section 4.1).
// The lattice stays; simulate/rest_shape.h has what is remembered instead. docs/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel {

class Renormalise {
 public:
  static constexpr const char* name = "renormalise";
  [[nodiscard]] static Renormalise parse(TableReader& reader);
  // Throws DivergedError: a cell in the region is turned inside out.
  [[nodiscard]] std::string happen(Stage& stage) const;

 private:
  EventRegion region_;
};

}  // namespace flexel
