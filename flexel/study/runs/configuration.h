// What a user can choose for a run.
#pragma once
#include <optional>
#include <string>

namespace flexel::study {

// What a user can choose. The defaults are those of the programs, but for the error bars, which a run within
// a study leaves out.
struct Configuration {
  double size = 0;                  // m, asked for
  std::string model;                // "cells", "springs", "paper"; "": as the scene has it
  std::string hooke;                // of model paper: "paper", "ganovelli"; "": as the scene has it
  std::string method = "blended";   // mapping
  std::string integrator;           // timed runs: "symplectic" ...; "": as the scene has it
  std::optional<double> step;       // timed runs: s
  std::optional<double> tolerance;  // equilibrium; nothing: as the scene has it
  int threads = 0;                  // 0: every core
  std::string without;              // an effect of the scene that is left out (study/scene_edit.h); "": none
  bool error_bars = false, stress = true;

  [[nodiscard]] bool centre_placement() const { return model == "paper"; }
  [[nodiscard]] bool operator==(const Configuration&) const = default;
};

}  // namespace flexel::study
