// Which material each part is made of, and whether its model can be run.
#include <fmt/format.h>

#include "formats/error.h"
#include "formats/program.h"
#include "formats/units.h"
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

void refuse_uneven(const PartSettings& settings, const Part& part) {
  const Vec3& h = part.lattice.spacing;
  if (h.maxCoeff() <= (1 + 1e-6) * h.minCoeff()) return;
  throw InputError(settings.origin,
                   fmt::format("model \"springs\" needs cubic cells; those of part \"{}\" are {} x {} x {}: "
                               "voxelize with --align none",
                               part.name, human_length(h.x()), human_length(h.y()), human_length(h.z())));
}

void refuse_model(const PartSettings& settings, const Part& part) {
  if (part.placement != Placement::corner)
    throw InputError(settings.origin,
                     fmt::format("model \"{}\" is not available for placement centre (part \"{}\"); "
                                 "voxelize with --placement corner",
                                 settings.model, part.name));
  if (settings.model == "cells") return;
  if (settings.model == "springs") return refuse_uneven(settings, part);
  if (settings.model == "paper")
    throw InputError(settings.origin,
                     fmt::format("model \"paper\" needs elements at the voxels' centres (flexel-voxelize "
                                 "--placement centre), which this version does not run; part \"{}\" can be "
                                 "\"cells\" or \"springs\"",
                                 part.name));
  throw InputError(settings.origin, fmt::format("no model \"{}\"{}", settings.model,
                                                did_you_mean(settings.model, {"cells", "springs", "paper"})));
}

}  // namespace

std::vector<Model> models_of_parts(const Scene& scene, const Body& body) {
  std::vector<Model> models;
  for (const Part& part : body.parts) {
    const auto found = scene.parts.find(part.name);
    const bool springs = found != scene.parts.end() && found->second.model == "springs";
    models.push_back(springs ? Model::springs : Model::cells);
  }
  return models;
}

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
