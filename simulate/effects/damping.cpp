// [damping] of a scene.
#include "simulate/effects/damping.h"

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/program.h"

namespace flexel {

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

std::optional<Damping> Damping::make(const Parameters& parameters, const Setting& setting) {
  Damping made;
  made.entries_ = parameters.entries.size();
  made.time_.assign(setting.body.parts.size(), 0);
  bool damped = false;
  std::vector<std::string> names;
  for (const Part& part : setting.body.parts) names.push_back(part.name);
  for (const Entry& entry : parameters.entries) {
    bool found = false;
    for (std::size_t p = 0; p < names.size(); ++p)
      if (!entry.part || *entry.part == names[p]) {
        made.time_[p] = entry.time;
        found = true;
      }
    if (!found)
      throw InputError(entry.origin, fmt::format("the body has no part \"{}\"{}", *entry.part,
                                                 did_you_mean(*entry.part, names)));
    damped = damped || entry.time > 0;
  }
  if (!damped) return std::nullopt;
  return made;
}

std::string Damping::why() const {
  return fmt::format("{} [damping]", entries_);
}

void Damping::compose(StepPlan& plan) const {
  plan.damping = time_;
}

}  // namespace flexel
