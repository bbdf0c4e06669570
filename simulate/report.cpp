// Measured once a run has ended.
#include "simulate/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/units.h"
#include "simulate/connections.h"
#include "simulate/infill.h"
#include "simulate/stress.h"

namespace flexel {

void name_materials(Body& body, const std::vector<Material>& materials) {
  for (std::size_t p = 0; p < body.parts.size(); ++p) body.parts[p].material = materials[p].name;
}

void report_materials(const Setting& setting, Progress& progress) {
  for (std::size_t p = 0; p < setting.materials.size(); ++p)
    if (const std::string line = infill_line(setting.body.parts[p].name, setting.materials[p]); !line.empty())
      progress.say(line);
  for (std::size_t p = 0; p < setting.models.size(); ++p) {
    const Material& material = setting.materials[p];
    const std::string& part = setting.body.parts[p].name;
    if (setting.models[p] == Model::springs && std::abs(material.poisson - 0.25) > 0.005)
      progress.warn(
          fmt::format("part \"{}\": model \"springs\" has Poisson's ratio 0.25, not the {:.3g} of {}", part,
                      material.poisson, material.name));
    if (setting.models[p] == Model::paper)
      progress.warn(fmt::format(
          "part \"{}\": model \"paper\" is stiffer than {} inside (Young's modulus {:.3g} times along the "
          "lattice's axes) and softer at its surface; it is meant for comparison with the paper, not for "
          "sizes",
          part, material.name, axial_stiffness(setting.hooke[p])));
  }
}

void measure_displacement(const Body& body, const State& state, SimulateResult& result) {
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (const double length = state.displacement[e].norm(); length > result.largest_displacement) {
      result.largest_displacement = length;
      result.largest_displacement_at = body.rest[e];
    }
}

// A cell resists by its mean deformation gradient; a corner of it may fold unnoticed, and with it the surface
// that is mapped through it.
void measure_corners(const Cells& cells, const Body& body, const State& state, SimulateResult& result,
                     Progress& progress) {
  constexpr double kNearlyFolded = 0.2;
  const SmallestJacobian smallest = cells.smallest_corner_jacobian(state);
  if (smallest.cell >= body.cell_count()) return;
  result.smallest_corner_jacobian = smallest.value;
  result.smallest_corner_at = body.rest[body.cell_elements[smallest.cell][smallest.corner]];
  if (smallest.value > kNearlyFolded) return;
  const Vec3& at = result.smallest_corner_at;
  progress.warn(
      fmt::format("a corner of a cell near ({}, {}, {}) {} (J = {:.2g}): the result is coarse there; "
                  "use a smaller spacing, or spread the load or the fix over a larger area",
                  human_length(at.x()), human_length(at.y()), human_length(at.z()),
                  smallest.value > 0 ? "is nearly folded" : "is folded", smallest.value));
}

void measure_stress(const Setting& setting, const State& state, Body& body, SimulateResult& result) {
  if (body.cell_count() == 0) return;
  const Stresses computed = stresses(setting, state);
  const std::optional<LargestStress> largest = largest_stress(setting, computed);
  if (!largest) return;
  const double yield = setting.materials[largest->part].yield;
  result.stress = StressSummary{largest->value, largest->at, body.parts[largest->part].name, {}};
  if (yield > 0) result.stress->yield_share = largest->value / yield;
  write_stress_columns(computed, body);
}

void add_shares(const std::vector<PassShare>& shares, std::vector<PassShare>& all) {
  std::vector<bool> free(all.size(), true);  // two of one name are two
  for (const PassShare& share : shares) {
    std::size_t i = 0;
    while (i < free.size() && !(free[i] && all[i].name == share.name)) ++i;
    if (i == free.size()) {
      all.push_back(share);
      continue;
    }
    free[i] = false;
    all[i].why = share.why;
    all[i].seconds += share.seconds;
  }
}

void explain_times(const std::vector<PassShare>& shares, double seconds, Progress& progress) {
  double rest = seconds;
  const auto line = [&](const std::string& name, double taken) {
    progress.say(
        fmt::format("time: {:<14} {:8.3f} s {:5.1f} %", name, taken, 100 * taken / std::max(seconds, 1e-9)));
  };
  for (const PassShare& share : shares) {
    line(share.name, share.seconds);
    rest -= share.seconds;
  }
  line("the rest", std::max(rest, 0.0));
}

double body_extent(const Body& body) {
  Vec3 low = body.rest[0], high = low;
  for (const Vec3& at : body.rest) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  return (high - low).norm();
}

}  // namespace flexel
