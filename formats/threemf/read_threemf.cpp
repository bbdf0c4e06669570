// 3MF (3MF Consortium, "3D Manufacturing Format, Core Specification", 1.3): XML in a ZIP archive. Read with
// libzip and pugixml; lib3mf, the format's own library, keeps coordinates in single precision
// (docs/reference/surfaces.md). Every mesh that the build shows is a part, an object shown twice two parts. Read of the
// extensions: colour groups (materials), and meshes in other files of the archive (production). An object
// that uses another extension which its file requires, and one whose matter is not triangles, is refused. A
// row vector times a 4 x 3 matrix transforms a point.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/stop.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"
#include "formats/threemf/zip.h"

namespace flexel {
namespace {

using Transform = Eigen::Matrix<double, 3, 4>;  // column vectors
using Rgba = std::array<double, 4>;
using Id = std::pair<std::string, std::string>;  // the model file in the archive, and the id in it

constexpr int kDeepest = 64;
constexpr std::size_t kMostInstances = 1'000'000;
constexpr double kMostRepeated = 20e6;  // triangles that repeat others

// "m:color" is "color": prefixes differ from writer to writer.
std::string_view local(std::string_view name) {
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

std::string_view attribute(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_attribute& found : node.attributes())
    if (local(found.name()) == name) return found.value();
  return {};
}

pugi::xml_node child(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_node& found : node.children())
    if (local(found.name()) == name) return found;
  return {};
}

template <class Work>
void for_each_child(const pugi::xml_node& node, std::string_view name, const Work& work) {
  for (const pugi::xml_node& found : node.children())
    if (local(found.name()) == name) work(found);
}

std::string normal_path(std::string_view path) {
  while (path.starts_with('/')) path.remove_prefix(1);
  return std::string(path);
}

// "beamlattice" of "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"; the namespace of
// another kind as it is.
std::string extension_name(std::string_view space) {
  constexpr std::string_view kOurs = "/3dmanufacturing/";
  const std::size_t at = space.find(kOurs);
  if (at == std::string_view::npos) return clean_name(space);
  const std::string_view name = space.substr(at + kOurs.size());
  return clean_name(name.substr(0, name.find('/')));
}

// Extensions that a reader of shapes may pass over, or that this one reads: prefix to name of all others that
// the model requires.
std::map<std::string, std::string> unread_extensions(const pugi::xml_node& model) {
  constexpr std::array<std::string_view, 4> kKnown = {"core", "production", "material", "trianglesets"};
  std::map<std::string, std::string> unread;
  std::istringstream prefixes{std::string(attribute(model, "requiredextensions"))};
  for (std::string prefix; prefixes >> prefix;) {
    const std::string name = extension_name(model.attribute(("xmlns:" + prefix).c_str()).value());
    if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end())
      unread[prefix] = name.empty() ? prefix : name;
  }
  return unread;
}

// Whether the node, one of its attributes, or anything below it has the prefix. Elements may lie in one
// another without end, so nothing recurses.
bool uses(const pugi::xml_node& node, const std::string& prefix) {
  const auto has = [&](std::string_view name) { return name.starts_with(prefix + ":"); };
  const auto has_itself = [&](const pugi::xml_node& one) {
    return has(one.name()) || std::any_of(one.attributes_begin(), one.attributes_end(),
                                          [&](const auto& found) { return has(found.name()); });
  };
  std::vector<pugi::xml_node> pending = {node};
  while (!pending.empty()) {
    const pugi::xml_node one = pending.back();
    pending.pop_back();
    if (has_itself(one)) return true;
    for (const pugi::xml_node& below : one.children()) pending.push_back(below);
  }
  return false;
}

class ThreeMfReader {
 public:
  explicit ThreeMfReader(const ImportInput& input) : input_(input), archive_(input.bytes, input.where) {}

  // Tells `warn` what is a part that may not be meant as one.
  Surface read(const std::function<void(const std::string&)>& warn) {
    const std::string root = root_model();
    load(root);
    const pugi::xml_node model = models_.at(root).node;
    surface_.polygon_offsets.push_back(0);
    double triangles = 0;
    for_each_child(child(model, "build"), "item",
                   [&](const pugi::xml_node& item) { triangles += unfolded(named_by(item, root), 0); });
    check_unfolded(triangles);
    for_each_child(child(model, "build"), "item", [&](const pugi::xml_node& item) {
      add_object(named_by(item, root), transform_of(item), clean_name(attribute(item, "partnumber")), 0);
    });
    if (surface_.polygon_count() == 0) fail("builds no triangles: nothing to work on");
    for (Vec3& vertex : surface_.vertices) vertex *= unit_;
    if (warn && !supports_.empty())
      warn(fmt::format("\"{}\"{} is support material for the print, and a part like any other here",
                       *supports_.begin(),
                       supports_.size() > 1 ? fmt::format(" (one of {})", supports_.size()) : ""));
    if (colored_) surface_.polygon_columns[kColorColumn] = std::move(color_);
    assign_dihedral_faces(surface_, polygon_part_, welded_);
    surface_.sources.push_back(source_in_unit("3mf", unit_));
    return std::move(surface_);
  }

 private:
  // One .model file, parsed, and what can be named in it.
  struct Model {
    pugi::xml_document document;
    pugi::xml_node node;
    std::map<std::string, pugi::xml_node, std::less<>> objects;
    std::map<std::string, std::vector<Rgba>, std::less<>> colors;  // of a group, by index
    std::map<std::string, std::string> unread;                     // unread_extensions()
  };

  [[noreturn]] void fail(const std::string& what) const { throw InputError(input_.where, what); }

  double number(std::string_view text, const char* what) const {
    while (!text.empty() && (text.front() == ' ' || text.front() == '+')) text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool number = !text.empty() && end == text.data() + text.size();
    if (number && error == std::errc::result_out_of_range && text.find("e-") != std::string_view::npos)
      return 0;
    if (!number || error != std::errc{} || !std::isfinite(value))
      fail(fmt::format("{} \"{}\" is not a finite number", what, clean_name(text.substr(0, 40))));
    return value;
  }

  // True where the text is a whole number below `limit`.
  static bool index(std::string_view text, std::size_t limit, std::size_t& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} && end == text.data() + text.size() && value < limit;
  }

  // The model that the archive's relationships name.
  [[nodiscard]] std::string root_model() {
    if (const auto bytes = archive_.read("_rels/.rels")) {
      pugi::xml_document document;
      document.load_buffer(bytes->data(), bytes->size());
      std::string found;
      for_each_child(document.first_child(), "Relationship", [&](const pugi::xml_node& relation) {
        if (attribute(relation, "Type").ends_with("/3dmodel") && found.empty())
          found = normal_path(attribute(relation, "Target"));
      });
      if (!found.empty()) return found;
    }
    for (const std::string& name : archive_.names())
      if (name.ends_with(".model")) return name;
    fail("is a ZIP archive, but no 3MF file: it holds no model");
  }

  const Model& load(const std::string& path) {
    const auto [entry, added] = models_.try_emplace(path);
    Model& model = entry->second;
    if (!added) return model;
    const auto bytes = archive_.read(path);
    if (!bytes) fail(fmt::format("is damaged: \"{}\" is not in the archive", clean_name(path)));
    const pugi::xml_parse_result parsed = model.document.load_buffer(bytes->data(), bytes->size());
    if (!parsed) fail(fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
    model.node = child(model.document, "model");
    model.unread = unread_extensions(model.node);
    if (const double unit = unit_of(model.node); unit_ == 0)
      unit_ = unit;
    else if (unit != unit_ && !attribute(model.node, "unit").empty())
      fail(fmt::format("\"{}\" in it has another unit than the model that shows it: write it in one unit",
                       clean_name(path)));
    const pugi::xml_node resources = child(model.node, "resources");
    for (const pugi::xml_node& resource : resources.children()) {
      const std::string id(attribute(resource, "id"));
      const std::string_view name = local(resource.name());
      if (name == "object") model.objects.emplace(id, resource);
      if (name == "basematerials") model.colors[id] = colors_of(resource, "base", "displaycolor");
      if (name == "colorgroup") model.colors[id] = colors_of(resource, "color", "color");
    }
    return model;
  }

  // "#RRGGBB" or "#RRGGBBAA"; opaque white where it is neither.
  static std::vector<Rgba> colors_of(const pugi::xml_node& group, std::string_view element,
                                     std::string_view name) {
    std::vector<Rgba> colors;
    for_each_child(group, element, [&](const pugi::xml_node& node) {
      const std::string_view text = attribute(node, name);
      Rgba color = {1, 1, 1, 1};
      for (std::size_t i = 0; text.starts_with('#') && i < (text.size() - 1) / 2 && i < 4; ++i) {
        unsigned value = 255;
        std::from_chars(text.data() + 1 + 2 * i, text.data() + 3 + 2 * i, value, 16);
        color[i] = value / 255.0;
      }
      colors.push_back(color);
    });
    return colors;
  }

  [[nodiscard]] double unit_of(const pugi::xml_node& model) const {
    constexpr std::pair<std::string_view, double> kUnits[] = {
        {"", 1e-3},       {"millimeter", 1e-3}, {"micron", 1e-6}, {"centimeter", 1e-2},
        {"inch", 0.0254}, {"foot", 0.3048},     {"meter", 1.0}};
    const std::string_view unit = attribute(model, "unit");
    for (const auto& [name, metres] : kUnits)
      if (unit == name) return metres;
    fail(fmt::format("has the unknown unit \"{}\"", clean_name(unit.substr(0, 40))));
  }

  [[nodiscard]] Transform transform_of(const pugi::xml_node& node) const {
    Transform transform = Transform::Identity();
    std::string_view text = attribute(node, "transform");
    if (text.empty()) return transform;
    for (Eigen::Index i = 0; i < 12; ++i) {
      const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
      text.remove_prefix(begin);
      const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
      transform(i % 3, i / 3) = number(text.substr(0, end), "a transform's");
      text.remove_prefix(end);
    }
    return transform;
  }

  static Transform times(const Transform& outer, const Transform& inner) {
    Transform product;
    product.leftCols<3>() = outer.leftCols<3>() * inner.leftCols<3>();
    product.col(3) = outer.leftCols<3>() * inner.col(3) + outer.col(3);
    return product;
  }

  // The object that an item or a component of the model `file` shows.
  static Id named_by(const pugi::xml_node& node, const std::string& file) {
    const std::string_view path = attribute(node, "path");
    return {path.empty() ? file : normal_path(path), std::string(attribute(node, "objectid"))};
  }

  void add_object(const Id& id, const Transform& transform, const std::string& fallback, int depth) {
    if (depth > kDeepest || ++instances_ > kMostInstances)
      fail("is damaged: its components contain one another, or are more than a million");
    const Model& model = load(id.first);
    const auto found = model.objects.find(id.second);
    if (found == model.objects.end())
      fail(fmt::format("is damaged: object \"{}\" is not in it", clean_name(id.second)));
    const pugi::xml_node object = found->second;
    const std::string own = clean_name(attribute(object, "name"));
    const std::string& name = own.empty() ? fallback : own;
    check_readable(model, object, name.empty() ? id.second : name);
    if (const std::string_view type = attribute(object, "type"); type == "support" || type == "solidsupport")
      supports_.insert(name.empty() ? clean_name(id.second) : name);
    check_stop();
    if (const pugi::xml_node mesh = child(object, "mesh")) add_mesh(model, object, mesh, transform, name);
    for_each_child(child(object, "components"), "component", [&](const pugi::xml_node& component) {
      add_object(named_by(component, id.first), times(transform, transform_of(component)), name, depth + 1);
    });
  }

  // Triangles of an object with all that its components show; each object is counted once.
  double unfolded(const Id& id, int depth) {
    const auto [known, added] = unfolded_.try_emplace(id, 0);  // 0 too for one that shows itself
    if (!added) return known->second;
    const Model& model = load(id.first);
    const auto found = model.objects.find(id.second);
    if (found == model.objects.end() || depth > kDeepest) return 0;  // add_object() says so
    const auto triangles = child(child(found->second, "mesh"), "triangles").children();
    const auto own = static_cast<double>(std::distance(triangles.begin(), triangles.end()));
    double sum = own;
    for_each_child(child(found->second, "components"), "component", [&](const pugi::xml_node& component) {
      sum += unfolded(named_by(component, id.first), depth + 1);
    });
    different_ += own;
    return known->second = sum;
  }

  // A few lines of components that show components can be more triangles than memory holds.
  void check_unfolded(double triangles) const {
    if (triangles - different_ > kMostRepeated)
      fail(
          fmt::format("shows the same objects again and again, with {:.3g} million triangles in all: it is "
                      "damaged, or made to fill the memory",
                      1e-6 * triangles));
  }

  // An object is its triangles, or its components, and nothing else that has matter.
  void check_readable(const Model& model, const pugi::xml_node& object, const std::string& name) const {
    constexpr const char* kCure = "export the part as a triangle mesh, or leave the object out of the build";
    const pugi::xml_node mesh = child(object, "mesh");
    if (const pugi::xml_node beams = child(child(mesh, "beamlattice"), "beams"))
      fail(fmt::format(
          "object \"{}\" is a lattice of {} beams (extension \"beamlattice\"), and only triangles "
          "are read: {}",
          name, std::distance(beams.begin(), beams.end()), kCure));
    for (const auto& [prefix, extension] : model.unread)
      if (uses(object, prefix))
        fail(
            fmt::format("object \"{}\" uses the extension \"{}\", which the file requires and which is not "
                        "read: {}",
                        name, extension, kCure));
    if (child(child(mesh, "triangles"), "triangle") || child(child(object, "components"), "component"))
      return;
    std::string instead;
    for (const pugi::xml_node& found : object.children())
      if (local(found.name()) != "mesh" && local(found.name()) != "metadatagroup")
        instead = fmt::format(", only a \"{}\"", clean_name(local(found.name()).substr(0, 40)));
    fail(fmt::format("object \"{}\" has no triangles{}: {}", name, instead, kCure));
  }

  void add_mesh(const Model& model, const pugi::xml_node& object, const pugi::xml_node& mesh,
                const Transform& transform, const std::string& name) {
    const std::size_t first = surface_.vertices.size();
    std::vector<Vec3> own;
    for_each_child(child(mesh, "vertices"), "vertex", [&](const pugi::xml_node& vertex) {
      const std::string what = fmt::format("vertex {}: coordinate", own.size() + 1);
      const Vec3 at(number(attribute(vertex, "x"), what.c_str()),
                    number(attribute(vertex, "y"), what.c_str()),
                    number(attribute(vertex, "z"), what.c_str()));
      own.push_back(transform.leftCols<3>() * at + transform.col(3));
    });
    if (first + own.size() > 0xffffffffu) fail("holds too many vertices");
    const bool mirrored = transform.leftCols<3>().determinant() < 0;
    for_each_child(child(mesh, "triangles"), "triangle", [&](const pugi::xml_node& triangle) {
      add_triangle(triangle, first, own.size(), mirrored);
      add_color(model, object, triangle);
    });
    for (const std::uint32_t vertex : weld(own))
      welded_.push_back(static_cast<std::uint32_t>(first + vertex));
    surface_.vertices.insert(surface_.vertices.end(), own.begin(), own.end());
    surface_.parts.push_back({name});
  }

  void add_triangle(const pugi::xml_node& triangle, std::size_t first, std::size_t count, bool mirrored) {
    std::array<std::size_t, 3> corners{};
    constexpr std::array<const char*, 3> kNames = {"v1", "v2", "v3"};
    for (std::size_t i = 0; i < 3; ++i)
      if (!index(attribute(triangle, kNames[i]), count, corners[i]))
        fail(fmt::format("triangle {} names vertex \"{}\" (from 0), but there are only {}",
                         surface_.polygon_count() + 1,
                         clean_name(attribute(triangle, kNames[i]).substr(0, 20)), count));
    if (mirrored) std::swap(corners[1], corners[2]);
    for (const std::size_t corner : corners)
      surface_.polygon_vertices.push_back(static_cast<std::uint32_t>(first + corner));
    if (surface_.polygon_vertices.size() > 0xffffffffu) fail("holds too many triangles");
    surface_.polygon_offsets.push_back(static_cast<std::uint32_t>(surface_.polygon_vertices.size()));
    polygon_part_.push_back(static_cast<std::uint32_t>(surface_.parts.size()));
  }

  // The triangle's own colour (the mean of its corners'), else its object's, else white.
  void add_color(const Model& model, const pugi::xml_node& object, const pugi::xml_node& triangle) {
    const bool own = !attribute(triangle, "p1").empty();
    std::string_view group = attribute(triangle, "pid");
    if (group.empty()) group = attribute(object, "pid");
    std::array<std::string_view, 3> names;
    names.fill(own ? attribute(triangle, "p1") : attribute(object, "pindex"));
    if (own && !attribute(triangle, "p2").empty())
      names = {names[0], attribute(triangle, "p2"), attribute(triangle, "p3")};
    Rgba color = {1, 1, 1, 1};
    const auto colors = model.colors.find(group);
    std::array<std::size_t, 3> which{};
    const bool known = colors != model.colors.end() && index(names[0], colors->second.size(), which[0]) &&
                       index(names[1], colors->second.size(), which[1]) &&
                       index(names[2], colors->second.size(), which[2]);
    if (known) {
      colored_ = true;
      for (std::size_t i = 0; i < 4; ++i)
        color[i] = which[0] == which[1] && which[0] == which[2]
                       ? colors->second[which[0]][i]
                       : std::min(1.0, (colors->second[which[0]][i] + colors->second[which[1]][i] +
                                        colors->second[which[2]][i]) /
                                           3);
    }
    color_.values.insert(color_.values.end(), color.begin(), color.end());
  }

  const ImportInput& input_;
  ZipArchive archive_;
  std::map<std::string, Model> models_;
  Surface surface_;
  std::vector<std::uint32_t> polygon_part_, welded_;
  Column color_{4, {}};
  bool colored_ = false;
  double unit_ = 0;                 // m; 0: no model was read yet
  std::set<std::string> supports_;  // names of objects that hold the print up
  std::size_t instances_ = 0;
  std::map<Id, double> unfolded_;  // triangles
  double different_ = 0;           // triangles of the objects in unfolded_, each counted once
};

Evidence sniff_3mf(const ImportInput& input) {
  return beginning(input).starts_with("PK\x03\x04") ? Evidence::magic : Evidence::none;
}

Surface read_3mf(ImportInput& input, const ImportOptions& options) {
  if (options.unit) throw InputError(input.where, "a 3MF file carries its own unit: leave out --unit");
  return ThreeMfReader(input).read(options.warn);
}

}  // namespace

constinit const FileReader k3mfReader{.format = &k3mfFormat, .sniff = sniff_3mf, .read = read_3mf};

}  // namespace flexel
