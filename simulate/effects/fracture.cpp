// [fracture] of a scene.
#include "simulate/effects/fracture.h"

#include <fmt/format.h>

#include "base/error.h"
#include "simulate/effects/part_entries.h"
#include "simulate/input/hardening.h"
#include "simulate/models/connections.h"

namespace flexel::simulate {

void Fracture::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("fracture")) {
    TableReader reader(*table, scene.file(), "[fracture]");
    Entry entry;
    entry.origin = reader.place();
    entry.strength = reader.quantity("strength", Dimension::pressure);
    entry.elongation = reader.number("elongation");
    entry.part = reader.text("part");
    reader.finish();
    if (entry.strength && !(*entry.strength > 0)) reader.fail("\"strength\" needs to be above 0");
    if (entry.elongation && !(*entry.elongation > 0)) reader.fail("\"elongation\" needs to be above 0");
    parameters.entries.push_back(entry);
  }
}

std::optional<Fracture> Fracture::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.entries.empty()) return std::nullopt;
  Fracture made;
  made.origin_ = parameters.entries[0].origin;
  made.limits_.resize(problem.body.parts.size());
  made.needs_flow_.resize(problem.body.parts.size());
  for (const auto& [each, parts] : entries_of_parts(parameters.entries, problem.body))
    for (const std::uint32_t p : parts) {
      const Entry& entry = *each;
      const Material& material = problem.materials[p];
      const double strength = entry.strength.value_or(material.strength);
      const double elongation = entry.elongation.value_or(material.elongation);
      if (entry.part && !(strength > 0) && !(elongation > 0))
        throw InputError(entry.origin,
                         fmt::format("part \"{}\": {} has neither strength nor elongation: write strength = "
                                     "\"40 MPa\" here or in [materials.NAME]",
                                     *entry.part, material.name));
      if ((strength > 0 || elongation > 0) && material.law != LawName::neo_hooke)
        throw InputError(
            entry.origin,
            fmt::format("part \"{}\" cannot break: fracture is for law \"neo-hooke\", and {} has \"{}\"; "
                        "leave its \"strength\" and \"elongation\" out, or name another part",
                        problem.body.parts[p].name, material.name, law_name(material.law)));
      made.limits_[p] = {};
      made.needs_flow_[p] = false;
      const Model model = model_of(problem, p);
      if (model == Model::springs || model == Model::paper) {  // t = l (1 + elongation)
        // the strain of a connection at that stress, along the lattice
        const double stiffer = model == Model::paper ? axial_stiffness(hooke_of(problem, p)) : 1;
        if (strength > 0) made.limits_[p].elongation = strength / (stiffer * material.young);
        if (elongation > 0) made.limits_[p].elongation = elongation;
        continue;
      }
      if (strength > 0) made.limits_[p].strength = made.limits_[p].flowing_strength = strength;
      if (!entry.strength && material.strength > 0)
        made.limits_[p].flowing_strength = strength_of_flowing(material);
      if (elongation > 0) made.limits_[p].elongation = elongation;
      made.needs_flow_[p] = elongation > 0 && !(strength > 0);
    }
  for (const FractureLimits& limits : made.limits_)
    if (limits.any()) return made;
  throw InputError(made.origin_,
                   "no part can break: write strength = \"40 MPa\" here or in [materials.NAME]");
}

std::string Fracture::why() const {
  std::size_t parts = 0;
  for (const FractureLimits& limits : limits_) parts += limits.any();
  return fmt::format("[fracture], {} part(s) that can break", parts);
}

void Fracture::configure_kernel(KernelEffects& plan) const {
  plan.fracture = limits_;
}

void Fracture::check_kernel(const KernelEffects& plan) const {
  for (std::size_t p = 0; p < limits_.size(); ++p)
    if (needs_flow_[p] && (plan.plasticity.empty() || !std::isfinite(plan.plasticity[p].yield)))
      throw InputError(origin_,
                       "\"elongation\" is the plastic strain at which a cell breaks: add [plasticity] and a "
                       "yield stress, or give \"strength\"");
}

}  // namespace flexel::simulate
