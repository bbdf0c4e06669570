// Assemblies are those that the readers of the file found (SurfacePart::assembly): "gearbox/shaft-2".
#include "simulate/input/part_names.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/nearest_word.h"

namespace flexel::simulate {

std::vector<std::string> part_names(const Body& body) {
  std::vector<std::string> names;
  for (const Part& part : body.parts) names.push_back(part.name);
  return names;
}

std::vector<std::uint32_t> parts_at(const std::vector<SurfacePart>& parts, const std::string& path) {
  std::vector<std::uint32_t> found;
  const std::string wanted = "/" + path + "/";
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    const std::string whole = fmt::format("/{}/{}/", parts[p].assembly, parts[p].name);
    const std::size_t at = whole.find(wanted);
    if (!path.empty() && !parts[p].assembly.empty() && at < 1 + parts[p].assembly.size()) found.push_back(p);
  }
  return found;
}

std::vector<std::uint32_t> parts_called(const std::vector<std::string>& names,
                                        const std::vector<SurfacePart>& parts, const std::string& name) {
  const auto own = std::find(names.begin(), names.end(), name);
  if (own != names.end()) return {static_cast<std::uint32_t>(own - names.begin())};
  return parts_at(parts, name);
}

std::vector<std::uint32_t> parts_called(const Body& body, const std::string& name) {
  return parts_called(part_names(body), body.surface.parts, name);
}

std::size_t entry_width(const std::vector<std::string>& names, const std::vector<std::uint32_t>& parts,
                        const std::string& name) {
  return names[parts.front()] == name ? 0 : parts.size();
}

std::vector<std::uint32_t> require_parts(const Body& body, const std::string& name,
                                         const std::string& origin) {
  std::vector<std::uint32_t> found = parts_called(body, name);
  if (!found.empty()) return found;
  const std::vector<std::string> names = part_names(body);
  std::string hint = did_you_mean(name, names);
  if (hint.empty()) hint = fmt::format("; it has {}", fmt::join(names, ", "));
  throw InputError(origin, fmt::format("the body has no part \"{}\"{}", name, hint));
}

std::uint32_t require_part(const Body& body, const std::string& name, const std::string& origin) {
  const std::vector<std::uint32_t> found = require_parts(body, name, origin);
  if (found.size() > 1)
    throw InputError(
        origin, fmt::format("\"{}\" is an assembly of {} parts where one is needed: name it, as \"{}\"", name,
                            found.size(), body.parts[found.front()].name));
  return found.front();
}

}  // namespace flexel::simulate
