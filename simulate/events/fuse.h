// fuse: matter that touches becomes one. Parts are held together point by point where they are nearer than a
// distance; broken cells that are nearly whole again resist again. docs/reference/events.md
#pragma once
#include "simulate/events/event.h"

namespace flexel::simulate {

class Fuse {
 public:
  static constexpr const char* name = "fuse";
  [[nodiscard]] static Fuse parse(TableReader& reader);
  // Throws InputError: nothing in the region is near enough to anything.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  EventRegion region_;
  double within_ = 0;  // m
  std::string origin_;
};

}  // namespace flexel::simulate
