// What a part keeps when its lattice changes in a run: momentum and angular momentum, while its energy
// nearly stays.
//
// Interpolation keeps neither exactly. A rigid velocity a + w x (x - c) of what no support leads, with the
// least a and w, gives back what they lack; along axes where supports hold the part so that no such motion
// is left, they take it.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// About the origin; velocities of the time of the places.
struct PartMomenta {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  // kg m/s, kg m^2/s
};

class CarriedMotion {
 public:
  // Before the change; `stored` J, in contacts.
  CarriedMotion(const Problem& problem, const State& state, double stored);

  [[nodiscard]] double energy() const { return internal_ + kinetic_; }  // J, before the change

  // Afterwards, of the same parts: adds the rigid velocities to `state`. `held` (elements): bits of the
  // axes along which supports lead them; empty: none.
  void give_back(const Problem& problem, const std::vector<std::uint8_t>& held, State& state) const;
  // Then: the change of the energy in words, of what is elastic or `stored` in contacts, and of the motion of
  // matter against its mean; "" where there is none of it. Warns where it is more than `borne`, a share;
  // `origin`: of the event. Throws DivergedError: a cell is folded.
  [[nodiscard]] std::string change_of_energy(const Problem& problem, const State& state, double stored,
                                             double borne, const std::string& origin,
                                             Progress& progress) const;
  // Warns of a part that spins otherwise, as its moment of inertia is another one on the new lattice. `held_parts`: 1: supports
  // hold some of it, which give and take angular momentum anyway.
  void warn_of_spin(const Problem& problem, const State& state, const std::vector<std::uint8_t>& held_parts,
                    const std::string& origin, Progress& progress) const;

 private:
  std::vector<PartMomenta> momenta_;   // (parts)
  std::vector<double> spin_;           // (parts) J, of their turning as rigid bodies
  double internal_ = 0, kinetic_ = 0;  // J
};

}  // namespace flexel::simulate
