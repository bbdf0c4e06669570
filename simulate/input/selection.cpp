// Finds polygons by name and elements by region. Where no part has a name, the assemblies of the file are asked: "gearbox",
// "gearbox/shaft-2", or any run of such names, each for all parts in it. What Flexel itself calls faces ("part/2", sides: "xmin",
// "part/xmin") and what the file calls them ("part/flange", "flange") is looked up in both; a name that means
// one thing there and another here is refused, and "#" or "=" before its last word says which.
//
// A side is the set of polygons that lie within 1e-3 of the body's extent of the extreme and face that way
// within 45 degrees. Where no polygon lies there whole (the end of a ball), those that reach it and face that
// way within 60 degrees are taken.
#include "simulate/input/selection.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <charconv>
#include <optional>

#include "base/error.h"
#include "base/math/area_vector.h"
#include "base/nearest_word.h"
#include "base/units.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/input/part_names.h"
#include "simulate/input/side_places.h"

namespace flexel::simulate {
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

// The parts that are meant, ascending; nothing: all.
using Parts = std::optional<std::vector<std::uint32_t>>;

bool among(const Parts& parts, std::uint32_t part) {
  return !parts || std::binary_search(parts->begin(), parts->end(), part);
}

// m, where sides are told by.
std::vector<Vec3> side_places(const Surface& surface) {
  const auto found = surface.vertex_columns.find(kSidePlacesColumn);
  if (found == surface.vertex_columns.end()) return surface.vertices;
  std::vector<Vec3> places(surface.vertices.size());
  for (std::size_t v = 0; v < places.size(); ++v) places[v] = Vec3(&found->second.values[3 * v]);
  return places;
}

// Polygons of `parts` at the extreme of these together.
std::vector<std::uint32_t> polygons_of_side(const Surface& surface, Side side, const Parts& parts) {
  double low = 1e300, high = -1e300;
  const std::vector<Vec3> places = side_places(surface);
  const auto height = [&](std::uint32_t vertex) { return side.sign * places[vertex][side.axis]; };
  const auto wanted = [&](std::size_t p) { return among(parts, surface.polygon_part(p)); };
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
      const Vec3 area = area_vector(places, corners);
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

// Nothing where there is none.
Parts called(const Body& body, const std::string& name) {
  std::vector<std::uint32_t> parts = parts_called(body, name);
  return parts.empty() ? Parts() : parts;
}

std::optional<std::uint32_t> number_in(const std::string& text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return number;
}

// The last word of a name, and who calls it so.
struct Word {
  enum class By { either, flexel, file };
  By by = By::either;  // "#2", "#xmin": numbers and sides; "=2": names of the file
  std::string text;
};

Word parse_word(const std::string& text) {
  if (!text.empty() && text.front() == '#') return {Word::By::flexel, text.substr(1)};
  if (!text.empty() && text.front() == '=') return {Word::By::file, text.substr(1)};
  return {Word::By::either, text};
}

// Polygons that the file calls so, of all parts or one.
std::vector<std::uint32_t> polygons_of_file(const Surface& surface, const Word& word, const Parts& parts) {
  std::vector<std::uint32_t> faces;
  if (word.by == Word::By::flexel || word.text.empty()) return faces;  // a face without a name has no name
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (among(parts, surface.faces[f].part) && surface.faces[f].name == word.text) faces.push_back(f);
  return polygons_of_faces(surface, faces);
}

// Polygons that Flexel calls so: a side of all parts or of one, a face of one part by its number.
std::vector<std::uint32_t> polygons_of_flexel(const Surface& surface, const Word& word, const Parts& parts) {
  if (word.by == Word::By::file) return {};
  if (const auto side = side_of(word.text)) return polygons_of_side(surface, *side, parts);
  const bool one = parts && parts->size() == 1;
  const std::optional<std::uint32_t> number = one ? number_in(word.text) : std::nullopt;
  if (!number) return {};
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f < surface.faces.size(); ++f)
    if (surface.faces[f].part == parts->front() && numbers[f] == *number) faces.push_back(f);
  return polygons_of_faces(surface, faces);
}

// The polygons of the word, which must not mean two things. `before`: "part/", or nothing.
std::vector<std::uint32_t> polygons_called(const Selection& selection, const Surface& surface,
                                           const std::string& before, const std::string& text,
                                           const Parts& parts) {
  const Word word = parse_word(text);
  std::vector<std::uint32_t> own = polygons_of_flexel(surface, word, parts);
  std::vector<std::uint32_t> named = polygons_of_file(surface, word, parts);
  if (word.by != Word::By::either && named.empty())  // the file's name may begin so
    named = polygons_of_file(surface, {Word::By::file, text}, parts);
  if (!own.empty() && !named.empty() && own != named)
    throw InputError(
        selection.origin,
        fmt::format("\"{0}{1}\" means two things: {2}, and the face or group that the file calls "
                    "\"{1}\"; write \"{0}#{3}\" for the first, \"{0}={1}\" for the second",
                    before, text,
                    side_of(word.text) ? "the side of that name"
                                       : fmt::format("face number {} of `flexel info`", word.text),
                    word.text));
  return own.empty() ? named : own;
}

std::vector<std::string> every_name(const Body& body) {
  std::vector<std::string> names;
  for (const char* side : {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}) {
    names.emplace_back(side);
    for (const Part& part : body.parts) names.push_back(part.name + "/" + side);
  }
  for (const Part& part : body.parts) names.push_back(part.name);
  for (const SurfacePart& part : body.surface.parts)
    for (std::size_t end = 0; !part.assembly.empty(); ++end) {
      end = part.assembly.find('/', end);
      names.push_back(part.assembly.substr(0, end));
      if (end == std::string::npos) break;
    }
  for (const SurfaceFace& face : body.surface.faces)
    if (!face.name.empty()) {
      names.push_back(face.name);
      names.push_back(body.parts[face.part].name + "/" + face.name);
    }
  return names;
}

// A side that is there, and yet holds nothing.
void refuse_pointed_side(const Selection& selection) {
  const std::string last = selection.name.substr(selection.name.rfind('/') + 1);
  if (const auto side = side_of(parse_word(last).text))
    throw InputError(
        selection.origin,
        fmt::format("\"{0}\" holds no face: the part ends there in a point or an edge, and nothing "
                    "faces {1}{2}; take the elements of a box = {{ min = ..., max = ... }} there, or "
                    "a face by its number (`flexel info`)",
                    selection.name, side->sign < 0 ? '-' : '+', "xyz"[side->axis]));
}

[[noreturn]] void unknown_name(const Selection& selection, const Body& body) {
  const std::string& name = selection.name;
  const std::size_t slash = name.rfind('/');
  if (slash == std::string::npos || called(body, name.substr(0, slash))) refuse_pointed_side(selection);
  if (slash != std::string::npos) {
    if (const Parts parts = called(body, name.substr(0, slash))) {
      const std::uint32_t part = parts->front();
      const auto count = std::count_if(body.surface.faces.begin(), body.surface.faces.end(),
                                       [&](const SurfaceFace& face) { return face.part == part; });
      const bool number = number_in(parse_word(name.substr(slash + 1)).text).has_value();
      if (number && parts->size() > 1)
        throw InputError(selection.origin,
                         fmt::format("no face \"{}\"; \"{}\" is {} parts: name one of them, as {}/1", name,
                                     name.substr(0, slash), parts->size(), body.parts[part].name));
      if (number)
        throw InputError(selection.origin, fmt::format("no face \"{}\"; part \"{}\" has faces 1 to {}", name,
                                                       body.parts[part].name, count));
    } else {
      throw InputError(selection.origin,
                       fmt::format("no part \"{}\" for \"{}\"; the body has {}", name.substr(0, slash), name,
                                   fmt::join(part_names(body), ", ")));
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

// The elements of all parts at a path.
std::vector<std::uint32_t> elements_at(const Body& body, const std::string& path) {
  std::vector<std::uint32_t> elements;
  for (const std::uint32_t p : parts_at(body.surface.parts, path))
    for (std::uint32_t e = body.parts[p].element_begin; e < body.parts[p].element_end; ++e)
      elements.push_back(e);
  std::sort(elements.begin(), elements.end());
  return elements;
}

Selected resolve_name(const Selection& selection, const Body& body) {
  const std::string& name = selection.name;
  const Word whole = parse_word(name);
  std::optional<std::uint32_t> part = part_named(body, name);
  if (!part && whole.by == Word::By::file) part = part_named(body, whole.text);
  if (part) {
    if (whole.by == Word::By::either && !parts_at(body.surface.parts, name).empty())
      throw InputError(
          selection.origin,
          fmt::format("\"{0}\" means two things: a part and an assembly; write \"={0}\" for the part, "
                      "the parts one by one for the assembly",
                      name));
    if (side_of(name))
      throw InputError(selection.origin,
                       fmt::format("\"{0}\" means two things: a part and a side; write \"={0}\" "
                                   "for the part, \"#{0}\" for the side",
                                   name));
    return {{}, range(body.parts[*part].element_begin, body.parts[*part].element_end)};
  }
  std::vector<std::uint32_t> found = polygons_called(selection, body.surface, "", name, std::nullopt);
  // The part's own name may hold a slash: try every one.
  for (std::size_t slash = name.find('/'); slash != std::string::npos; slash = name.find('/', slash + 1)) {
    const Parts parts = called(body, name.substr(0, slash));
    if (!parts) continue;
    if (slash + 1 == name.size())
      throw InputError(
          selection.origin,
          fmt::format("\"{0}\" names no face: write \"{0}1\" for a face, \"{0}xmin\" for a side, "
                      "\"{1}\" for the whole part",
                      name, name.substr(0, slash)));
    const std::vector<std::uint32_t> of_parts =
        polygons_called(selection, body.surface, name.substr(0, slash + 1), name.substr(slash + 1), parts);
    if (!found.empty() && !of_parts.empty() && found != of_parts)
      throw InputError(
          selection.origin,
          fmt::format("\"{}\" means two things: names with a slash can be split in two ways here; "
                      "rename a part or a group of the file",
                      name));
    if (!of_parts.empty()) found = of_parts;
  }
  const std::vector<std::uint32_t> elements = elements_at(body, name);
  if (!found.empty() && !elements.empty())
    throw InputError(
        selection.origin,
        fmt::format("\"{}\" means two things: an assembly or part, and a side, face or group; \"#\" or \"=\" "
                    "before its last word takes the second, the parts one by one make the first",
                    name));
  if (!elements.empty()) return {{}, elements};
  if (found.empty()) unknown_name(selection, body);
  return {found, {}};
}

// m^2, to the line from `a` to `b`.
double squared_distance(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 way = b - a, from = point - a;
  const double length = way.squaredNorm();
  const double share = length > 0 ? std::clamp(from.dot(way) / length, 0.0, 1.0) : 0;
  return (from - share * way).squaredNorm();
}

bool sweeps(const Selection& sphere, const Vec3& point, double radius) {
  for (std::size_t k = 1; k < sphere.members.size(); ++k)
    if (squared_distance(point, sphere.members[k - 1].point, sphere.members[k].point) <= radius * radius)
      return true;
  return false;
}

// m: a region holds elements on its border, which planes of the lattice often are, whatever rounding makes of their places:
// that of lattices that are turned, and of coordinates in single precision.
double border(const Vec3& point, double spacing) {
  constexpr double kOfSpacing = 1e-6, kOfPlace = 0x1p-22;
  return kOfSpacing * spacing + kOfPlace * point.cwiseAbs().maxCoeff();
}

bool holds(const Selection& selection, const Vec3& point, double spacing) {
  const double more = border(point, spacing);
  switch (selection.kind) {
    case Selection::Kind::box:
      return (point.array() >= selection.min.array() - more).all() &&
             (point.array() <= selection.max.array() + more).all();
    case Selection::Kind::sphere:
      if (!selection.members.empty()) return sweeps(selection, point, selection.radius + more);
      return (point - selection.point).norm() <= selection.radius + more;
    default:
      return selection.normal.dot(point - selection.point) >= -more;
  }
}

// Why a box between the elements of coarse cells holds none.
std::string between_elements(const Selection& selection, const Body& body) {
  if (selection.kind != Selection::Kind::box) return "";
  const double side = (selection.max - selection.min).minCoeff();
  double apart = 0;
  for (const Part& part : body.parts) apart = std::max(apart, part.lattice.spacing.maxCoeff());
  if (!(side < apart)) return "";
  return fmt::format(
      ", up to {} apart, and its shortest side is {}: a larger box or smaller cells may hold some",
      human_length(apart), human_length(side));
}

Selected resolve_region(const Selection& selection, const Body& body, const std::vector<Vec3>& at) {
  Selected selected;
  for (const Part& part : body.parts) {
    const double spacing = part.lattice.spacing.minCoeff();
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      if (holds(selection, at[e], spacing)) selected.elements.push_back(e);
  }
  if (!(over_pieces(static_cast<double>(selected.elements.size())) > 0)) {
    const Box box = other_pieces() ? other_pieces()->box() : bounding_box(at);
    throw EmptySelectionError(
        selection.origin,
        fmt::format("the {} holds no element; the elements lie from ({}, {}, {}) to ({}, {}, {}){}",
                    describe(selection), human_length(box.min.x()), human_length(box.min.y()),
                    human_length(box.min.z()), human_length(box.max.x()), human_length(box.max.y()),
                    human_length(box.max.z()), between_elements(selection, body)));
  }
  return selected;
}

std::vector<std::uint32_t> united(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::vector<std::uint32_t> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

std::vector<std::uint32_t> without(std::size_t count, const std::vector<std::uint32_t>& left_out) {
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

std::optional<Vec3> side_axis(const Selection& selection, const Body& body) {
  if (selection.kind != Selection::Kind::name || part_named(body, selection.name)) return std::nullopt;
  const std::size_t slash = selection.name.rfind('/');
  const std::string before = slash == std::string::npos ? "" : selection.name.substr(0, slash);
  if (slash != std::string::npos && parts_called(body, before).empty()) return std::nullopt;
  const Word word = parse_word(selection.name.substr(slash == std::string::npos ? 0 : slash + 1));
  const std::optional<Side> side = side_of(word.text);
  if (!side || word.by == Word::By::file) return std::nullopt;
  return side->sign * Vec3::Unit(side->axis);
}

std::string describe(const Selection& selection) {
  switch (selection.kind) {
    case Selection::Kind::name:
      return selection.name;
    case Selection::Kind::box:
      return "box";
    case Selection::Kind::sphere:
      return selection.members.empty() ? "sphere" : "swept sphere";
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
      Selected rest;
      if (!out.polygons.empty()) rest.polygons = without(body.surface.polygon_count(), out.polygons);
      if (over_pieces(static_cast<double>(out.elements.size())) > 0)
        rest.elements = without(body.element_count(), out.elements);
      if (!(over_pieces(static_cast<double>(rest.polygons.size() + rest.elements.size())) > 0))
        throw InputError(selection.origin, "\"not\" leaves nothing: what it names is everything");
      return rest;
    }
    default:
      return resolve_region(selection, body, at ? *at : body.rest);
  }
}

}  // namespace flexel::simulate
