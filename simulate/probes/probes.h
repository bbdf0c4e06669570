// Probes: the displacement of material points.
#pragma once
#include <optional>
#include <vector>

#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// Where a probe's points are carried, found before the run so that a wrong probe is refused before it.
// Weights sum to 1.
struct ProbePoints {
  std::string name;
  Vec3 where = Vec3::Zero();  // m, rest: the point, or the mean of the selection
  std::vector<std::pair<std::uint32_t, double>> weights = {};  // element, weight
  std::optional<std::uint32_t> cell = {};                      // of a point that a cell carries
  // Of parts that events will bring: no number yet.
  [[nodiscard]] bool is_to_come() const { return weights.empty(); }
};

// Throws InputError: a point further than one spacing from all matter, a selection that selects nothing.
[[nodiscard]] std::vector<ProbePoints> place_probes(const Scene& scene, const Problem& problem);
[[nodiscard]] ProbeResult measure(const ProbePoints& probe, const State& state);

}  // namespace flexel::simulate
