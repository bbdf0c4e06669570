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
  // Of the part of that number, and why it changes (simulate/events/adaptive_resolution.h).
  ResolutionEvent(ResolutionChange to, std::uint32_t part, std::string why, std::string origin)
      : to_(to), number_(part), why_(std::move(why)), origin_(std::move(origin)) {}
  // Throws InputError: what the body remembers has no place on another lattice; there is no such part; it
  // cannot be changed so.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  ResolutionEvent() = default;
  [[nodiscard]] std::vector<std::uint8_t> changed_parts(const Body& body) const;

  ResolutionChange to_ = ResolutionChange::finer;
  std::string part_;  // "": every part, or
  std::optional<std::uint32_t> number_;
  std::string why_;  // "": the scene says so
  std::string origin_;
};

}  // namespace flexel::simulate
