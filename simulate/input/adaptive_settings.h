// [adaptive] of a scene: when parts become finer and coarser (simulate/events/adaptive_resolution.h).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "simulate/input/scene_table.h"

namespace flexel::simulate {

struct AdaptiveSettings {
  std::optional<std::vector<std::string>> parts;  // names; nothing: every part
  double strain_jump = 0.002;                     // beyond it a part is strained
  double calm = 0.25;                             // share of that, under which it is calm
  bool contact = true;                            // whether contact makes finer
  std::optional<double> least_time;               // s; nothing: a twentieth of the run
  int finest = 1, coarsest = 0;                   // halvings and doublings of the spacing, from the start
  std::optional<double> most_elements;            // of the body
  std::string origin;
};

// Of a scene, whose `run` is [run]; nothing where it asks for none. Throws InputError.
[[nodiscard]] std::optional<AdaptiveSettings> parse_adaptive(TableReader& root, TableReader& run);

}  // namespace flexel::simulate
