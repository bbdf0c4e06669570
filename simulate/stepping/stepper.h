// One explicit step of a body: forces of the cells by model and damping, then velocities and displacements.
#pragma once
#include <optional>
#include <vector>

#include "simulate/conditions/kernel_effects.h"
#include "simulate/kernels/chunk_layout.h"

namespace flexel::simulate {

struct StepOutcome {
  double smallest_jacobian = 1;  // over the cells, before the step; -infinity: not a number
  std::uint32_t part = 0;        // of that cell
  // With a book, and plasticity or fracture: elastic energy of the cells [J] as the step's forces took it,
  // and what was dissipated in this step [J].
  std::optional<double> elastic = {};
  double plastic_work = 0, released = 0;
  std::uint64_t broken = 0;  // cells that broke in it
};

class Stepper {
 public:
  // `book`: account for energies. `isa`: "", "portable", "avx2" or "avx512"; "" for the best of this
  // machine. Throws InputError: an instruction set that this machine lacks.
  Stepper(const Problem& problem, const KernelEffects& plan, bool book, const std::string& isa = "");

  // v += kick f / m, u += drift v (simulate/kernels/kernel.h), f = forces of the cells + outer. `outer`
  // (elements) [N] may be empty.
  StepOutcome advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance);

  // What the cells remember: which are broken, what has flowed. Empty without fracture and plasticity.
  struct Memory {
    std::vector<std::array<double, step::kLanes>> fill;  // (blocks)
    std::vector<step::PlasticBlock> plastic;             // (blocks)
    std::vector<step::SpringBlock> springs;              // (blocks)
    std::vector<step::SpringFlow> spring_flow;           // (blocks)
  };
  [[nodiscard]] Memory memory() const;
  void restore(const Memory& memory);
  // Elastic energy [J] at `state`; nothing without plasticity and fracture, which alone make it other than
  // Cells::energy.
  [[nodiscard]] std::optional<double> elastic_energy(const State& state);
  // Sets broken[c] (cells) of those that broke. True: one did.
  bool mark_broken(std::vector<std::uint8_t>& broken) const;
  // The memory as columns of the body's cells (simulate/models/rest_shape.h), and from there.
  void write_memory(std::size_t cells, Columns& columns) const;
  void read_memory(const Columns& columns);
  // (cells) equivalent plastic strain; empty without plasticity of cells.
  [[nodiscard]] std::vector<double> plastic_strain(std::size_t cells) const;

  // What each effect in the hot loop takes of its time, 0 to 1: the loop of the step from `state` with it,
  // and without it and those after it, the quickest of a few. Effects of model `springs` that its loop over
  // connections lacks count as the model's own.
  [[nodiscard]] KernelShares time_shares(const State& state);

  // (elements) kg; a step needs its inverse only, so where nothing else asks for it it can go.
  [[nodiscard]] const std::vector<double>& mass() const { return mass_; }
  void drop_mass() { std::vector<double>().swap(mass_); }
  [[nodiscard]] const std::vector<double>& inverse_mass() const { return inverse_mass_; }  // (elements) 1/kg
  // Of the internal damping in the last advance [N] (elements); empty without a book or without damping.
  [[nodiscard]] const std::vector<Vec3>& damping_force() const { return damping_force_; }
  [[nodiscard]] const char* isa() const { return table_->isa; }
  [[nodiscard]] const StepLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void make_room_for_books();
  void choose_kernels(const Problem& problem, const KernelEffects& plan);
  void advance_shared(const step::StateView& view, const step::Advance& advance);
  void advance_lone(const step::StateView& view, const step::Advance& advance);

  StepLayout layout_;
  const step::KernelTable* table_;
  std::vector<step::ChunkKernel> kernel_, booking_;  // (kinds)
  std::vector<step::Composition> composition_;       // (kinds) of kernel_
  std::vector<step::PlasticBlock> plastic_;          // (blocks); empty without plasticity
  std::vector<step::SpringBlock> springs_;           // (blocks); empty without fracture of springs
  std::vector<step::SpringFlow> spring_flow_;        // (blocks); empty without plasticity of springs
  bool fractures_ = false, inelastic_ = false;
  std::vector<double> mass_, inverse_mass_;
  std::vector<double> shared_force_, shared_damping_;  // (slots x 3) N
  std::vector<Vec3> damping_force_;
  bool book_;
};

// The kernels of that name on this machine; "" for the best. Throws InputError.
[[nodiscard]] const step::KernelTable& kernel_table(const std::string& isa);

}  // namespace flexel::simulate
