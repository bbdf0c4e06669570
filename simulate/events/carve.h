// carve: matter inside a region is taken away, cells and the elements that no other cell holds.
// docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

class Carve {
 public:
  static constexpr const char* name = "carve";
  [[nodiscard]] static Carve parse(TableReader& reader);
  // Throws InputError: nothing of a part is left.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  EventRegion region_;
  std::string origin_;
};

}  // namespace flexel::simulate
