// What keeps the corners of a cell of model `cells` from folding through each other: its mean gradient does
// not see them, and its hourglass connections know no limit, so they do not stop them.
//
// J_c is the Jacobian of the trilinear map at corner c, det F_c of the three edges that meet there. Where it
// falls below a tenth (of that of the rest shape, where the cell has one that is smaller), T, the corner has
// the energy
//     U_c = 4 mu V / 8 b(J_c / T),   b(r) = -(1 - r)^2 ln r,  0 for r >= 1,
// the barrier of Li et al. 2020 (Incremental Potential Contact, eq. 6) of a volume in place of a distance:
// twice continuously differentiable, so the force begins smoothly, and nothing above T. Below r = 1/16 b goes
// on as its own quadratic, so that a body that begins folded is pushed back and not refused.
#pragma once
#include <array>
#include <optional>

#include "simulate/models/cell_model.h"

namespace flexel::simulate {

constexpr double kFoldThreshold = 0.1;  // of J_c

using CornerThresholds = std::array<double, 8>;  // T of the corners; 0: no barrier

// Those of a cell of the lattice; with `shaped`, its kind with a rest shape of its own (with_rest_shape).
[[nodiscard]] CornerThresholds fold_thresholds(const CellKind& kind, const std::optional<CellKind>& shaped);

// (8) J_c, to rounding.
using CornerVolumes = std::array<double, 8>;
[[nodiscard]] CornerVolumes corner_volumes(const CellKind& kind, const CellVectors& displacement);

// No corner has J_c < 0.2, as the lengths of the edges alone tell: |F_c - I| is below 0.41 everywhere. False
// says nothing. With `more`: nor will it, however the elements go on by `factor` times those.
[[nodiscard]] bool far_from_folding(const CellKind& kind, const CellVectors& displacement,
                                    const CellVectors* more = nullptr, double factor = 0);

// The smallest J_c / T of the corners that have a T; infinity where none has.
[[nodiscard]] double nearest_to_folding(const CellKind& kind, const CornerThresholds& thresholds,
                                        const CellVectors& displacement);

// Of a whole cell with fill 1; `kind` is that of the lattice. J; adds N.
[[nodiscard]] double fold_energy(const CellKind& kind, const CornerThresholds& thresholds,
                                 const CellVectors& displacement);
void add_fold_forces(const CellKind& kind, const CornerThresholds& thresholds,
                     const CellVectors& displacement, CellVectors& forces);

// d2U/du_a du_b [N/m] of all (a, b), row by row; nothing where it is zero. `project`: positive semi-definite,
// without what the turning of the corners' cofactors adds.
using FoldTangent = std::array<Block, 64>;
[[nodiscard]] std::optional<FoldTangent> fold_tangent(const CellKind& kind,
                                                      const CornerThresholds& thresholds,
                                                      const CellVectors& displacement, bool project);

// At least the largest eigenvalue of that tangent, over the largest of the cell's own at rest.
[[nodiscard]] double fold_stiffening(const CellKind& kind, const CornerThresholds& thresholds,
                                     const CellVectors& displacement);

}  // namespace flexel::simulate
