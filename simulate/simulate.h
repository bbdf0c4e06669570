// Body + scene -> deformed body.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "formats/body.h"
#include "formats/progress.h"

namespace flexel {

struct Scene;  // simulate/scene.h

struct ProbeResult {
  std::string name;
  Vec3 where = Vec3::Zero();          // m, rest position
  Vec3 displacement = Vec3::Zero();   // m
};

struct Reaction {                     // of one [[fix]] or [[move]]
  std::string name;
  Vec3 force = Vec3::Zero();          // N, by the support on the body
};

struct SimulateResult {
  std::vector<ProbeResult> probes;
  std::vector<Reaction> reactions;
  double largest_displacement = 0;    // m, over the elements
  Vec3 largest_displacement_at = Vec3::Zero();
  double elastic_energy = 0;          // J
  double smallest_jacobian = 1;       // of all cells' mean deformation gradients
  int load_steps = 0, newton_iterations = 0, cg_iterations = 0;
  double relative_residual = 0;
  double seconds = 0;
};

struct SimulateOptions {
  int threads = 0;                    // 0: every core
  std::string failed_output;          // where the last good state goes when the run diverges; "" for nowhere
};

// Runs the scene on the body, which is moved to its new state. Throws InputError, DivergedError, Interrupted.
[[nodiscard]] SimulateResult simulate(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress);

// The result as JSON (docs/summary.md gives every key and unit).
[[nodiscard]] std::string summary_json(const SimulateResult& result, const Body& body);

}  // namespace flexel
