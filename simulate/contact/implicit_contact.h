// Contact within an implicit step (simulate/implicit/implicit_euler.h), as a part of the potential whose least the
// step is.
//
// Along the normals that is the energy U of the pairs (simulate/contact/pairs/pair_law.h) at the end of the step, with
// the phases of its beginning; no softer than at rest, for Newton's method resolves an impact. Friction and
// damping have for each pair, with the motion s of j against i along the surface and q along the normal since
// the step began, the potential
//     H(r) / a + D(q),   r = r- + a s,   a = 1 + tau / dt
// r- the slip that the pair carries, H that of a spring of k_t which slides at mu N (Huber's function: k_t r^2 / 2
// below, mu N (|r| - mu N / 2 k_t) above it), D = tau k q^2 / 2 dt where that pulls by less than N, else linear.
// At rest this is the law of explicit steps (simulate/contact/contact_friction.h). N, k_t, the normal and where the
// pair meets are taken from a solution and held while Newton's method finds the next (lagged: Li et al. 2020,
// section 5.2), until they do not change any more. k is that of the beginning of the step, as the damping of cells
// is: a dashpot lets the pair press less, with that it would become softer, and the rounds would not end.
#pragma once
#include "simulate/contact/contact_friction.h"
#include "simulate/models/stiffness.h"

namespace flexel::simulate {

class ImplicitContact {
 public:
  // All outlive this. `damping`: tau [s].
  ImplicitContact(double damping, const ContactSurface& surface, const PairList& list,
                  const PairStates& states, const ContactFriction& friction, PairMemory& memory);

  // A step of `step` s begins at `before`, for which the pairs have been evaluated.
  void begin(const State& before, double step);
  // Whether friction and damping of the pairs as evaluated in `found` are those that are held, to a hundredth of
  // the contact forces. If not, they are held from now on.
  [[nodiscard]] bool take_up(const State& found);

  // Of friction and damping: J, the potential above; N; N/m.
  [[nodiscard]] double potential(const State& trial) const;
  void add_forces(const State& trial, std::vector<Vec3>& forces) const;
  void add_friction_stiffness(const State& trial, BlockMatrix& matrix) const;

  [[nodiscard]] const std::vector<Vec3>& before() const { return before_; }  // (elements) m

  // The step has led to `state`: what pairs carry on. Those of which nothing is left begin anew.
  void finish(const State& state);

  // Elements that pairs couple beyond a cell: each with each, ascending.
  [[nodiscard]] std::vector<CoupledElements> couples() const;

 private:
  // One side of a pair: how it moves, by the displacements of the elements that carry it.
  struct Side {
    std::uint32_t point = 0;  // number in PairList::points()
    bool moves = false;       // else a plane, or a part on a path where only forces are asked for
    std::array<double, 8> shares{};
  };
  struct Rubbing {
    std::uint32_t pair = 0;
    std::array<Side, 2> sides;                        // i, j
    Vec3 normal = Vec3::Zero(), slip = Vec3::Zero();  // m, r-
    double pressure = 0, most = 0;                    // N; mu N
    double stiffness = 0, dashpot = 0;                // N/m: k_t, tau k / dt
  };
  [[nodiscard]] Rubbing rubbing(std::uint32_t pair) const;
  [[nodiscard]] Side side(std::uint32_t point, const Vec3& away) const;
  [[nodiscard]] Vec3 moved(const Rubbing& pair, const State& trial) const;
  [[nodiscard]] Vec3 force(const Rubbing& pair, const Vec3& moved) const;
  [[nodiscard]] Mat3 stiffness(const Rubbing& pair, const Vec3& moved) const;
  [[nodiscard]] bool deforms(std::uint32_t point) const;

  double damping_;
  const ContactSurface& surface_;
  const PairList& list_;
  const PairStates& states_;
  const ContactFriction& friction_;
  PairMemory& memory_;
  double step_ = 0, growth_ = 1;  // s; a
  std::vector<double> dashpot_;   // (pairs) N/m, tau k / dt
  std::vector<Vec3> before_;      // (elements) m
  std::vector<Rubbing> rubbing_;  // ascending by pair
};

}  // namespace flexel::simulate
