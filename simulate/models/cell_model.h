// Model `cells`: what one cell resists with. A mean deformation gradient with the energy of the material's law
// (simulate/laws/elasticity.h), and hourglass connections for the deformations that the mean does not see. Free functions on one cell;
// simulate/models/cells.h puts them together over a body.
//
// Elements x_a = X_a + u_a at the corners a = i + 2 j + 4 k, signs s_aj = +-1 along axis j, spacing h_j,
// volume V = hx hy hz, f the fill. The gradient is taken with respect to the world frame at rest, so that a
// body at rest has F = I whatever its lattice's axes:
//     gamma_a = axes (s_ax / hx, s_ay / hy, s_az / hz)
//     H = 1/4 sum_a u_a (x) gamma_a,   F = I + H
//     U = f { V W(F) + 1/2 sum_m c_m |q_m|^2 },   q_m = 1/8 sum_a s_ma u_a,   m in {xy, yz, zx, xyz}
// q_m vanishes for every affine field, hence the patch test at any spacing; |q_m| does not see a rotation.
//
// Hourglass stiffness. In the natural coordinates xi, eta of a cell the field of mode xy is u = q xi eta. The
// energy of pure bending along x (no Poisson effect, no shear) is 1/2 V (4/3) (2 mu / hx^2) q_x^2, that of
// twisting 1/2 V (4/3) mu (1/hx^2 + 1/hy^2) q_z^2. A frame-free energy has one c for the three components of
// q; the mean of the three is that of the twist:
//     c_xy = (4/3) mu V (1/hx^2 + 1/hy^2), and likewise yz, zx
//     c_xyz = (8/9) mu V (1/hx^2 + 1/hy^2 + 1/hz^2)
// An orthotropic material has for 2 mu / hx^2 and mu / hx^2 its own moduli along the lattice's axes.
// Equal spacings give (8/3) mu h for all four. The hourglass part is 1/n^2 of the bending energy of a beam n
// cells thick: spacings 7 % apart change the energy of a beam of four cells by 0.5 %.
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
// and of q_m - F Q_m, hence gamma_a becomes G gamma_a, H becomes H G + (G - I), V becomes `volume` V.
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

// Of a whole cell with fill 1: energy [J], infinity where J <= 0; forces -dU/du_a [N]; need J > 0.
[[nodiscard]] double cell_energy(const CellKind& kind, const CellVectors& displacement);
[[nodiscard]] CellVectors cell_forces(const CellKind& kind, const CellVectors& displacement);

// Neo-Hooke: the part of d2U/du du that depends on the state, prepared once per cell. With w_a = F^-T gamma_a,
//     K_ab = V/16 { mu (gamma_a . gamma_b) I + (mu - lambda ln J) w_b w_a^T + lambda w_a w_b^T } + 1/64 sum_m
//     c_m s_ma s_mb I.
using CellTangent = neo_hooke::Tangent;
[[nodiscard]] CellTangent cell_tangent(const Mat3& gradient);
[[nodiscard]] Block tangent_block(const CellKind& kind, const CellTangent& tangent, std::size_t a,
                                  std::size_t b);

// d2W/dF dF, of any law at F = I + gradient, of neo-Hooke with what is prepared; a symmetric matrix with its
// negative eigenvalues set to 0; a block made with such moduli; all blocks at rest, row by row.
[[nodiscard]] Mat9 elasticity(const CellKind& kind, const Mat3& gradient);
[[nodiscard]] Mat9 elasticity(const CellKind& kind, const CellTangent& tangent);
[[nodiscard]] Mat9 positive_part(const Mat9& moduli);
[[nodiscard]] Mat9 projected_elasticity(const CellKind& kind, const CellTangent& tangent);
[[nodiscard]] std::array<Block, 64> blocks_at_rest(const CellKind& kind);
[[nodiscard]] Block projected_block(const CellKind& kind, const Mat9& elasticity, std::size_t a,
                                    std::size_t b);

}  // namespace flexel::simulate
