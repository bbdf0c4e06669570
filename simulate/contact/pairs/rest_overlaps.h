// Overlaps at rest of curved surfaces that fit each other, such as a pin and its hole: patches show such a surface as
// facets, which lie in and out of those of the other by some hundredths of a spacing and are not to press for that.
//
// By how much two such surfaces overlap as a whole, a press fit's interference, is the mean over the pairs around a
// point, each weighted as contact weights it, where it exceeds what they scatter by. That presses in full; only what
// a pair overlaps by beyond it is the facets'.
#pragma once
#include "simulate/contact/pairs/contact_materials.h"
#include "simulate/contact/pairs/excluded_pairs.h"

namespace flexel::simulate {

class RestOverlaps {
 public:
  // `surface` outlives this.
  RestOverlaps(const ContactSettings& settings, const ContactSurface& surface,
               const ContactMaterials& materials, const ExcludedPairs& excluded);

  // m, penetration at rest that presses nothing, of points of two parts. Beyond `hard` such a pair exerts no force
  // (PairPhase::penetrated).
  [[nodiscard]] double of(std::uint32_t i, std::uint32_t j, const PairConstants& constants) const;

 private:
  [[nodiscard]] ContactSide at_rest(std::uint32_t point) const;
  [[nodiscard]] double most(std::uint32_t i, std::uint32_t j, const PairState& rest,
                            const PairConstants& constants) const;
  void find_fits(const ContactMaterials& materials, const ExcludedPairs& excluded);
  void spread_to_rims(const std::vector<Vec3>& at, const std::vector<std::uint8_t>& is_paired);

  const ContactSurface& surface_;
  bool released_ = false;             // what overlaps is let out: only surfaces that fit keep an overlap
  std::vector<std::uint8_t> curved_;  // (surface points) 1: a face of a curved surface; empty: none is asked
  std::vector<double>
      interference_;  // (surface points) m, of surfaces that fit each other there; nan: they do not
};

}  // namespace flexel::simulate
