// resolution: the lattice of a part becomes finer or coarser by 2 x 2 x 2 (Jansson and Vergeest, sections
// 3.1 and 7.4), moved and moving as it is (simulate/events/lattice_resolution.h). Mass stays; momenta are
// seen to when supports are known again (simulate/time/carried_motion.h). docs/reference/events.md
#pragma once
#include "simulate/events/event.h"
#include "simulate/events/lattice_resolution.h"

namespace flexel::simulate {

class ResolutionEvent {
 public:
  static constexpr const char* name = "resolution";
  [[nodiscard]] static ResolutionEvent parse(TableReader& reader);
  // Throws InputError: what the body remembers has no place on another lattice; there is no such part; it
  // cannot be changed so.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  [[nodiscard]] std::vector<std::uint8_t> changed_parts(const Body& body) const;

  ResolutionChange to_ = ResolutionChange::finer;
  std::string part_;  // "": every part
  std::string origin_;
};

}  // namespace flexel::simulate
