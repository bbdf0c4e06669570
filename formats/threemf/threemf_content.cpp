// An object that uses an extension which its file requires and which is not read, and one whose matter is not triangles,
// is refused. A row vector times a 4 x 3 matrix transforms a point in the file.
#include "formats/threemf/threemf_content.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <sstream>

#include "base/error.h"
#include "base/printable.h"
#include "base/stop.h"

namespace flexel {
namespace {

constexpr int kDeepest = 64;
constexpr std::size_t kMostInstances = 1'000'000;
constexpr double kMostRepeated = 20e6;  // triangles that repeat others

std::string normal_path(std::string_view path) {
  while (path.starts_with('/')) path.remove_prefix(1);
  return std::string(path);
}

// "beamlattice" of "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"; the namespace of
// another kind as it is.
std::string extension_name(std::string_view space) {
  constexpr std::string_view kOurs = "/3dmanufacturing/";
  const std::size_t at = space.find(kOurs);
  if (at == std::string_view::npos) return printable(space);
  const std::string_view name = space.substr(at + kOurs.size());
  return printable(name.substr(0, name.find('/')));
}

// Extensions that a reader of shapes may pass over, or that this one reads: prefix to name of all others that
// the model requires.
std::map<std::string, std::string> unread_extensions(const pugi::xml_node& model) {
  constexpr std::array<std::string_view, 4> kKnown = {"core", "production", "material", "trianglesets"};
  std::map<std::string, std::string> unread;
  std::istringstream prefixes{std::string(xml_value(model, "requiredextensions"))};
  for (std::string prefix; prefixes >> prefix;) {
    const std::string name = extension_name(model.attribute(("xmlns:" + prefix).c_str()).value());
    if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end())
      unread[prefix] = name.empty() ? prefix : name;
  }
  return unread;
}

// Whether the node, one of its attributes, or anything below it has the prefix. Elements may lie in one
// another without end, so nothing recurses.
bool uses_prefix(const pugi::xml_node& node, const std::string& prefix) {
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

ThreeMfTransform times(const ThreeMfTransform& outer, const ThreeMfTransform& inner) {
  ThreeMfTransform product;
  product.leftCols<3>() = outer.leftCols<3>() * inner.leftCols<3>();
  product.col(3) = outer.leftCols<3>() * inner.col(3) + outer.col(3);
  return product;
}

// The object that an item or a component of the model `file` shows.
std::pair<std::string, std::string> named_by(const pugi::xml_node& node, const std::string& file) {
  const std::string_view path = xml_value(node, "path");
  return {path.empty() ? file : normal_path(path), std::string(xml_value(node, "objectid"))};
}

std::uint32_t count_of(const pugi::xml_node& list, std::string_view name) {
  std::uint32_t count = 0;
  for_each_xml_child(list, name, [&](const pugi::xml_node&) { ++count; });
  return count;
}

// What is written is UTF-8, whatever came in.
void declare_utf8(pugi::xml_document& document) {
  for (const pugi::xml_node& node : document.children())
    if (node.type() == pugi::node_declaration)
      if (pugi::xml_attribute encoding = node.attribute("encoding")) encoding.set_value("UTF-8");
}

struct TextWriter final : pugi::xml_writer {
  std::string text;
  void write(const void* data, std::size_t size) override {
    text.append(static_cast<const char*>(data), size);
  }
};

}  // namespace

std::string_view local_name(std::string_view name) {
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

pugi::xml_attribute xml_attribute(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_attribute& found : node.attributes())
    if (local_name(found.name()) == name) return found;
  return {};
}

std::string_view xml_value(const pugi::xml_node& node, std::string_view name) {
  return xml_attribute(node, name).value();
}

pugi::xml_node xml_child(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_node& found : node.children())
    if (local_name(found.name()) == name) return found;
  return {};
}

std::string shown_text(std::string_view text) {
  return printable(text.substr(0, 40));
}

std::span<const std::pair<std::string_view, double>> threemf_units() {
  static constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {{{"millimeter", 1e-3},
                                                                                 {"micron", 1e-6},
                                                                                 {"centimeter", 1e-2},
                                                                                 {"inch", 0.0254},
                                                                                 {"foot", 0.3048},
                                                                                 {"meter", 1.0}}};
  return kUnits;
}

bool whole_number(std::string_view text, std::size_t limit, std::size_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && value < limit;
}

ThreeMfContent::ThreeMfContent(std::span<const std::byte> bytes, std::string where, ThreeMfText kept)
    : where_(std::move(where)), kept_(kept), archive_(bytes, where_) {
  const std::string root = root_model();
  root_ = &load(root);
  const pugi::xml_node build = xml_child(root_->node, "build");
  double triangles = 0;
  for_each_xml_child(build, "item",
                     [&](const pugi::xml_node& item) { triangles += unfolded(named_by(item, root), 0); });
  check_unfolded(triangles);
  for_each_xml_child(build, "item",
                     [&](const pugi::xml_node& item) { add_use(item, root, ThreeMfUse::kNone, 0); });
}

void ThreeMfContent::fail(const std::string& what) const {
  throw InputError(where_, what);
}

double ThreeMfContent::number(std::string_view text, const char* what) const {
  while (!text.empty() && (text.front() == ' ' || text.front() == '+')) text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool number = !text.empty() && end == text.data() + text.size();
  if (number && error == std::errc::result_out_of_range && text.find("e-") != std::string_view::npos)
    return 0;
  if (!number || error != std::errc{} || !std::isfinite(value))
    fail(fmt::format("{} \"{}\" is not a finite number", what, shown_text(text)));
  return value;
}

Vec3 ThreeMfContent::position(const pugi::xml_node& vertex, std::size_t number_in_mesh) const {
  constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
  Vec3 at;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string_view text = xml_value(vertex, kAxes[i]);
    double& value = at[static_cast<Eigen::Index>(i)];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
      value = number(text, fmt::format("vertex {}: coordinate", number_in_mesh).c_str());
  }
  return at;
}

// The model that the archive's relationships name.
std::string ThreeMfContent::root_model() {
  if (const auto entry = archive_.find("_rels/.rels")) {
    const Bytes bytes = archive_.read(*entry);
    pugi::xml_document document;
    document.load_buffer(bytes.data(), bytes.size());
    std::string found;
    for_each_xml_child(document.first_child(), "Relationship", [&](const pugi::xml_node& relation) {
      if (xml_value(relation, "Type").ends_with("/3dmodel") && found.empty())
        found = normal_path(xml_value(relation, "Target"));
    });
    if (!found.empty()) return found;
  }
  for (const ZipEntry& entry : archive_.entries())
    if (entry.name.ends_with(".model")) return entry.name;
  fail("is a ZIP archive, but no 3MF file: it holds no model");
}

ThreeMfModel& ThreeMfContent::load(const std::string& path) {
  const auto [found, added] = models_.try_emplace(path);
  ThreeMfModel& model = found->second;
  if (!added) return model;
  const auto entry = archive_.find(path);
  if (!entry) fail(fmt::format("is damaged: \"{}\" is not in the archive", printable(path)));
  model.path = path;
  model.entry = *entry;
  const Bytes bytes = archive_.read(*entry);
  const unsigned options = kept_ == ThreeMfText::all
                               ? unsigned{pugi::parse_full} | unsigned{pugi::parse_ws_pcdata}
                               : unsigned{pugi::parse_default};
  const pugi::xml_parse_result parsed = model.document.load_buffer(bytes.data(), bytes.size(), options);
  if (!parsed) fail(fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
  model.node = xml_child(model.document, "model");
  model.unread = unread_extensions(model.node);
  if (const double unit = unit_of(model.node); unit_ == 0)
    unit_ = unit;
  else if (unit != unit_ && !xml_value(model.node, "unit").empty())
    fail(fmt::format("\"{}\" in it has another unit than the model that shows it: write it in one unit",
                     printable(path)));
  for_each_xml_child(xml_child(model.node, "resources"), "object", [&](const pugi::xml_node& object) {
    model.objects.emplace(std::string(xml_value(object, "id")), object);
  });
  return model;
}

double ThreeMfContent::unit_of(const pugi::xml_node& model) const {
  const std::string_view unit = xml_value(model, "unit");
  if (unit.empty()) return threemf_units().front().second;
  for (const auto& [name, metres] : threemf_units())
    if (unit == name) return metres;
  fail(fmt::format("has the unknown unit \"{}\"", shown_text(unit)));
}

ThreeMfTransform ThreeMfContent::transform_of(const pugi::xml_node& node) const {
  ThreeMfTransform transform = ThreeMfTransform::Identity();
  std::string_view text = xml_value(node, "transform");
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

// Triangles of an object with all that its components show; each object is counted once.
double ThreeMfContent::unfolded(const Id& id, int depth) {
  const auto [known, added] = unfolded_.try_emplace(id, 0);  // 0 too for one that shows itself
  if (!added) return known->second;
  const ThreeMfModel& model = load(id.first);
  const auto found = model.objects.find(id.second);
  if (found == model.objects.end() || depth > kDeepest) return 0;  // add_use() says so
  const double own = count_of(xml_child(xml_child(found->second, "mesh"), "triangles"), "triangle");
  double sum = own;
  for_each_xml_child(
      xml_child(found->second, "components"), "component",
      [&](const pugi::xml_node& component) { sum += unfolded(named_by(component, id.first), depth + 1); });
  different_ += own;
  return known->second = sum;
}

// A few lines of components that show components can be more triangles than memory holds.
void ThreeMfContent::check_unfolded(double triangles) const {
  if (triangles - different_ > kMostRepeated)
    fail(
        fmt::format("shows the same objects again and again, with {:.3g} million triangles in all: it is "
                    "damaged, or made to fill the memory",
                    1e-6 * triangles));
}

void ThreeMfContent::add_use(const pugi::xml_node& shown_by, const std::string& file, std::size_t parent,
                             int depth) {
  if (depth > kDeepest || uses_.size() >= kMostInstances)
    fail("is damaged: its components contain one another, or are more than a million");
  check_stop();
  const Id id = named_by(shown_by, file);
  ThreeMfModel& model = load(id.first);
  const auto found = model.objects.find(id.second);
  if (found == model.objects.end())
    fail(fmt::format("is damaged: object \"{}\" is not in it", shown_text(id.second)));
  ThreeMfUse use;
  use.model = &model;
  use.object = found->second;
  use.shown_by = shown_by;
  use.parent = parent;
  use.transform = transform_of(shown_by);
  if (parent != ThreeMfUse::kNone) use.transform = times(uses_[parent].transform, use.transform);
  const std::size_t own = uses_.size();
  uses_.push_back(use);
  const std::string name = name_of(own);
  check_readable(uses_[own], name.empty() ? id.second : name);
  add_mesh(uses_[own]);
  for_each_xml_child(xml_child(found->second, "components"), "component",
                     [&](const pugi::xml_node& component) { add_use(component, id.first, own, depth + 1); });
}

void ThreeMfContent::add_mesh(ThreeMfUse& use) {
  const pugi::xml_node mesh = xml_child(use.object, "mesh");
  use.mirrored = use.transform.leftCols<3>().determinant() < 0;
  use.vertices = count_of(xml_child(mesh, "vertices"), "vertex");
  use.triangles = count_of(xml_child(mesh, "triangles"), "triangle");
  use.first_vertex = static_cast<std::uint32_t>(vertices_);
  use.first_triangle = static_cast<std::uint32_t>(triangles_);
  vertices_ += use.vertices;
  triangles_ += use.triangles;
  if (vertices_ > 0xffffffffu) fail("holds too many vertices");
  if (3 * triangles_ > 0xffffffffu) fail("holds too many triangles");
}

std::string ThreeMfContent::name_of(std::size_t use) const {
  for (std::size_t each = use;; each = uses_[each].parent) {
    const std::string_view name = xml_value(uses_[each].object, "name");
    if (name.find_first_not_of(" \t\r\n") != std::string_view::npos) return std::string(name);
    if (uses_[each].parent == ThreeMfUse::kNone)
      return std::string(xml_value(uses_[each].shown_by, "partnumber"));
  }
}

// An object is its triangles, or its components, and nothing else that has matter.
void ThreeMfContent::check_readable(const ThreeMfUse& use, const std::string& name) const {
  constexpr const char* kCure = "export the part as a triangle mesh, or leave the object out of the build";
  const pugi::xml_node mesh = xml_child(use.object, "mesh");
  if (const pugi::xml_node beams = xml_child(xml_child(mesh, "beamlattice"), "beams"))
    fail(
        fmt::format("object \"{}\" is a lattice of {} beams (extension \"beamlattice\"), and only triangles "
                    "are read: {}",
                    printable(name), count_of(beams, "beam"), kCure));
  for (const auto& [prefix, extension] : use.model->unread)
    if (uses_prefix(use.object, prefix))
      fail(
          fmt::format("object \"{}\" uses the extension \"{}\", which the file requires and which is not "
                      "read: {}",
                      printable(name), extension, kCure));
  if (xml_child(xml_child(mesh, "triangles"), "triangle") ||
      xml_child(xml_child(use.object, "components"), "component"))
    return;
  std::string instead;
  for (const pugi::xml_node& found : use.object.children())
    if (found.type() == pugi::node_element && local_name(found.name()) != "mesh" &&
        local_name(found.name()) != "metadatagroup")
      instead = fmt::format(", only a \"{}\"", shown_text(local_name(found.name())));
  fail(fmt::format("object \"{}\" has no triangles{}: {}", printable(name), instead, kCure));
}

Bytes ThreeMfContent::packed() {
  std::map<std::size_t, ThreeMfModel*> changed;
  for (auto& [path, model] : models_)
    if (model.changed) changed[model.entry] = &model;
  ZipWriter writer;
  for (std::size_t i = 0; i < archive_.entries().size(); ++i) {
    check_stop();
    const auto found = changed.find(i);
    if (found == changed.end()) {
      writer.copy(archive_, i);
      continue;
    }
    declare_utf8(found->second->document);
    TextWriter text;
    const bool declared = found->second->document.first_child().type() == pugi::node_declaration;
    found->second->document.save(text, "", pugi::format_raw | (declared ? 0u : pugi::format_no_declaration),
                                 pugi::encoding_utf8);
    writer.replace(archive_, i, text.text);
  }
  return writer.finish();
}

}  // namespace flexel
