// By the names in selections: "pad", "pad/xmax".
#include "simulate/scene/coming_parts.h"

#include <algorithm>

#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/input/part_names.h"

namespace flexel::simulate {
namespace {

// Leaves the part out of the selection. False: nothing else was selected.
bool leave_out(Selection& selection, const std::string& part) {
  if (selection.kind == Selection::Kind::name)
    return selection.name != part && !selection.name.starts_with(part + "/");
  std::vector<Selection> kept;
  for (Selection& each : selection.members)
    if (leave_out(each, part)) kept.push_back(std::move(each));
  selection.members = std::move(kept);
  if (selection.kind == Selection::Kind::complement && selection.members.empty()) {
    constexpr double kFar = 1e30;  // m: a box of all elements, as they are all but those to come
    selection.kind = Selection::Kind::box;
    selection.min = Vec3::Constant(-kFar);
    selection.max = Vec3::Constant(kFar);
  }
  return selection.kind != Selection::Kind::any_of || !selection.members.empty();
}

template <class Entry>
void leave_out_of(std::vector<Entry>& entries, const std::string& part) {
  std::vector<Entry> kept;
  for (Entry& each : entries)
    if (leave_out(each.where, part)) kept.push_back(std::move(each));
  entries = std::move(kept);
}

}  // namespace

EffectParameters without_coming_parts(const Scene& scene, const Body& body) {
  EffectParameters parameters = scene.effects;
  const std::vector<std::string> here = part_names(body);
  for (const std::string& part : scene.coming_parts) {
    if (std::find(here.begin(), here.end(), part) != here.end()) continue;
    leave_out_of(parameters.get<Loads>().loads, part);
    leave_out_of(parameters.get<Supports>().ties, part);
    const auto names_it = [&](const std::array<std::string, 2>& parts) {
      return parts[0] == part || parts[1] == part;
    };
    std::erase_if(parameters.get<Bonds>().named,
                  [&](const Bonds::Named& each) { return names_it(each.parts); });
    std::erase_if(parameters.get<Contact>().bonded, names_it);
  }
  return parameters;
}

std::vector<Probe> without_coming_probes(const Scene& scene, const Body& body) {
  std::vector<Probe> probes = scene.probes;
  const std::vector<std::string> here = part_names(body);
  for (const std::string& part : scene.coming_parts) {
    if (std::find(here.begin(), here.end(), part) != here.end()) continue;
    for (Probe& probe : probes)
      if (probe.where && !leave_out(*probe.where, part)) probe.where.reset();
  }
  return probes;
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
