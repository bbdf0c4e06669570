// The attribute that colours a picture: the user's choice, checked against every file.
#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"
#include "flexel/picture/panel.h"

namespace flexel::picture {
namespace {

std::vector<std::string> names_of(const PictureSubject& subject, PictureOptions::Show show) {
  if (!subject.body) return surface_attribute_names(subject.surface);
  std::vector<std::string> names = body_attribute_names(*subject.body);
  if (show == PictureOptions::Show::surface)
    for (std::string& name : surface_attribute_names(subject.body->surface)) names.push_back(std::move(name));
  return names;
}

bool has_attribute(const PictureSubject& subject, PictureOptions::Show show, const std::string& name) {
  if (subject.body ? body_attribute(*subject.body, name).has_value()
                   : surface_attribute(subject.surface, name).has_value())
    return true;
  return subject.body && show == PictureOptions::Show::surface &&
         surface_attribute(subject.body->surface, name);
}

// What every subject has.
std::vector<std::string> common_names(const std::vector<PictureSubject>& subjects,
                                      PictureOptions::Show show) {
  std::vector<std::string> names = names_of(subjects.front(), show);
  std::erase_if(names, [&](const std::string& name) {
    return std::any_of(subjects.begin(), subjects.end(),
                       [&](const PictureSubject& s) { return !has_attribute(s, show, name); });
  });
  if (show != PictureOptions::Show::elements) names.emplace_back("thickness");
  names.emplace_back("none");
  return names;
}

}  // namespace

ColourBy colour_by(const std::vector<PictureSubject>& subjects, const PictureOptions& options) {
  if (!options.colour) {
    const auto is_deformed = [](const PictureSubject& s) { return s.body->position != s.body->rest; };
    const bool all = std::all_of(subjects.begin(), subjects.end(),
                                 [](const PictureSubject& s) { return s.body.has_value(); });
    const bool any = all && std::any_of(subjects.begin(), subjects.end(), is_deformed);
    return {any ? "displacement" : "", false};
  }
  const std::string& name = *options.colour;
  if (name == "none") return {};
  bool every = true;
  for (const PictureSubject& subject : subjects) {
    if (has_attribute(subject, options.show, name)) continue;
    every = false;
    if (name == "thickness" && options.show != PictureOptions::Show::elements) continue;
    const std::vector<std::string> names = common_names(subjects, options.show);
    throw InputError(subject.where, fmt::format("has no attribute \"{}\" to colour by{}; --color takes {}{}",
                                                name, subject.body ? no_stresses(*subject.body, name) : "",
                                                fmt::join(names, ", "), did_you_mean(name, names)));
  }
  return {name, !every};
}

}  // namespace flexel::picture
