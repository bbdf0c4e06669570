// Which material each part is made of, and whether its model can be run.
#include <fmt/format.h>

#include "formats/error.h"
#include "formats/program.h"
#include "simulate/scene.h"

namespace flexel {
namespace {

Material material_named(const Scene& scene, const std::string& name, const std::string& origin) {
  const auto own = scene.materials.find(name);
  if (own != scene.materials.end()) return own->second;
  if (const Material* material = library_material(name)) return *material;
  std::vector<std::string> names;
  for (const auto& [each, material] : scene.materials) names.push_back(each);
  for (const Material& material : material_library()) names.push_back(material.name);
  std::string hint = did_you_mean(name, names);
  if (hint.empty())
    hint = fmt::format("; known: {}; or give [materials.\"{}\"]", fmt::join(names, ", "), name);
  throw InputError(origin, fmt::format("no material \"{}\"{}", name, hint));
}

void refuse_model(const PartSettings& settings, const Part& part) {
  if (part.placement != Placement::corner)
    throw InputError(settings.origin,
                     fmt::format("model \"cells\" is not available for placement centre (part \"{}\"); "
                                 "voxelize with --placement corner",
                                 part.name));
  if (settings.model == "cells") return;
  if (settings.model == "springs")
    throw InputError(settings.origin, "model \"springs\" is not available in this version; use \"cells\"");
  if (settings.model == "paper")
    throw InputError(
        settings.origin,
        fmt::format("model \"paper\" is not available for placement corner (part \"{}\")", part.name));
  throw InputError(settings.origin, fmt::format("no model \"{}\"{}", settings.model,
                                                did_you_mean(settings.model, {"cells", "springs", "paper"})));
}

}  // namespace

std::vector<Material> materials_of_parts(const Scene& scene, const Body& body) {
  std::vector<std::string> names;
  for (const Part& part : body.parts) names.push_back(part.name);
  for (const auto& [name, settings] : scene.parts)
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      std::string hint = did_you_mean(name, names);
      if (hint.empty()) hint = fmt::format("; it has {}", fmt::join(names, ", "));
      throw InputError(settings.origin, fmt::format("the body has no part \"{}\"{}", name, hint));
    }
  std::vector<Material> materials;
  for (const Part& part : body.parts) {
    PartSettings settings;
    settings.origin = scene.name;
    if (const auto found = scene.parts.find(part.name); found != scene.parts.end()) settings = found->second;
    refuse_model(settings, part);
    const std::string& name = !settings.material.empty() ? settings.material
                              : !scene.material.empty()  ? scene.material
                                                         : part.material;
    if (name.empty())
      throw InputError(
          scene.name, fmt::format("part \"{}\" has no material: write material = \"steel\" at the top of the "
                                  "scene, or [parts.\"{}\"] material = ...",
                                  part.name, part.name));
    materials.push_back(material_named(scene, name, settings.origin));
  }
  return materials;
}

}  // namespace flexel
