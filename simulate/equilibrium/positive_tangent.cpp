// A load that is as symmetric as the part never excites the shape that it buckles into; irregular forces do.
#include "simulate/equilibrium/positive_tangent.h"

#include <memory>
#include <random>

#include "base/stop.h"
#include "simulate/equilibrium/newton.h"
#include "simulate/equilibrium/rigid_link_equilibrium.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/multigrid.h"

namespace flexel::simulate {

std::optional<bool> has_positive_tangent(Mechanics& mechanics, const State& state, Preconditioner* near) {
  constexpr double kTolerance = 1e-6;
  constexpr int kIterations = 1000;
  // What was found is told under a StopWaits; this question may not keep that waiting.
  if (stop_is_due()) {
    check_stop();
    return std::nullopt;
  }
  mechanics.assemble(state);
  mechanics.eliminate_prescribed();
  std::mt19937 random(1);
  std::vector<Vec3> irregular(state.displacement.size()), answer;
  for (std::size_t e = 0; e < irregular.size(); ++e)
    for (int axis = 0; axis < 3; ++axis) {
      const double value = static_cast<double>(random()) / 4294967295.0 - 0.5;
      irregular[e][axis] = mechanics.constraints().mask[e] >> axis & 1 ? 0 : value;
    }
  std::unique_ptr<Preconditioner> made;
  if (near != nullptr)
    near->refresh_smoother();
  else
    made = aggregation_multigrid(mechanics.tangent(), node_geometry(mechanics.body(), state));
  const Preconditioner& preconditioner = near != nullptr ? *near : *made;
  const FollowedTangent symmetric = mechanics.followed(true);
  const LinearOperator& tangent =
      mechanics.follows() ? static_cast<const LinearOperator&>(symmetric) : mechanics.tangent();
  const LinearResult result = conjugate_gradients(
      tangent, irregular, answer, preconditioner, kTolerance, kIterations, [](int, double) { check_stop(); },
      [](int, double) { return stop_is_due(); });
  if (result.indefinite) return false;
  if (result.converged) return links_are_stable(mechanics, state, preconditioner);
  return std::nullopt;
}

}  // namespace flexel::simulate
