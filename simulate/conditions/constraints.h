// Elements that follow a given path exactly, axis by axis; they are eliminated from the unknowns.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/conditions/motion.h"
#include "simulate/conditions/time_curve.h"
#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

struct Constraints {
  std::vector<std::uint8_t> mask;                    // (elements) bit i: axis i is prescribed
  std::vector<std::array<std::uint32_t, 3>> motion;  // (elements x 3) index into motions, where prescribed
  std::vector<Motion> motions;
  std::vector<TimeCurve> courses = {};  // (motions) how each goes on in a timed run
  std::vector<Vec3> start = {};         // (elements) m, displacement where every path starts; empty: 0

  // m, along an axis that is prescribed, when `share` of the motion is done
  [[nodiscard]] double path(const Body& body, std::uint32_t element, int axis, double share) const {
    const Motion& way = motions[motion[element][static_cast<std::size_t>(axis)]];
    if (start.empty() || way.from_rest) return way.displacement(body.rest[element], share)[axis];
    return start[element][axis] + way.displacement(body.rest[element] + start[element], share)[axis];
  }
};

// Displacement [m] that the prescribed axes have at `state`'s load share, or in a timed run at its time; the
// others keep `displacement`, which may be that of `state`.
void apply(const Constraints& constraints, const Body& body, const State& state,
           std::vector<Vec3>& displacement);

// Components of `elements` that are not prescribed.
[[nodiscard]] std::size_t count_unknowns(const Constraints& constraints, std::size_t elements);

// 0 in every prescribed component.
void clear_prescribed(const Constraints& constraints, std::vector<Vec3>& values);

// Rows and columns of prescribed components become 0 but for the diagonal entry, which stays (1 where it was
// 0).
void eliminate(const Constraints& constraints, BlockMatrix& matrix);

}  // namespace flexel::simulate
