// Overlaps at rest of curved surfaces that fit each other, such as a pin and its hole: patches show such a surface as
// facets, which lie in and out of those of the other by some hundredths of a spacing and are not to press for that.
//
// How two such surfaces overlap as a whole is fitted to the pairs around a point by least squares, each weighted as contact
// weights it: c + a . n along the normal n of a pair, a press fit's interference c and the offset a of a pin that is not in
// the middle of its hole. Where that exceeds what the pairs scatter by, it presses in full; only what a pair overlaps by
// beyond it is the facets'.
#pragma once
#include <array>
#include <vector>

#include "simulate/contact/pairs/contact_materials.h"
#include "simulate/contact/pairs/excluded_pairs.h"

namespace flexel::simulate {

// Of the pairs around a point.
struct RestFit {
  bool is_one = false;         // the surfaces fit each other there
  double depth = 0;            // m, c
  Vec3 offset = Vec3::Zero();  // m, a
  // m, penetration along a pair's normal, which is out of the point that comes first
  [[nodiscard]] double along(const Vec3& normal) const { return depth + offset.dot(normal); }
};

// Two parts whose surfaces fit each other nearly: what they overlap by is too little to be told from their facets.
struct UnsureFit {
  std::array<std::uint32_t, 2> parts{};  // ascending
  double misfit = 0, width = 0;          // m: root mean square of c + a . n where that is so; spacing
};

class RestOverlaps {
 public:
  // `surface` outlives this.
  RestOverlaps(const ContactSettings& settings, const ContactSurface& surface,
               const ContactMaterials& materials, const ExcludedPairs& excluded);

  // m, penetration at rest that presses nothing, of points of two parts. Beyond `hard` such a pair exerts no force
  // (PairPhase::penetrated).
  [[nodiscard]] double of(std::uint32_t i, std::uint32_t j, const PairConstants& constants) const;
  // By parts: such a fit may press with half of its force, with twice that or not at all.
  [[nodiscard]] const std::vector<UnsureFit>& unsure() const { return unsure_; }

 private:
  [[nodiscard]] ContactSide at_rest(std::uint32_t point) const;
  [[nodiscard]] double most(std::uint32_t i, std::uint32_t j, const PairState& rest,
                            const PairConstants& constants) const;
  void find_fits(const ContactMaterials& materials, const ExcludedPairs& excluded);
  void spread_to_rims(const std::vector<Vec3>& at, const std::vector<std::uint8_t>& is_paired);

  const ContactSurface& surface_;
  bool released_ = false;             // what overlaps is let out: only surfaces that fit keep an overlap
  std::vector<std::uint8_t> curved_;  // (surface points) 1: a face of a curved surface; empty: none is asked
  std::vector<RestFit> fits_;         // (surface points)
  std::vector<UnsureFit> unsure_;
};

}  // namespace flexel::simulate
