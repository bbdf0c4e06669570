// The cell with the least volume, and the words for it.
#include "simulate/stepping/failure_messages.h"

#include <fmt/format.h>

#include "base/units.h"
#include "simulate/models/cells.h"
#include "simulate/models/paper_model.h"

namespace flexel::simulate {

namespace {

std::string place(const Vec3& at) {
  return fmt::format("({}, {}, {})", human_length(at.x()), human_length(at.y()), human_length(at.z()));
}

constexpr const char* kGainsEnergy =
    "method = \"explicit\" gains energy by itself: leave it out, or damp it ([damping])";

SmallestJacobian smallest(const Problem& problem, const State& state) {
  const Stencil none;
  return Cells(problem, none).smallest_jacobian(state);
}

Vec3 rest_of(const Problem& problem, std::uint32_t cell) {
  return problem.body.rest[problem.body.cell_elements[cell][0]];
}

}  // namespace

std::string folds_at(const char* what, const Vec3& at, TimeMethod method) {
  return fmt::format(
      "{} near {} turned inside out: {}", what, place(at),
      method == TimeMethod::explicit_euler
          ? kGainsEnergy
          : "load it more slowly, damp it ([damping]), or use a shorter [run] step or a smaller "
            "spacing");
}

std::string runs_away_at(const Vec3& at, TimeMethod method) {
  return fmt::format("the motion ran away, farthest near {}: {}", place(at),
                     method == TimeMethod::explicit_euler
                         ? kGainsEnergy
                         : "look at loads and units, or give a shorter [run] step");
}

std::string fastest_near(const Body& body, const State& state) {
  std::size_t fastest = 0;
  for (std::size_t e = 0; e < state.velocity.size(); ++e)
    if (!(state.velocity[e].squaredNorm() <= state.velocity[fastest].squaredNorm())) fastest = e;
  return place(body.rest[fastest]);
}

std::string where_it_folds(const Problem& problem, const State& state, TimeMethod method) {
  if (problem.body.cell_count() == 0) return "an element's position is not a number";
  const Stencil none;
  const DrawnChains drawn = Cells(problem, none).drawn_chains(state);
  if (drawn.share >= 1)
    return fmt::format(
        "a cell near {} is drawn further than the chains of its law are long (lambda_m): load it more "
        "slowly, "
        "damp it ([damping]), or use a shorter [run] step",
        place(rest_of(problem, drawn.cell)));
  return folds_at("a cell", rest_of(problem, smallest(problem, state).cell), method);
}

std::string squeezed_most(const Problem& problem, const State& state) {
  if (problem.body.cell_count() == 0) {
    const PaperModel paper(problem);
    if (paper.rows().entries.empty()) return "";
    const PaperModel::SmallestVolume least = paper.smallest_volume(state);
    return fmt::format(", squeezed most near {}, to J = {:.2g}", place(problem.body.rest[least.element]),
                       least.value);
  }
  const SmallestJacobian most = smallest(problem, state);
  const Stencil none;
  return fmt::format(", squeezed most near {}, to J = {:.2g}{}", place(rest_of(problem, most.cell)),
                     most.value, said_of_chains(Cells(problem, none).drawn_chains(state), problem.body));
}

std::string damping_too_long(int stages) {
  return fmt::format(
      "the damping is so long that a step would take more than {} stages: give a shorter [damping] time or "
      "[run] "
      "step",
      stages);
}

}  // namespace flexel::simulate
