// Entries of a scene that are for one part or assembly, by name, or for every part.
#pragma once
#include <algorithm>
#include <limits>
#include <numeric>

#include "simulate/effects/effect.h"
#include "simulate/input/part_names.h"

namespace flexel::simulate {

[[nodiscard]] inline Model model_of(const Problem& problem, std::size_t part) {
  return problem.models.empty() ? Model::cells : problem.models[part];
}

[[nodiscard]] inline HookeConstant hooke_of(const Problem& problem, std::size_t part) {
  return part < problem.hooke.size() ? problem.hooke[part] : HookeConstant::paper;
}

template <class Entry>
struct EntryParts {
  const Entry* entry = nullptr;
  std::vector<std::uint32_t> parts;  // ascending
};

// The parts that each of `entries`, with `part` and `origin`, is for, in the order in which they are to be taken over:
// those of every part, those of assemblies, the smallest last, and those of the parts themselves; of equals as in the
// file. So a part's own entry goes before its assembly's, and a later one before an earlier one of its kind. Throws
// InputError: the body has none of that name.
template <class Entry>
[[nodiscard]] std::vector<EntryParts<Entry>> entries_of_parts(const std::vector<Entry>& entries,
                                                              const Body& body) {
  const std::vector<std::string> names = part_names(body);
  std::vector<std::pair<std::size_t, EntryParts<Entry>>> by_width;
  for (const Entry& entry : entries) {
    EntryParts<Entry> found{&entry, {}};
    std::size_t width = std::numeric_limits<std::size_t>::max();
    if (entry.part) {
      found.parts = require_parts(body, *entry.part, entry.origin);
      width = entry_width(names, found.parts, *entry.part);
    } else {
      found.parts.resize(body.parts.size());
      std::iota(found.parts.begin(), found.parts.end(), 0u);
    }
    by_width.emplace_back(width, std::move(found));
  }
  std::stable_sort(by_width.begin(), by_width.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<EntryParts<Entry>> result;
  for (auto& [width, found] : by_width) result.push_back(std::move(found));
  return result;
}

}  // namespace flexel::simulate
