// [damping] of a scene.
#include "simulate/effects/damping.h"

#include <fmt/format.h>

#include <numbers>

#include "base/error.h"
#include "simulate/effects/part_entries.h"

namespace flexel::simulate {
namespace {

// s, tau.
double time_of(const Damping::Entry& entry, const std::string& part, const Material& material) {
  if (entry.period == 0) return entry.time;
  if (!entry.ratio && !(material.damping > 0))
    throw InputError(entry.origin,
                     fmt::format("part \"{}\": {} has no damping ratio: write ratio = 0.01 here, "
                                 "damping = 0.01 in [materials.NAME], or \"time\"",
                                 part, material.name));
  return entry.ratio.value_or(material.damping) * entry.period / std::numbers::pi;
}

}  // namespace

void Damping::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("damping")) {
    TableReader reader(*table, scene.file(), "[damping]");
    Entry entry;
    entry.origin = reader.place();
    const std::optional<double> period = reader.quantity("period", Dimension::time);
    entry.ratio = reader.number("ratio");
    if (!period || reader.find("time"))
      entry.time = reader.to_quantity(reader.require("time", "\"20 us\""), Dimension::time, "time");
    entry.part = reader.text("part");
    if (period && reader.find("time"))
      reader.fail("\"time\" and \"period\" both say how long the damping is: give one");
    if (entry.ratio && !period) reader.fail("\"ratio\" needs \"period\", of the swing that decays with it");
    reader.finish();
    if (!(entry.time >= 0)) reader.fail("\"time\" needs to be 0 or more");
    if (period && !(*period > 0)) reader.fail("\"period\" needs to be above 0");
    if (entry.ratio && !(*entry.ratio >= 0)) reader.fail("\"ratio\" needs to be 0 or more");
    entry.period = period.value_or(0);
    parameters.entries.push_back(entry);
  }
}

std::optional<Damping> Damping::make(const Parameters& parameters, const Problem& problem) {
  Damping made;
  made.entries_ = parameters.entries.size();
  made.time_.assign(problem.body.parts.size(), 0);
  bool damped = false;
  for (const auto& [entry, parts] : entries_of_parts(parameters.entries, problem.body)) {
    for (const std::uint32_t p : parts) {
      made.time_[p] = time_of(*entry, problem.body.parts[p].name, problem.materials[p]);
      damped = damped || made.time_[p] > 0;
    }
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
