// Entries of a scene that are for one part, by name, or for every part.
#pragma once
#include <fmt/format.h>

#include "base/error.h"
#include "base/nearest_word.h"
#include "simulate/effects/effect.h"

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
  std::vector<std::size_t> parts;
  std::vector<std::string> names;
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    names.push_back(problem.body.parts[p].name);
    if (!entry.part || *entry.part == names[p]) parts.push_back(p);
  }
  if (parts.empty())
    throw InputError(entry.origin, fmt::format("the body has no part \"{}\"{}", *entry.part,
                                               did_you_mean(*entry.part, names)));
  return parts;
}

}  // namespace flexel::simulate
