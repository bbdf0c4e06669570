// What two contact points do to each other.
//
// Points x_i, x_j with outward unit normals n_i, n_j as they are now, d = x_j - x_i, c = -n_i . n_j. Contact
// acts along n = b / |b|, b = a_i n_i - a_j n_j (a: 1 for a face, 0 for an edge or a ball; two balls: along
// d).
//     gap       g = d . n - R_i - R_j + p             (R the radius of a ball, p the allowed penetration)
//     offset    t = d - (d . n) n
//     energy    U = kappa A_i A_j K(t) w(c) psi(-g)
// K is a kernel of unit area, so that the double sum over the patches A of two faces in contact is kappa
// psi(-g) an area, whatever their lattices: K = 3 / (pi rho^2) (1 - t^2 / rho^2)^2. Gap and offset make
// patches meet as planes do, and, since n is the mean of both normals, second order in their size where the
// surfaces are curved: two points of one circle have d . (n_i + n_j) = 0. w lets only faces that look at each
// other meet. U depends on the elements through x and n; its whole derivative is taken, the normals' too, and
// so forces and moments on the two sides balance to rounding.
//
// psi' = p: soft over the first hundredth of a cell, linear, and hard where the sphere under the surface would
// be squeezed by half, delta = s - g with
//     p = delta^2 / (2 delta_0) below delta_0, delta - delta_0 / 2 above it;  + max(-g, 0)^3 / delta_h^2
// delta_0 is a hundredth of a cell, or the way of two steps at the speed of an impact (PairRecord::soft): steps
// that jump over the soft part would give energy or take it, by as much as (omega dt)^2 / 6 of that of the
// impact. s is half of what delta_0 exceeds that hundredth by: what follows the soft part stays where it was,
// and so does the mean force of an impact.
#pragma once
#include <algorithm>

#include "simulate/contact/points/contact_points.h"

namespace flexel::simulate {

struct NormalLaw {
  double soft = 0, hard = 0;  // m, delta_0 and delta_h
  double ahead = 0;           // m, s: pressure begins before the surfaces touch
  struct Value {
    double energy = 0, pressure = 0, stiffness = 0;  // psi [m^2], p [m], p' (the largest up to here)
  };
  // `depth` [m]: -g.
  [[nodiscard]] Value at(double depth) const {
    Value value{0, 0, 1};
    if (depth > 0) {
      const double hardening = depth * depth / (hard * hard);
      value = {0.25 * hardening * depth * depth, hardening * depth, 1 + 3 * hardening};
    }
    const double delta = depth + ahead;
    if (!(delta > 0)) return value;
    if (delta < soft) {
      const double share = delta / soft;
      value.energy += (1.0 / 6) * delta * delta * share;
      value.pressure += 0.5 * delta * share;
    } else {
      value.energy += 0.5 * delta * (delta - soft) + (1.0 / 6) * soft * soft;
      value.pressure += delta - 0.5 * soft;
    }
    return value;
  }
  // Of the linear range's slope, that of the soft part.
  [[nodiscard]] double share(double depth) const { return std::clamp((depth + ahead) / soft, 0.0, 1.0); }
  // With a soft part of `wider` [m], at least its own.
  [[nodiscard]] NormalLaw softened(double wider) const {
    return wider > soft ? NormalLaw{wider, hard, 0.5 * (wider - soft)} : *this;
  }
};

// A row of simulate/kernels/kernel_contact.h, as the next one.
struct PairConstants {
  double stiffness = 0;  // kappa A_i A_j [N m], or kappa A [N/m] where the kernel is 1
  double width = 0;      // rho [m]; 0: the kernel is 1
  double facing_from = 0, facing_fully = 0;
  double limit = 0;  // m, penetration beyond which the pair is no contact
  NormalLaw law;
};

struct alignas(64) PairState {
  Vec3 force = Vec3::Zero();                                // N, on j; minus it on i
  std::array<Vec3, 2> turning{Vec3::Zero(), Vec3::Zero()};  // dU/dn_i, dU/dn_j [J]
  Vec3 normal = Vec3::Zero();
  Vec3 offset = Vec3::Zero();  // t
  double gap = 0;              // m
  double weight = 0;           // kappa A_i A_j K w [N/m]
  double energy = 0;           // J
  double pressure = 0;         // N, magnitude of the force along the normal
  double stiffness = 0;        // N/m
  double share = 0;            // of the soft part: its slope in that of the linear range
  // Of the geometry: d . n [m]; |b|, 0 for balls; derivatives of the weight by half of t^2 [N/m^3],
  // its sign turned, and by c [N/m].
  double along = 0, length = 0, narrowing = 0, facing_slope = 0;
  bool near = false;  // within the kernel and facing; else the rest is not set
  bool deep = false;  // near, but deeper than the limit: of the rest only the gap holds
};

// `allowed` [m]: p, penetration without pressure (initial-penetration release); `soft` [m]: delta_0, where it is
// wider than the law's own.
[[nodiscard]] PairState pair_state(const ContactSide& i, const ContactSide& j, const PairConstants& pair,
                                   double allowed = 0, double soft = 0);

}  // namespace flexel::simulate
