// [plasticity] of a scene.
#include "simulate/effects/plasticity.h"

#include <fmt/format.h>

#include "base/error.h"
#include "base/units.h"
#include "simulate/effects/part_entries.h"
#include "simulate/input/hardening.h"

namespace flexel::simulate {

void Plasticity::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("plasticity")) {
    TableReader reader(*table, scene.file(), "[plasticity]");
    Entry entry;
    entry.origin = reader.place();
    entry.yield = reader.quantity("yield", Dimension::pressure);
    entry.hardening = reader.quantity("hardening", Dimension::pressure);
    entry.part = reader.text("part");
    reader.finish();
    if (entry.yield && !(*entry.yield > 0)) reader.fail("\"yield\" needs to be above 0");
    if (entry.hardening && !(*entry.hardening >= 0)) reader.fail("\"hardening\" needs to be 0 or more");
    parameters.entries.push_back(entry);
  }
}

// What a part does whose yield stress is `yield` [Pa].
PlasticFlow Plasticity::flow_of(const Entry& entry, const Material& material, double yield) {
  PlasticFlow flow{yield, entry.hardening.value_or(material.hardening), 0, 0};
  if (entry.hardening || !(material.uniform_elongation > 0)) return flow;
  const std::optional<VoceHardening> voce =
      voce_hardening(yield, material.strength, material.uniform_elongation, material.young);
  if (!voce)
    throw InputError(
        entry.origin,
        fmt::format("{} hardens up to its strength of {}, and yield = {} is too near to that, or above: take "
                    "less, or write hardening = \"0 Pa\" for none",
                    material.name, human_pressure(material.strength), human_pressure(yield)));
  flow.saturation = voce->saturation;
  flow.rate = voce->rate;
  return flow;
}

std::optional<Plasticity> Plasticity::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.entries.empty()) return std::nullopt;
  Plasticity made;
  made.flow_.resize(problem.body.parts.size());
  for (const auto& [each, parts] : entries_of_parts(parameters.entries, problem.body))
    for (const std::uint32_t p : parts) {
      const Entry& entry = *each;
      const Material& material = problem.materials[p];
      const double yield = entry.yield.value_or(material.yield);
      if (entry.part && !(yield > 0))
        throw InputError(entry.origin, fmt::format("part \"{}\": {} has no yield stress: write yield = \"250 "
                                                   "MPa\" here or in [materials.NAME]",
                                                   *entry.part, material.name));
      if (yield > 0 && material.law != LawName::neo_hooke)
        throw InputError(
            entry.origin,
            fmt::format("part \"{}\" cannot flow: plasticity is for law \"neo-hooke\", and {} has \"{}\"; "
                        "leave its \"yield\" out, or name another part",
                        problem.body.parts[p].name, material.name, law_name(material.law)));
      if (yield > 0) made.flow_[p] = flow_of(entry, material, yield);
    }
  for (const PlasticFlow& flow : made.flow_)
    if (std::isfinite(flow.yield)) return made;
  throw InputError(parameters.entries[0].origin,
                   "no part can flow: write yield = \"250 MPa\" here or in [materials.NAME]");
}

std::string Plasticity::why() const {
  std::size_t parts = 0;
  for (const PlasticFlow& flow : flow_) parts += std::isfinite(flow.yield);
  return fmt::format("[plasticity], {} part(s) with a yield stress", parts);
}

void Plasticity::configure_kernel(KernelEffects& plan) const {
  plan.plasticity = flow_;
}

}  // namespace flexel::simulate
