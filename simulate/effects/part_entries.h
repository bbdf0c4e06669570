// Entries of a scene that are for one part or assembly, by name, or for every part.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/input/part_names.h"

namespace flexel::simulate {

[[nodiscard]] inline Model model_of(const Problem& problem, std::size_t part) {
  return problem.models.empty() ? Model::cells : problem.models[part];
}

[[nodiscard]] inline HookeConstant hooke_of(const Problem& problem, std::size_t part) {
  return part < problem.hooke.size() ? problem.hooke[part] : HookeConstant::paper;
}

// The parts that `entry`, with `part` and `origin`, is for. Throws InputError: the body has none of that
// name.
template <class Entry>
[[nodiscard]] std::vector<std::size_t> parts_of(const Entry& entry, const Problem& problem) {
  if (entry.part) {
    const std::vector<std::uint32_t> parts = require_parts(problem.body, *entry.part, entry.origin);
    return {parts.begin(), parts.end()};
  }
  std::vector<std::size_t> all;
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) all.push_back(p);
  return all;
}

}  // namespace flexel::simulate
