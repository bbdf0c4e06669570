// Finds polygons by name and elements by region. A name is looked up in this order: "part/number" and
// "part/name" of a face, "part/side", the name of a part, a side of the whole body, the name of a face or
// group of any part.
//
// A side is the set of polygons that lie within 1e-3 of the body's extent of the extreme and face that way
// within 45 degrees. Where no polygon lies there whole (the end of a ball), those that reach it and face that
// way within 60 degrees are taken.
#include "simulate/selection.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <charconv>
#include <optional>

#include "formats/area_vector.h"
#include "formats/error.h"
#include "formats/program.h"
#include "formats/units.h"

namespace flexel {
namespace {

constexpr double kSideTolerance = 1e-3;  // of the extent along the axis

struct Side {
  int axis;
  double sign;  // -1: min
};

std::optional<Side> side_of(const std::string& name) {
  if (name.size() != 4 || name[0] < 'x' || name[0] > 'z') return std::nullopt;
  const std::string end = name.substr(1);
  if (end == "min") return Side{name[0] - 'x', -1};
  if (end == "max") return Side{name[0] - 'x', 1};
  return std::nullopt;
}

// Polygons of the parts for which `part` is empty or equal, at the extreme of those parts.
std::vector<std::uint32_t> polygons_of_side(const Surface& surface, Side side,
                                            std::optional<std::uint32_t> part) {
  double low = 1e300, high = -1e300;
  const auto height = [&](std::uint32_t vertex) { return side.sign * surface.vertices[vertex][side.axis]; };
  const auto wanted = [&](std::size_t p) { return !part || surface.polygon_part(p) == *part; };
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    if (!wanted(p)) continue;
    for (const std::uint32_t vertex : surface.polygon(p)) {
      low = std::min(low, height(vertex));
      high = std::max(high, height(vertex));
    }
  }
  const double limit = high - kSideTolerance * (high - low);
  const auto collect = [&](bool whole, double least_cosine, bool inside_out = false) {
    std::vector<std::uint32_t> found;
    for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
      if (!wanted(p)) continue;
      const auto corners = surface.polygon(p);
      const auto reaches = [&](std::uint32_t vertex) { return height(vertex) >= limit; };
      if (!(whole ? std::all_of(corners.begin(), corners.end(), reaches)
                  : std::any_of(corners.begin(), corners.end(), reaches)))
        continue;
      const Vec3 area = area_vector(surface.vertices, corners);
      const double facing = inside_out ? std::abs(area[side.axis]) : side.sign * area[side.axis];
      if (area.norm() > 0 && facing >= least_cosine * area.norm())
        found.push_back(static_cast<std::uint32_t>(p));
    }
    return found;
  };
  std::vector<std::uint32_t> found = collect(true, 0.7);
  if (found.empty()) found = collect(false, 0.5);
  if (found.empty()) found = collect(true, 0.7, true);
  if (found.empty()) found = collect(false, 0.5, true);
  return found;
}

std::vector<std::uint32_t> polygons_of_faces(const Surface& surface,
                                             const std::vector<std::uint32_t>& faces) {
  std::vector<std::uint32_t> found;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (std::binary_search(faces.begin(), faces.end(), surface.polygon_face[p]))
      found.push_back(static_cast<std::uint32_t>(p));
  return found;
}

std::optional<std::uint32_t> part_named(const Body& body, const std::string& name) {
  for (std::size_t p = 0; p < body.parts.size(); ++p)
    if (body.parts[p].name == name) return static_cast<std::uint32_t>(p);
  return std::nullopt;
}

std::optional<std::uint32_t> number_in(const std::string& text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return number;
}

// Faces called `name` (or numbered so, within `part`); ascending.
std::vector<std::uint32_t> faces_called(const Surface& surface, const std::string& name,
                                        std::optional<std::uint32_t> part) {
  std::vector<std::uint32_t> found;
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  const std::optional<std::uint32_t> number = part ? number_in(name) : std::nullopt;
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f) {
    if (part && surface.faces[f].part != *part) continue;
    if (surface.faces[f].name == name || (number && numbers[f] == *number)) found.push_back(f);
  }
  return found;
}

std::vector<std::string> every_name(const Body& body) {
  std::vector<std::string> names;
  for (const char* side : {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}) names.emplace_back(side);
  for (const Part& part : body.parts) names.push_back(part.name);
  for (const SurfaceFace& face : body.surface.faces)
    if (!face.name.empty()) {
      names.push_back(face.name);
      names.push_back(body.parts[face.part].name + "/" + face.name);
    }
  return names;
}

[[noreturn]] void unknown_name(const Selection& selection, const Body& body) {
  const std::string& name = selection.name;
  const std::size_t slash = name.rfind('/');
  if (slash != std::string::npos) {
    if (const auto part = part_named(body, name.substr(0, slash))) {
      const auto count = std::count_if(body.surface.faces.begin(), body.surface.faces.end(),
                                       [&](const SurfaceFace& face) { return face.part == *part; });
      if (number_in(name.substr(slash + 1)))
        throw InputError(selection.origin, fmt::format("no face \"{}\"; part \"{}\" has faces 1 to {}", name,
                                                       body.parts[*part].name, count));
    } else {
      std::vector<std::string> parts;
      for (const Part& each : body.parts) parts.push_back(each.name);
      throw InputError(selection.origin, fmt::format("no part \"{}\" for \"{}\"; the body has {}",
                                                     name.substr(0, slash), name, fmt::join(parts, ", ")));
    }
  }
  std::string hint = did_you_mean(name, every_name(body));
  if (hint.empty()) {
    std::vector<std::string> parts;
    for (const Part& part : body.parts) parts.push_back('"' + part.name + '"');
    if (parts.size() > 6) parts.resize(6);
    hint = fmt::format(
        "; use a side (\"xmin\" to \"zmax\"), a part ({}) or a face (\"{}/1\"); `flexel info` lists them",
        fmt::join(parts, ", "), body.parts.empty() ? "part" : body.parts[0].name);
  }
  throw InputError(selection.origin, fmt::format("nothing is called \"{}\"{}", name, hint));
}

std::vector<std::uint32_t> range(std::uint32_t begin, std::uint32_t end) {
  std::vector<std::uint32_t> all(end - begin);
  for (std::uint32_t i = begin; i < end; ++i) all[i - begin] = i;
  return all;
}

Selected resolve_name(const Selection& selection, const Body& body) {
  const std::string& name = selection.name;
  if (const auto part = part_named(body, name))
    return {{}, range(body.parts[*part].element_begin, body.parts[*part].element_end)};
  if (const auto side = side_of(name)) return {polygons_of_side(body.surface, *side, std::nullopt), {}};
  // The part's own name may hold a slash: try every one.
  for (std::size_t slash = name.find('/'); slash != std::string::npos; slash = name.find('/', slash + 1)) {
    const auto part = part_named(body, name.substr(0, slash));
    if (!part) continue;
    const std::string rest = name.substr(slash + 1);
    const std::vector<std::uint32_t> faces = faces_called(body.surface, rest, part);
    if (!faces.empty()) return {polygons_of_faces(body.surface, faces), {}};
    if (const auto side = side_of(rest)) return {polygons_of_side(body.surface, *side, part), {}};
  }
  const std::vector<std::uint32_t> faces = faces_called(body.surface, name, std::nullopt);
  if (faces.empty()) unknown_name(selection, body);
  return {polygons_of_faces(body.surface, faces), {}};
}

bool holds(const Selection& selection, const Vec3& point) {
  switch (selection.kind) {
    case Selection::Kind::box:
      return (point.array() >= selection.min.array()).all() && (point.array() <= selection.max.array()).all();
    case Selection::Kind::sphere:
      return (point - selection.point).squaredNorm() <= selection.radius * selection.radius;
    default:
      return selection.normal.dot(point - selection.point) >= 0;
  }
}

Selected resolve_region(const Selection& selection, const std::vector<Vec3>& at) {
  Selected selected;
  for (std::uint32_t e = 0; e < at.size(); ++e)
    if (holds(selection, at[e])) selected.elements.push_back(e);
  if (selected.elements.empty()) {
    const Box box = bounding_box(at);
    throw InputError(
        selection.origin,
        fmt::format("the {} holds no element; the elements lie from ({}, {}, {}) to ({}, {}, {})",
                    describe(selection), human_length(box.min.x()), human_length(box.min.y()),
                    human_length(box.min.z()), human_length(box.max.x()), human_length(box.max.y()),
                    human_length(box.max.z())));
  }
  return selected;
}

std::vector<std::uint32_t> united(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::vector<std::uint32_t> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

std::vector<std::uint32_t> without(std::size_t count, const std::vector<std::uint32_t>& left_out) {
  if (left_out.empty()) return {};
  const std::vector<std::uint32_t> all = range(0, static_cast<std::uint32_t>(count));
  std::vector<std::uint32_t> rest;
  std::set_difference(all.begin(), all.end(), left_out.begin(), left_out.end(), std::back_inserter(rest));
  return rest;
}

}  // namespace

Selection select_by_name(std::string name, std::string origin) {
  Selection selection;
  selection.name = std::move(name);
  selection.origin = std::move(origin);
  return selection;
}

std::string describe(const Selection& selection) {
  switch (selection.kind) {
    case Selection::Kind::name:
      return selection.name;
    case Selection::Kind::box:
      return "box";
    case Selection::Kind::sphere:
      return "sphere";
    case Selection::Kind::half_space:
      return "half-space";
    case Selection::Kind::complement:
      return "all but " + describe(selection.members.front());
    case Selection::Kind::any_of:
      break;
  }
  std::vector<std::string> members;
  for (const Selection& member : selection.members) members.push_back(describe(member));
  return fmt::format("{}", fmt::join(members, " + "));
}

Selected resolve(const Selection& selection, const Body& body, const std::vector<Vec3>* at) {
  switch (selection.kind) {
    case Selection::Kind::name: {
      Selected selected = resolve_name(selection, body);
      if (selected.polygons.empty() && selected.elements.empty())
        throw InputError(selection.origin, fmt::format("\"{}\" selects nothing", selection.name));
      return selected;
    }
    case Selection::Kind::any_of: {
      Selected all;
      for (const Selection& member : selection.members) {
        const Selected one = resolve(member, body, at);
        all = {united(all.polygons, one.polygons), united(all.elements, one.elements)};
      }
      return all;
    }
    case Selection::Kind::complement: {
      const Selected out = resolve(selection.members.front(), body, at);
      Selected rest = {without(body.surface.polygon_count(), out.polygons),
                       without(body.element_count(), out.elements)};
      if (rest.polygons.empty() && rest.elements.empty())
        throw InputError(selection.origin, "\"not\" leaves nothing: what it names is everything");
      return rest;
    }
    default:
      return resolve_region(selection, at ? *at : body.rest);
  }
}

}  // namespace flexel
