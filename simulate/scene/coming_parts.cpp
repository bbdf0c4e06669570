// By the names in selections: "pad", "pad/xmax".
#include "simulate/scene/coming_parts.h"

#include <algorithm>

#include "simulate/input/part_names.h"

namespace flexel::simulate {
namespace {

bool selects(const Selection& selection, const std::string& part) {
  if (selection.kind == Selection::Kind::name)
    return selection.name == part || selection.name.starts_with(part + "/");
  return std::any_of(selection.members.begin(), selection.members.end(),
                     [&](const Selection& each) { return selects(each, part); });
}

}  // namespace

EffectParameters without_coming_parts(const Scene& scene, const Body& body) {
  EffectParameters parameters = scene.effects;
  const std::vector<std::string> here = part_names(body);
  for (const std::string& part : scene.coming_parts) {
    if (std::find(here.begin(), here.end(), part) != here.end()) continue;
    const auto selects_it = [&](const auto& each) { return selects(each.where, part); };
    std::erase_if(parameters.get<Loads>().loads, selects_it);
    std::erase_if(parameters.get<Supports>().ties, selects_it);
  }
  return parameters;
}

Scene at_the_beginning(const Scene& scene, const Body& body) {
  Scene first = scene;
  for (const Event& event : scene.events)
    if (event.prepare)
      for (std::string& name : event.prepare()) first.coming_parts.push_back(std::move(name));
  first.effects = without_coming_parts(first, body);
  return first;
}

}  // namespace flexel::simulate
