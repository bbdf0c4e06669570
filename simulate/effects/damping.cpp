// [damping] of a scene.
#include "simulate/effects/damping.h"

#include <fmt/format.h>

#include "simulate/effects/part_entries.h"

namespace flexel::simulate {

void Damping::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("damping")) {
    TableReader reader(*table, scene.file(), "[damping]");
    Entry entry;
    entry.origin = reader.place();
    entry.time = reader.to_quantity(reader.require("time", "\"20 us\""), Dimension::time, "time");
    entry.part = reader.text("part");
    reader.finish();
    if (!(entry.time >= 0)) reader.fail("\"time\" needs to be 0 or more");
    parameters.entries.push_back(entry);
  }
}

std::optional<Damping> Damping::make(const Parameters& parameters, const Problem& problem) {
  Damping made;
  made.entries_ = parameters.entries.size();
  made.time_.assign(problem.body.parts.size(), 0);
  bool damped = false;
  for (const auto& [entry, parts] : entries_of_parts(parameters.entries, problem.body)) {
    for (const std::uint32_t p : parts) made.time_[p] = entry->time;
    damped = damped || entry->time > 0;
  }
  if (!damped) return std::nullopt;
  return made;
}

std::string Damping::why() const {
  return fmt::format("{} [damping]", entries_);
}

void Damping::configure_kernel(KernelEffects& plan) const {
  plan.damping = time_;
}

}  // namespace flexel::simulate
