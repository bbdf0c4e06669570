// An instance is turned by rx, ry and rz degrees about x, then y, then z, and then displaced.
#include "meshes/amf_reader.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <pugixml.hpp>
#include <set>

#include "base/error.h"
#include "formats/common/readers.h"
#include "formats/threemf/zip.h"
#include "meshes/mesh_builder.h"

namespace flexel::meshes {
namespace {

constexpr std::size_t kMostInstances = 100'000;
constexpr int kDeepestConstellation = 64;

std::string short_text(std::string_view text) {
  return clean_name(text.substr(0, 60));
}

double number_in(const pugi::xml_node& parent, const char* name, double otherwise, const std::string& where) {
  std::string_view text = parent.child(name).text().get();
  while (!text.empty() &&
         (std::isspace(static_cast<unsigned char>(text.front())) != 0 || text.front() == '+'))
    text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
  if (text.empty()) return otherwise;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw InputError(where, fmt::format("<{}> \"{}\" is not a finite number", name, short_text(text)));
  return value;
}

// "feet" and "microns" are what programs write too; mm where nothing is said.
double amf_unit(const pugi::xml_node& amf, const std::string& where) {
  constexpr std::pair<std::string_view, double> kUnits[] = {
      {"", 1e-3},       {"millimeter", 1e-3}, {"inch", 0.0254}, {"feet", 0.3048},
      {"foot", 0.3048}, {"meter", 1},         {"micron", 1e-6}, {"micrometer", 1e-6}};
  std::string unit = amf.attribute("unit").value();
  for (char& c : unit) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& [name, metres] : kUnits)
    if (unit == name) return metres;
  throw InputError(where, fmt::format("has the unknown unit \"{}\"", short_text(unit)));
}

class AmfReader {
 public:
  AmfReader(const pugi::xml_node& amf, const std::string& where) : amf_(amf), where_(where), mesh_(where) {
    for (const pugi::xml_node& object : amf.children("object")) add_id(objects_, object, "objects");
    for (const pugi::xml_node& each : amf.children("constellation")) {
      add_id(constellations_, each, "constellations");
      for (const pugi::xml_node& instance : each.children("instance"))
        used_.insert(instance.attribute("objectid").value());
    }
    for (const pugi::xml_node& material : amf.children("material"))
      materials_[material.attribute("id").value()] = color_of(material);
  }

  // Constellations that no other shows, and objects that none does, in the order of the file.
  ForeignMesh read() {
    for (const auto& [id, object] : objects_)
      if (constellations_.count(id) > 0)
        fail(fmt::format("an object and a constellation have the id \"{}\"", short_text(id)));
    for (const pugi::xml_node& node : amf_.children()) {
      const bool used = used_.count(node.attribute("id").value()) > 0;
      if (!used && std::string_view(node.name()) == "object") add_object(node, Eigen::Affine3d::Identity());
      if (!used && std::string_view(node.name()) == "constellation")
        show(node, Eigen::Affine3d::Identity(), 0);
    }
    if (shown_.size() < constellations_.size()) fail("its constellations contain one another");
    return mesh_.finish(amf_unit(amf_, where_));
  }

  bool curved = false, vertex_colors = false, hidden = false, support = false;  // there were such

 private:
  using Nodes = std::map<std::string, pugi::xml_node>;

  [[noreturn]] void fail(const std::string& why) const { throw InputError(where_, "is damaged: " + why); }

  void add_id(Nodes& nodes, const pugi::xml_node& node, const char* what) const {
    const std::string id = node.attribute("id").value();
    if (!nodes.emplace(id, node).second) fail(fmt::format("two {} have the id \"{}\"", what, short_text(id)));
  }

  [[nodiscard]] std::optional<Rgba> color_of(const pugi::xml_node& parent) const {
    const pugi::xml_node color = parent.child("color");
    if (!color) return std::nullopt;
    return Rgba{number_in(color, "r", 0, where_), number_in(color, "g", 0, where_),
                number_in(color, "b", 0, where_), number_in(color, "a", 1, where_)};
  }

  [[nodiscard]] Eigen::Affine3d transform_of(const pugi::xml_node& instance) const {
    const auto value = [&](const char* name) { return number_in(instance, name, 0, where_); };
    const auto turn = [&](const char* name, const Vec3& axis) {
      return Eigen::AngleAxisd(value(name) * std::numbers::pi / 180, axis);
    };
    // What slicers write beside the standard, applied first: scale, then mirror.
    const auto size = [&](const char* name) { return number_in(instance, name, 1, where_); };
    const auto sign = [&](const char* name) { return value(name) != 0 ? -1.0 : 1.0; };
    const Vec3 scale =
        size("scale") * Vec3(size("scalex") * sign("mirrorx"), size("scaley") * sign("mirrory"),
                             size("scalez") * sign("mirrorz"));
    return Eigen::Translation3d(value("deltax"), value("deltay"), value("deltaz")) *
           turn("rz", Vec3::UnitZ()) * turn("ry", Vec3::UnitY()) * turn("rx", Vec3::UnitX()) *
           Eigen::Scaling(scale);
  }

  void check_instance(const pugi::xml_node& instance) const {
    constexpr std::string_view kKnown[] = {"deltax",  "deltay",  "deltaz",  "rx",       "ry",
                                           "rz",      "scale",   "scalex",  "scaley",   "scalez",
                                           "mirrorx", "mirrory", "mirrorz", "printable"};
    for (const pugi::xml_node& each : instance.children())
      if (each.type() == pugi::node_element &&
          std::find(std::begin(kKnown), std::end(kKnown), std::string_view(each.name())) == std::end(kKnown))
        throw InputError(
            where_, fmt::format("an instance has <{}>, which is not known here: export it without, or as STL",
                                short_text(each.name())));
  }

  void show(const pugi::xml_node& constellation, const Eigen::Affine3d& above, int depth) {
    shown_.insert(constellation.attribute("id").value());
    for (const pugi::xml_node& instance : constellation.children("instance")) {
      if (depth > kDeepestConstellation || ++uses_ > kMostInstances)
        fail("its constellations contain one another, or show more than 100,000 objects");
      const std::string id = instance.attribute("objectid").value();
      check_instance(instance);
      if (number_in(instance, "printable", 1, where_) == 0) {
        hidden = true;
        continue;
      }
      const Eigen::Affine3d transform = above * transform_of(instance);
      if (const auto found = constellations_.find(id); found != constellations_.end())
        show(found->second, transform, depth + 1);
      else if (const auto object = objects_.find(id); object != objects_.end())
        add_object(object->second, transform);
      else
        fail(fmt::format("it shows object \"{}\", which is not there", short_text(id)));
    }
  }

  static std::string name_of(const pugi::xml_node& node) {
    return node.find_child_by_attribute("metadata", "type", "name").text().get();
  }

  void add_object(const pugi::xml_node& object, const Eigen::Affine3d& transform) {
    const std::optional<Rgba> color = color_of(object);
    for (const pugi::xml_node& mesh : object.children("mesh")) {
      std::vector<Vec3> vertices;
      for (const pugi::xml_node& vertex : mesh.child("vertices").children("vertex")) {
        const pugi::xml_node at = vertex.child("coordinates");
        constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
        vertices.push_back(transform * Vec3(number_in(at, "x", kMissing, where_),
                                            number_in(at, "y", kMissing, where_),
                                            number_in(at, "z", kMissing, where_)));
        vertex_colors = vertex_colors || vertex.child("color");
        curved = curved || vertex.child("normal");
      }
      curved = curved || mesh.child("vertices").child("edge");
      for (const pugi::xml_node& volume : mesh.children("volume"))
        add_volume(volume, transform, vertices, color, name_of(object));
    }
  }

  void add_volume(const pugi::xml_node& volume, const Eigen::Affine3d& transform,
                  const std::vector<Vec3>& vertices, std::optional<Rgba> color,
                  const std::string& object_name) {
    const auto material = materials_.find(volume.attribute("materialid").value());
    if (material != materials_.end() && material->second) color = material->second;
    if (const auto own = color_of(volume)) color = own;
    mesh_.begin_group("");
    support = support || std::string_view(volume.attribute("type").value()) == "support";
    const bool mirrored = transform.linear().determinant() < 0;
    for (const pugi::xml_node& triangle : volume.children("triangle")) {
      for (const char* corner : {"v1", mirrored ? "v3" : "v2", mirrored ? "v2" : "v3"}) {
        const double index = number_in(triangle, corner, -1, where_);
        if (!(index >= 0) || index >= static_cast<double>(vertices.size()) || index != std::floor(index))
          fail(fmt::format("a triangle names vertex {} (from 0), but there are only {}", index,
                           vertices.size()));
        mesh_.add_corner(vertices[static_cast<std::size_t>(index)]);
      }
      const std::optional<Rgba> own = color_of(triangle);
      mesh_.end_polygon(own ? own : color);
    }
    const std::string name = name_of(volume);
    mesh_.end_part(name.empty() ? object_name : name);
  }

  const pugi::xml_node& amf_;
  const std::string& where_;
  Nodes objects_, constellations_;
  std::set<std::string> used_, shown_;
  std::map<std::string, std::optional<Rgba>> materials_;
  std::size_t uses_ = 0;
  MeshBuilder mesh_;
};

// The file, unpacked.
Bytes text_of(const MeshReadJob& job) {
  constexpr std::string_view kZip = "PK\x03\x04";
  const std::string_view bytes(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  if (!bytes.starts_with(kZip)) return job.bytes;
  ZipArchive archive(job.bytes, job.where);
  for (std::size_t e = 0; e < archive.entries().size(); ++e)
    if (is_amf_name(archive.entries()[e].name)) return archive.read(e);
  throw InputError(job.where, "is a ZIP archive without an AMF file");
}

}  // namespace

ForeignMesh read_amf(const MeshReadJob& job, const Warn& warn) {
  const Bytes text = text_of(job);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
    throw InputError(job.where, fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
  const pugi::xml_node amf = document.child("amf");
  AmfReader reader(amf, job.where);
  ForeignMesh mesh = reader.read();
  if (reader.curved) warn("its curved triangles (edges and normals) are read as flat ones");
  if (reader.hidden) warn("instances that are not to be printed are left out");
  if (reader.support) warn("it holds support material for the print, which is a part like any other here");
  if (reader.vertex_colors)
    warn("left out, for only shapes and colours of triangles are read: colours of vertices");
  return mesh;
}

}  // namespace flexel::meshes
