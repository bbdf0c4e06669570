// One explicit step of a body: forces of the cells by model and damping, then velocities and displacements.
#pragma once
#include <vector>

#include "simulate/time/layout.h"

namespace flexel {

struct StepOutcome {
  double smallest_jacobian = 1;  // over the cells, before the step; -infinity: not a number
  std::uint32_t part = 0;        // of that cell
};

class Stepper {
 public:
  // `damping`: tau of each part [s]; `book`: account for its power. `isa`: "", "portable", "avx2" or
  // "avx512";
  // "" for the best of this machine. Throws InputError: an instruction set that this machine lacks.
  Stepper(const Setting& setting, const std::vector<double>& damping, bool book, const std::string& isa = "");

  // v += kick f / m, u += drift v (simulate/time/kernel.h), f = forces of the cells + outer. `outer`
  // (elements) [N] may be empty.
  StepOutcome advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance);

  [[nodiscard]] const std::vector<double>& mass() const { return mass_; }                  // (elements) kg
  [[nodiscard]] const std::vector<double>& inverse_mass() const { return inverse_mass_; }  // (elements) 1/kg
  // Of the internal damping in the last advance [N] (elements); empty without a book or without damping.
  [[nodiscard]] const std::vector<Vec3>& damping_force() const { return damping_force_; }
  [[nodiscard]] const char* isa() const { return table_->isa; }
  [[nodiscard]] const StepLayout& layout() const { return layout_; }
  [[nodiscard]] std::size_t bytes() const;

 private:
  void advance_shared(const step::StateView& view, const step::Advance& advance);
  void advance_lone(const step::StateView& view, const step::Advance& advance);

  StepLayout layout_;
  const step::KernelTable* table_;
  std::vector<step::ChunkKernel> kernel_;  // (parts)
  std::vector<double> mass_, inverse_mass_;
  std::vector<double> shared_force_, shared_damping_;  // (slots x 3) N
  std::vector<Vec3> damping_force_;
  bool book_;
};

// The kernels of that name on this machine; "" for the best. Throws InputError.
[[nodiscard]] const step::KernelTable& kernel_table(const std::string& isa);

}  // namespace flexel
