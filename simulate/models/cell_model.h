// Model `cells`: what one cell resists with. A mean deformation gradient with the energy of the material's law
// (simulate/laws/elasticity.h), and hourglass connections for the deformations that the mean does not see. Free functions on one cell;
// simulate/models/cells.h puts them together over a body.
//
// Elements x_a = X_a + u_a at the corners a = i + 2 j + 4 k, signs s_aj = +-1 along axis j, spacing h_j,
// volume V = hx hy hz, f the fill. The gradient is taken with respect to the world frame at rest, so that a
// body at rest has F = I whatever its lattice's axes:
//     gamma_a = axes (s_ax / hx, s_ay / hy, s_az / hz)
//     H = 1/4 sum_a u_a (x) gamma_a,   F = I + H
//     U = f { V W(F) + U_h },   q_m = 1/8 sum_a s_ma u_a,   m in {xy, yz, zx, xyz}
// q_m vanishes for every affine field, hence the patch test at any spacing.
//
// Hourglass stiffness. In the natural coordinates xi, eta, zeta of a cell the field of mode xy is u = q xi eta.
// With the moduli at rest in the lattice's axes, shears G and Young's moduli by plane stress E'_k, E'_kl, the three
// fields have the strain energies of the trilinear cell with incompatible modes (Wilson et al. 1973):
//   twisting, q_xy,z, q_yz,x and q_zx,y together, which have shears alone, e.g. gamma_yz = 2 xi (q_xy,z / hy + q_zx,y / hz):
//       2/3 V {G_xy (q_yz,x / hy + q_zx,y / hx)^2 + G_yz (q_xy,z / hy + q_zx,y / hz)^2 + G_zx (q_xy,z / hx + q_yz,x / hz)^2}
//   bending, along each axis j the strains of its two neighbours k and l, those along j and the shears being free:
//       2/3 V {E'_k (q_jk,k / h_k)^2 + 2 E'_kl q_jk,k q_jl,l / (h_k h_l) + E'_l (q_jl,l / h_l)^2}
// so pure bending and pure twisting of cells have the energy of the matter. For cubes these are (4/3) mu h [2 1 1; 1 2 1; 1 1 2]
// and (4/3) h E / (1 - nu^2) [1 nu; nu 1]. The field xi eta zeta has c_xyz = (4/27) V sum_j 2 mu / h_j^2 for each component.
//
// Where the cell is deformed, q is drawn back into the lattice's axes by F^-1, which turns it with the cell, and the energy is that
// per volume now: so it does not change where a linear answer turns a cell by I + W, W skew, which stretches it across the axis
// of W as Newton's method does on its way. The share theta of c_m = (4/3) V (1/hx^2 + 1/hy^2), and likewise yz, zx, that
// the smallest eigenvalue allows (one half of mu for isotropic cubes) is taken of |q_m|^2 instead, as neo-Hooke's mu/2 F:F
// is, and no stretch softens it. So the energy is a sum of squares:
//     U_h = 1/2 sum_m c_m |q_m|^2 + J/2 p^T K p,   p_m = axes^T F^-1 q_m,   m in {xy, yz, zx} in p.
#pragma once
#include <array>

#include "formats/lattice/body.h"
#include "simulate/input/materials.h"
#include "simulate/laws/neo_hooke_scalar.h"
#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

// Constants of all cells of a part.
struct CellKind {
  std::array<Vec3, 8> gradient;       // gamma_a [1/m]; gradient[7 - a] = -gradient[a]
  double volume = 0;                  // m^3
  Law law;                            // in the frame of the gradients
  double mu = 0, lambda = 0;          // Pa, the law's
  std::array<double, 4> hourglass{};  // c_m [N/m]
  Mat9 by_mode = Mat9::Zero();        // K [N/m]: row 3 m + i for component i of mode m, xy, yz, zx
  double by_mode_largest = 0;         // N/m, its largest eigenvalue
  Mat3 to_lattice;                    // axes^T; with a rest shape of its own axes^T G
  // (8 x 8) neo-Hooke: the part of K_ab that is a multiple of I and does not depend on the state [N/m]
  std::array<double, 64> diagonal{};
  Mat3 offset = Mat3::Zero();  // of H: G - I; 0 at the lattice's shape
  // w_ma of the hourglass displacements sum_a w_ma u_a - Q_m [m] of a rest shape of its own; else s_ma / 8, 0
  std::array<std::array<double, 8>, 4> mode{};
  std::array<Vec3, 4> mode_offset{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
};

using CellVectors = std::array<Vec3, 8>;  // one vector per element of a cell

// Signs s_ma of the modes xy, yz, zx, xyz at corner a.
[[nodiscard]] constexpr double hourglass_sign(int mode, int corner) {
  const int x = (corner & 1) ? 1 : -1, y = (corner & 2) ? 1 : -1, z = (corner & 4) ? 1 : -1;
  return mode == 0 ? x * y : mode == 1 ? y * z : mode == 2 ? z * x : x * y * z;
}

// With gradients in the world frame; in the lattice's own.
[[nodiscard]] CellKind cell_kind(const Lattice& lattice, const Material& material);
[[nodiscard]] CellKind cell_kind_in_lattice(const Lattice& lattice, const Material& material);

// `kind` for a cell that is free of stress at another shape than the lattice's: where F^T F = Cp and q_m = F
// Q_m. With G = Cp^-1/2 the energy is `volume` (that of the rest shape over the voxel's) times that of F G
// and of q_m - F Q_m, hence gamma_a becomes G gamma_a, H becomes H G + (G - I), V becomes `volume` V, axes^T axes^T G.
// `change` is G - I, world frame; `hourglass` the Q_m [m].
[[nodiscard]] CellKind with_rest_shape(const CellKind& kind, const Mat3& change, double volume,
                                       const std::array<Vec3, 4>& hourglass);

// H of a cell whose elements moved by `displacement` [m]; F - I of F G where it has a rest shape of its own.
[[nodiscard]] Mat3 displacement_gradient(const CellKind& kind, const CellVectors& displacement);

// Gradient of the trilinear displacement at corner a, from the three edges that meet there.
[[nodiscard]] Mat3 corner_gradient(const CellKind& kind, const CellVectors& displacement,
                                   std::uint32_t corner);

// W [J/m^3], and P = dW/dF [Pa] (first Piola-Kirchhoff, world frame), without cancellation for small H. Need
// J > 0.
[[nodiscard]] double energy_density(const CellKind& kind, const Mat3& gradient);
[[nodiscard]] Mat3 stress(const CellKind& kind, const Mat3& gradient);

// Second Piola-Kirchhoff stress S = F^-1 P [Pa], and what the linear model at H predicts it to be at H +
// change: S + dS/dE : sym(F^T change), E the Green-Lagrange strain. Need J > 0.
[[nodiscard]] Mat3 second_stress(const CellKind& kind, const Mat3& gradient);
[[nodiscard]] Mat3 predicted_stress(const CellKind& kind, const Mat3& gradient, const Mat3& change);

// e_m = q_m - F Q_m [m].
[[nodiscard]] std::array<Vec3, 4> hourglass_displacements(const CellKind& kind,
                                                          const CellVectors& displacement);

// Of the energy by K, with e = hourglass_displacements(): arms F^-1 e_m [m], forces dU/de_m [N] of xy, yz, zx, energy [J];
// axes^T F^-1 (axes^T G (F G)^-1), F^-T. The force on element a is -sum_m v_ma force_m - energy F^-T
// gamma_a / 4.
struct HourglassForces {
  Mat3 pull, inverse_transpose;
  std::array<Vec3, 3> arm, force;
  double energy = 0;
};
// v_ma = w_ma - gamma_a . arm_m / 4: how much of element a's motion the mode m sees, as it is carried with the cell.
[[nodiscard]] inline double carried_mode(const CellKind& kind, const Vec3& arm, std::size_t mode,
                                         std::size_t element) {
  return kind.mode[mode][element] - 0.25 * kind.gradient[element].dot(arm);
}
[[nodiscard]] HourglassForces hourglass_forces(const CellKind& kind, const Mat3& gradient,
                                               const std::array<Vec3, 4>& hourglass);

// Of a whole cell with fill 1: energy [J], infinity where J <= 0; forces -dU/du_a [N]; need J > 0.
[[nodiscard]] double cell_energy(const CellKind& kind, const CellVectors& displacement);
[[nodiscard]] CellVectors cell_forces(const CellKind& kind, const CellVectors& displacement);

// Neo-Hooke: the part of d2U/du du that depends on the state, prepared once per cell, without that of K
// (simulate/models/prepared_cell.h). With w_a = F^-T gamma_a,
//     K_ab = V/16 { mu (gamma_a . gamma_b) I + (mu - lambda ln J) w_b w_a^T + lambda w_a w_b^T } + 1/64 sum_m
//     c_m s_ma s_mb I.
using CellTangent = neo_hooke::Tangent;
[[nodiscard]] CellTangent cell_tangent(const Mat3& gradient);
[[nodiscard]] Block tangent_block(const CellKind& kind, const CellTangent& tangent, std::size_t a,
                                  std::size_t b);

// d2W/dF dF, of any law at F = I + gradient, of neo-Hooke with what is prepared; a symmetric matrix with its
// negative eigenvalues set to 0; a block made with such moduli, without that of K.
[[nodiscard]] Mat9 elasticity(const CellKind& kind, const Mat3& gradient);
[[nodiscard]] Mat9 elasticity(const CellKind& kind, const CellTangent& tangent);
[[nodiscard]] Mat9 positive_part(const Mat9& moduli);
[[nodiscard]] Mat9 projected_elasticity(const CellKind& kind, const CellTangent& tangent);
[[nodiscard]] Block projected_block(const CellKind& kind, const Mat9& elasticity, std::size_t a,
                                    std::size_t b);

}  // namespace flexel::simulate
