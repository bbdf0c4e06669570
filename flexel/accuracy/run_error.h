// The error of a run, estimated from coarser runs (resolution_search.h has the formulas).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "flexel/accuracy/accuracy_report.h"
#include "flexel/accuracy/solved_run.h"
#include "simulate/result/estimate.h"

namespace flexel::commands {

struct Quantity {
  std::string name;
  double value = 0;
  std::optional<simulate::Bar> bar;
  simulate::ErrorBar::Of kind = simulate::ErrorBar::Of::largest_displacement;
  std::size_t probe = 0;
};

// The quantities that runs are compared by.
class Quantities {
 public:
  explicit Quantities(bool driven) : driven_(driven) {}

  // The probes' displacements; where no probe moves, that of the point of the surface that moves most in
  // `last`, along its direction there.
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

// Whether its cells are no wider than most walls.
[[nodiscard]] bool resolves_walls(const SolvedRun& run);

// The error of the last of the runs, the worst of its quantities: from its own error bars, and from the one
// or two runs before it where they are coarser and resolve the walls. Nothing where there are neither. `runs`
// is not empty.
[[nodiscard]] std::optional<Judged> judge(const std::vector<SolvedRun>& runs, const Quantities& quantities);

// Widens the error bars of the last run to what judge() says of each quantity, so that no two figures of one
// run contradict each other.
void widen_bars(std::vector<SolvedRun>& runs, const Quantities& quantities);

}  // namespace flexel::commands
