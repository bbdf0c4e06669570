// Stiffness, friction and adhesion of a pair of contact points, from the settings and materials of their parts.
#pragma once
#include "simulate/contact/pairs/pair_law.h"
#include "simulate/contact/pairs/settings.h"
#include "simulate/contact/points/contact_surface.h"

namespace flexel::simulate {

struct PairProperties {
  PairConstants constants;
  double friction = 0;  // mu
  double pull_off = 0;  // m, extension at which adhesion ends; 0: the pair does not stick
  double farthest_soft =
      0;  // m, at most, of PairRecord::soft that an approach makes: two steps of contact_step_bound.cpp
};

class ContactMaterials {
 public:
  // `settings` and `surface` outlive this.
  ContactMaterials(const ContactSettings& settings, const Problem& problem, const ContactSurface& surface);

  [[nodiscard]] PairProperties between(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] PairProperties against_plane(std::uint32_t point, const ContactPlane& plane) const;
  // Whether any pair may have friction, damping or adhesion.
  [[nodiscard]] bool dissipate() const;

 private:
  [[nodiscard]] double foundation(std::uint32_t point) const;
  [[nodiscard]] double foundation(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] double stick(std::uint32_t point) const;
  [[nodiscard]] double friction(std::uint32_t point) const;
  [[nodiscard]] double pull_off(std::uint32_t i, double stick, double foundation) const;
  [[nodiscard]] PairConstants constants(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] PairConstants plane_constants(std::uint32_t i) const;

  const ContactSettings& settings_;
  const ContactSurface& surface_;
  std::vector<double> foundation_;   // (parts) kappa, Pa/m
  std::vector<double> friction_;     // (parts) mu
  std::vector<double> stick_;        // (parts) Pa; infinity: glue
  std::vector<std::uint8_t> rigid_;  // (parts)
  std::vector<double> slides_;       // (elements) factors of friction; empty: 1
  ChangeAround stiffer_;             // by edits
};

}  // namespace flexel::simulate
