// Materials whose strength is not known are named, so that nobody takes silence for safety.
#include "simulate/scene/strength.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {
namespace {

// Of the elements of part p: where the stress is largest.
std::uint32_t most_stressed(const Part& part, const std::vector<double>& stress) {
  std::uint32_t most = part.element_begin;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    if (stress[e] > stress[most]) most = e;
  return most;
}

// Pa: what it bears, and whether it yields there. A material may break before it yields.
std::pair<double, bool> limit_of(const Material& material) {
  const bool breaks = material.strength > 0 && !(material.yield > 0 && material.yield <= material.strength);
  return {breaks ? material.strength : material.yield, !breaks};
}

}  // namespace

double StrengthSummary::nearest_share() const {
  return std::max(share, layer_share.value_or(0));
}

bool has_edited_limits(const Body& body, const Part& part) {
  for (const char* name : {"stiffness_change", "yield_change", "strength_change"}) {
    const auto column = body.cell_columns.find(name);
    if (column == body.cell_columns.end()) continue;
    const auto begin = column->second.values.begin();
    if (std::any_of(begin + part.cell_begin, begin + part.cell_end, [](double each) { return each != 0; }))
      return true;
  }
  return false;
}

std::optional<StrengthSummary> nearest_to_strength(const Body& body, const std::vector<Material>& materials,
                                                   std::vector<std::string>& unknown) {
  const auto column = body.element_columns.find("von_mises");
  if (column == body.element_columns.end()) return std::nullopt;
  const auto& stress = column->second.values;
  std::optional<StrengthSummary> found;
  std::vector<std::string> too_weak;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const Material& material = materials[p];
    if (part.element_begin == part.element_end) continue;
    if (part.placement == Placement::centre) {
      unknown.push_back(fmt::format("part \"{}\" of model \"paper\"", part.name));
      continue;
    }
    const auto [limit, yields] = limit_of(material);
    // along and across the grain strengths differ many times over: one number says nothing of the nearest
    if (!(limit > 0) || material.law == LawName::orthotropic || has_edited_limits(body, part)) {
      if (std::find(unknown.begin(), unknown.end(), material.name) == unknown.end())
        unknown.push_back(material.name);
      continue;
    }
    const std::uint32_t most = most_stressed(part, stress);
    StrengthSummary here{stress[most] / limit, stress[most], body.rest[most], limit, yields, part.name,
                         material.name};
    if (material.layer_strength > 0) here.layer_share = stress[most] / material.layer_strength;
    if (here.nearest_share() > 1) too_weak.push_back(part.name);
    if (!found || here.nearest_share() > found->nearest_share()) found = here;
  }
  if (found) found->too_weak = too_weak;
  return found;
}

std::vector<Material> known_materials(const Scene& scene, const Body& body) {
  try {
    return materials_of_parts(scene, body);
  } catch (const InputError&) {
    std::vector<Material> named(body.parts.size());
    for (std::size_t p = 0; p < named.size(); ++p) named[p].name = body.parts[p].material;
    return named;
  }
}

}  // namespace flexel::simulate
