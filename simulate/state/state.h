// What changes while a run goes on, and what stays: the state and the problem that effects are made in.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "formats/lattice/body.h"
#include "simulate/input/materials.h"

namespace flexel::simulate {

struct State {
  std::vector<Vec3> displacement;  // (elements x 3) m, from rest, world frame
  double share = 1;                // of every load and move that acts now, in [0, 1] (load stepping)
  // Timed runs only:
  std::vector<Vec3> velocity = {};  // (elements x 3) m/s, world frame; of the half step before `time`
  std::optional<double> time = {};  // s, since the run began
  double kick = 0;                  // s, for which the forces at this time act on the velocities
};

// How a part resists: cells, springs and quadratic at corner placement, paper at centre placement.
enum class Model { cells, springs, paper, quadratic };

// Where the Hooke constants of model `paper` come from: equation (22) or (21) of the paper, or those that make
// the lattice isotropic with the material's Young's modulus.
enum class HookeConstant { paper, ganovelli, isotropic };

// Whether a part is rigid: free to move as a whole, or led on a path (simulate/effects/rigid.h).
enum class Rigidity : std::uint8_t { none, free, led };

// What effects are made from. Refers to the body, which stays unchanged during a run.
struct Problem {
  const Body& body;
  std::vector<Material> materials;  // (parts)
  std::vector<std::uint8_t>
      stray_cell;  // (cells) 1: of a loose crumb that nothing holds; it is carried along, not simulated
  std::vector<Model> models = {};         // (parts); empty: cells
  std::vector<HookeConstant> hooke = {};  // (parts); empty: paper
  std::vector<std::uint8_t> stray_element =
      {};                               // (elements) 1: likewise, of a centre-placed part; empty: none
  std::optional<double> duration = {};  // s, of a timed run; nothing: equilibrium
  // (elements) m, displacement that fixes and moves start from (simulate/models/rest_shape.h); empty: none
  std::vector<Vec3> settled = {};
  std::vector<Rigidity> rigidity = {};  // (parts); empty: none is rigid
};

// The state of a body as a run finds it: displaced to its positions, with its column "velocity" where it has
// one, at time 0.
[[nodiscard]] State state_of(const Body& body);

}  // namespace flexel::simulate
