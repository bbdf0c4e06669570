// Error bars: how far a result at equilibrium may be off because its cells are not small
// (docs/theory/error-bars.md).
//
// The same scene is solved on the body coarsened once and twice (simulate/estimate/coarsen.h). Where the three values
// of a quantity approach a limit, Richardson's extrapolation with the observed order gives the limit, and the
// bar is 1.25 times its distance (the grid convergence index: Roache 1994; Celik et al. 2008 for the order at
// unequal ratios). Where they do not, or walls are too thin, the bar is three times the larger difference.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace flexel::simulate {

// One quantity on three lattices, the finest first.
struct Sequence {
  std::array<double, 3> value{};
  std::array<double, 2> ratio{};  // of the spacings, between neighbouring lattices, above 1
};

struct Bar {
  double half_width = 0;  // the true value is expected within value +- half_width
  double extrapolated = 0;
  std::optional<double> order;  // observed; nothing where the values do not approach a limit
};

// Where the order is under 1/2 the bar is wide_bar(). Above 2, the models' own, it is taken as 2; above 2.1
// the bar is 3 times the distance, and at least what the coarser difference becomes at order 2.
[[nodiscard]] Bar richardson(const Sequence& sequence);

// Three times the larger difference; what is extrapolated is the finest value.
[[nodiscard]] Bar wide_bar(const Sequence& sequence);

// Of the largest stress: nothing unless the values close in on a limit with an order of at least 1/2, or
// hardly differ. Three times Richardson's distance, and at least the finer difference. `singular`: beside a
// re-entrant edge or a support there is no limit, whatever three values seem to close in on; it has to hardly
// differ.
[[nodiscard]] std::optional<Bar> stress_bar(const Sequence& sequence, bool singular = false);

// Of the largest stress in model `quadratic`: the largest of the finer difference (2.25 times it, where values grow by more each time), a quarter of
// the coarser one (what order 2 leaves of it) and 1.5 times `doubt` [Pa], by which the field of one cell is off from that of the cells around.
// Where the finer ratio r is under 2 the finer difference counts 1 / (r - 1) times (order 1). With two lattices three times the difference. Nothing at a `singular` place, but where values hardly differ.
[[nodiscard]] std::optional<Bar> field_stress_bar(const Sequence& sequence, std::size_t lattices,
                                                  double doubt, bool singular);

struct ErrorBar {
  enum class Of { probe, largest_displacement, elastic_energy };
  Of of = Of::probe;
  std::size_t probe = 0;  // which one
  std::string probe_name;
  double value = 0;  // m, along the displacement on the finest lattice; J
  Bar bar;
  // "probe tip", "largest_displacement", "elastic_energy"
  [[nodiscard]] std::string name() const {
    return of == Of::probe                  ? "probe " + probe_name
           : of == Of::largest_displacement ? "largest_displacement"
                                            : "elastic_energy";
  }
};

// The largest von Mises stress of each lattice.
struct StressBar {
  std::array<double, 3> value{};  // Pa, the finest first; of two lattices the second twice
  std::optional<Bar> bar;         // nothing where they do not converge
};

struct ErrorBars {
  std::vector<ErrorBar> bars;
  std::optional<StressBar>
      von_mises;     // nothing without three lattices (`quadratic`: two), with thin walls, without stresses
  std::string note;  // why there are none, or why they are wide; "" else
  double refinement = 2;  // how many times as fine a lattice needs to be for bars, where there are none
  std::vector<std::size_t> cells;  // of each lattice, the finest first
  double seconds = 0;
};

}  // namespace flexel::simulate
