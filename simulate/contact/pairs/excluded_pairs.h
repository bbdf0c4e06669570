// Pairs of near points between which contact is excluded, because matter or a bond already joins them: points
// of one part on the same side of it, or facing each other through less than three cells; points of bonded
// parts that are near at rest.
#pragma once
#include "simulate/contact/pairs/settings.h"
#include "simulate/contact/points/broad_phase.h"
#include "simulate/contact/points/contact_surface.h"

namespace flexel::simulate {

class ExcludedPairs {
 public:
  // `settings` and `surface` outlive this.
  ExcludedPairs(const ContactSettings& settings, const Problem& problem, const ContactSurface& surface);

  // Of one part: only where the settings let parts touch themselves.
  [[nodiscard]] bool contains(std::uint32_t i, std::uint32_t j) const;

 private:
  void find_joined(const Problem& problem);
  [[nodiscard]] bool joined(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] bool bonded(std::uint32_t i, std::uint32_t j) const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  Neighbours joined_;  // points of one part that face each other at rest through less than three cells
};

}  // namespace flexel::simulate
