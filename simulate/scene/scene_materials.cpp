// Which material each part is made of, and whether its model can be run.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/units.h"
#include "simulate/input/material_names.h"
#include "simulate/input/part_names.h"
#include "simulate/models/rest_shape.h"
#include "simulate/scene/scene.h"
#include "simulate/scene/scene_checks.h"

namespace flexel::simulate {
namespace {

Material material_named(const Scene& scene, const std::string& name, const std::string& origin) {
  for (const auto& [own, material] : scene.materials)
    if (same_material_name(own, name)) return material;
  if (const Material* material = library_material(name)) return *material;
  std::vector<std::string> names;
  for (const auto& [each, material] : scene.materials) names.push_back(each);
  for (const Material& material : material_library()) names.push_back(material.name);
  std::string hint = did_you_mean(name, names);
  if (hint.empty())
    hint = fmt::format("; known: {}; or give [materials.\"{}\"]", fmt::join(names, ", "), name);
  throw InputError(origin, fmt::format("no material \"{}\"{}", name, hint));
}

// What `settings` of the part, the scene or the body says; "" where nothing does.
const std::string& name_of_material(const Scene& scene, const PartSettings& settings, const Part& part) {
  if (!settings.material.empty()) return settings.material;
  return scene.material.empty() ? part.material : scene.material;
}

// Fills what `settings` leaves open.
void take_over(PartSettings& settings, const PartSettings& wider) {
  if (settings.material.empty() && !settings.infill.share)
    settings.infill = wider.infill;  // belongs to a material
  if (settings.material.empty()) settings.material = wider.material;
  if (settings.model.empty()) settings.model = wider.model;
  if (settings.hooke.empty()) settings.hooke = wider.hooke;
  if (!settings.axes) settings.axes = wider.axes;
  if (settings.origin.empty()) settings.origin = wider.origin;
}

// (parts) What [parts] says: a part's own entry, and where that leaves something open the entries of the assemblies that
// hold it, the smallest first.
std::vector<PartSettings> settings_of_parts(const Scene& scene, const Body& body) {
  struct Entry {
    std::vector<std::uint32_t> parts;
    const PartSettings* settings;
  };
  const std::vector<std::string> names = part_names(body);
  std::multimap<std::size_t, Entry> entries;  // by how many parts they are for; 0: a part's own
  for (const auto& [name, entry] : scene.parts) {
    std::vector<std::uint32_t> parts = parts_called(names, body.surface.parts, name);
    if (parts.empty()) continue;
    const std::size_t width = entry_width(names, parts, name);
    entries.emplace(width, Entry{std::move(parts), &entry});
  }
  std::vector<PartSettings> settings(names.size());
  for (const auto& [width, entry] : entries)
    for (const std::uint32_t p : entry.parts) take_over(settings[p], *entry.settings);
  return settings;
}

// Throws InputError, one line: an entry of [parts] for a part that the body does not have and no event adds.
void refuse_unknown_parts(const Scene& scene, const Body& body) {
  const std::vector<std::string> names = part_names(body);
  for (const auto& [name, settings] : scene.parts)
    if (std::find(scene.coming_parts.begin(), scene.coming_parts.end(), name) == scene.coming_parts.end() &&
        parts_called(names, body.surface.parts, name).empty())
      (void)require_parts(body, name, settings.origin);
}

// What the part, the scene or the placement says.
std::string model_of_part(const Scene& scene, const PartSettings& settings, const Part& part) {
  if (!settings.model.empty()) return settings.model;
  if (!scene.model.empty()) return scene.model;
  return part.placement == Placement::corner ? "cells" : "paper";
}

void refuse_uneven(const PartSettings& settings, const std::string& model, const Part& part) {
  const Vec3& h = part.lattice.spacing;
  if (h.maxCoeff() <= (1 + 1e-6) * h.minCoeff()) return;
  throw InputError(
      settings.origin,
      fmt::format("model \"{}\" needs a cubic lattice; the spacings of part \"{}\" are {} x {} "
                  "x {}: voxelize with --align none",
                  model, part.name, human_length(h.x()), human_length(h.y()), human_length(h.z())));
}

void refuse_placement(const PartSettings& settings, const std::string& model, const Part& part) {
  const bool centre = part.placement == Placement::centre;
  if (model == "paper" && !centre)
    throw InputError(
        settings.origin,
        fmt::format("model \"paper\" needs an element at the centre of each voxel: voxelize part "
                    "\"{}\" with --placement centre; with this one it can be \"cells\" or \"springs\"",
                    part.name));
  if (model != "paper" && centre)
    throw InputError(
        settings.origin,
        fmt::format("model \"{}\" needs elements at the corners of the voxels: voxelize part "
                    "\"{}\" with --placement corner; with --placement centre it can only be \"paper\"",
                    model, part.name));
}

void refuse_model(const Scene& scene, const PartSettings& settings, const Part& part) {
  const std::vector<std::string> known = {"cells", "quadratic", "springs", "paper"};
  const std::string model = model_of_part(scene, settings, part);
  if (std::find(known.begin(), known.end(), model) == known.end())
    throw InputError(settings.origin, fmt::format("no model \"{}\"{}", model, did_you_mean(model, known)));
  refuse_placement(settings, model, part);
  if (model == "springs" || model == "paper") refuse_uneven(settings, model, part);
  if (settings.hooke.empty()) return;
  if (model != "paper")
    throw InputError(
        settings.origin,
        fmt::format("\"hooke\" belongs to model \"paper\"; part \"{}\" has model \"{}\"", part.name, model));
  if (settings.hooke != "paper" && settings.hooke != "ganovelli" && settings.hooke != "isotropic")
    throw InputError(
        settings.origin,
        fmt::format("no Hooke constant \"{}\"{}; known: paper, ganovelli, isotropic", settings.hooke,
                    did_you_mean(settings.hooke, {"paper", "ganovelli", "isotropic"})));
}

// Throws InputError, one line: a law but neo-Hooke's with another model than cells, an infill, a rest shape of
// its own, or axes for a law that has none. `settings` of part `p`, `material` without the part's axes.
void refuse_law(const Scene& scene, const PartSettings& settings, const Body& body, std::size_t p,
                const Material& material, const std::string& model) {
  const Part& part = body.parts[p];
  if (settings.axes && material.law != LawName::orthotropic)
    throw InputError(
        settings.origin,
        fmt::format("\"axes\" belong to a material with law = \"orthotropic\"; {} of part \"{}\" is "
                    "{}: leave them out",
                    material.name, part.name, law_name(material.law)));
  if (material.law == LawName::neo_hooke) return;
  const auto refuse = [&](const std::string& what) {
    throw InputError(settings.origin, fmt::format("part \"{}\": law \"{}\" of {} {}", part.name,
                                                  law_name(material.law), material.name, what));
  };
  if (part.placement == Placement::centre)
    refuse("needs model \"cells\", not \"paper\": voxelize with --placement corner");
  if (model != "cells" && model != "quadratic")
    refuse(fmt::format("needs model \"cells\", not \"{}\": write model = \"cells\"", model));
  if (settings.infill.share || (settings.material.empty() && scene.infill.share))
    refuse("takes no infill: give the constants of the print as it is, with its infill");
  const bool event = std::any_of(scene.events.begin(), scene.events.end(),
                                 [](const Event& each) { return each.name == "renormalise"; });
  if (scene.run.renormalise || event)
    refuse("cannot be renormalised: leave \"renormalise\" out or take a neo-Hookean material");
  const RestShapes shapes(body);
  if (!shapes.any()) return;
  const CellKind kind = cell_kind(part.lattice, material);
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
    if (shapes.of(kind, part, c))
      refuse("takes no rest shape of its own, which an earlier run left: begin with the body as voxelized");
}

}  // namespace

std::vector<Model> models_of_parts(const Scene& scene, const Body& body) {
  const std::vector<PartSettings> settings = settings_of_parts(scene, body);
  std::vector<Model> models;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const std::string model = model_of_part(scene, settings[p], body.parts[p]);
    models.push_back(model == "springs"     ? Model::springs
                     : model == "paper"     ? Model::paper
                     : model == "quadratic" ? Model::quadratic
                                            : Model::cells);
  }
  return models;
}

std::vector<HookeConstant> hooke_of_parts(const Scene& scene, const Body& body) {
  std::vector<HookeConstant> constants;
  for (const PartSettings& settings : settings_of_parts(scene, body)) {
    const std::string& hooke = settings.hooke;
    constants.push_back(hooke == "ganovelli"   ? HookeConstant::ganovelli
                        : hooke == "isotropic" ? HookeConstant::isotropic
                                               : HookeConstant::paper);
  }
  return constants;
}

std::vector<Material> materials_of_parts(const Scene& scene, const Body& body) {
  refuse_unknown_parts(scene, body);
  std::vector<PartSettings> settings_of = settings_of_parts(scene, body);
  std::vector<Material> materials;
  bool infill_used = false;  // the scene's
  for (std::size_t index = 0; index < body.parts.size(); ++index) {
    const Part& part = body.parts[index];
    PartSettings& settings = settings_of[index];
    if (settings.origin.empty()) settings.origin = scene.name;
    refuse_model(scene, settings, part);
    const std::string& name = name_of_material(scene, settings, part);
    if (name.empty())
      throw InputError(
          scene.name, fmt::format("part \"{}\" has no material: write material = \"steel\" at the top of the "
                                  "scene, or [parts.\"{}\"] material = ...",
                                  part.name, part.name));
    // an infill belongs to the material that is named with it
    const Infill& infill =
        settings.infill.share || !settings.material.empty() ? settings.infill : scene.infill;
    infill_used = infill_used || settings.material.empty();
    Material material = material_named(scene, name, settings.origin);
    refuse_law(scene, settings, body, index, material, model_of_part(scene, settings, part));
    if (settings.axes) material.axes = *settings.axes;
    if (infill.share) {
      const double walls =
          infill.shell ? wall_share(*infill.shell, part, body.surface, index, settings.origin) : 0;
      material = with_infill(std::move(material), *infill.share, walls);
    }
    materials.push_back(std::move(material));
  }
  if (scene.infill.share && !infill_used)
    throw InputError(scene.name,
                     "the infill is that of the scene's material, which no part takes: give it to a part, "
                     "[parts.NAME] infill = \"20 %\" or --infill \"PART=20%\"");
  return materials;
}

void warn_of_unused_materials(const Scene& scene, const Body& body, Progress& progress) {
  const std::vector<PartSettings> settings_of = settings_of_parts(scene, body);
  std::vector<std::string> used;
  for (std::size_t p = 0; p < body.parts.size(); ++p)
    used.push_back(name_of_material(scene, settings_of[p], body.parts[p]));
  if (!scene.events.empty()) {  // a part that joins later
    used.push_back(scene.material);
    for (const auto& [name, settings] : scene.parts) used.push_back(settings.material);
  }
  for (const auto& [name, material] : scene.materials)
    if (std::none_of(used.begin(), used.end(),
                     [&own = name](const std::string& each) { return same_material_name(each, own); }))
      progress.warn(
          fmt::format("{}: [materials.{}] is used by no part: write material = \"{}\" at the top of the "
                      "scene or in [parts.NAME], or leave it out",
                      scene.name, name, name));
}

}  // namespace flexel::simulate
