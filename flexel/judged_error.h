// The error of a run beside coarser ones (accuracy.h has the formulas).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "flexel/accuracy.h"
#include "simulate/estimate.h"

namespace flexel {

struct Quantity {
  std::string name;
  double value = 0;
  std::optional<Bar> bar;
};

// What is asked of every run.
class Quantities {
 public:
  explicit Quantities(bool driven) : driven_(driven) {}

  // The probes; where none moves, of every run the displacement at the vertex that moves most in the last
  // one, along that.
  [[nodiscard]] std::vector<Quantity> of(const SolvedRun& run, const SolvedRun& last) const;

 private:
  bool driven_;
};

struct Judged {
  double error = 0;  // share
  double order = 1;  // p: how the error falls with the spacing
  std::string of;    // the quantity that is worst
};

// m, geometric mean over parts and axes.
[[nodiscard]] double spacing_of(const SolvedRun& run);

// The error of the last of the runs, from it and the one or two before it; nothing where it is the only one,
// or no finer than the one before.
[[nodiscard]] std::optional<Judged> judge(const std::vector<SolvedRun>& runs, const Quantities& quantities);

}  // namespace flexel
