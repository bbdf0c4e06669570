// 3MF (3MF Consortium, "3D Manufacturing Format, Core Specification", 1.3): XML in a ZIP archive. Read with zlib
// and pugixml; lib3mf, the format's own library, keeps coordinates in single precision
// (docs/reference/surfaces.md). Every mesh that the build shows is a part, an object shown twice two parts. Read of the
// extensions: colour groups (materials), and meshes in other files of the archive (production).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/stop.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"
#include "formats/threemf/threemf_content.h"

namespace flexel {
namespace {

using Rgba = std::array<double, 4>;

// "#RRGGBB" or "#RRGGBBAA"; opaque white where it is neither.
std::vector<Rgba> threemf_colors(const pugi::xml_node& group, std::string_view element,
                                 std::string_view name) {
  std::vector<Rgba> colors;
  for_each_xml_child(group, element, [&](const pugi::xml_node& node) {
    const std::string_view text = xml_value(node, name);
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

class ThreeMfReader {
 public:
  explicit ThreeMfReader(const ImportInput& input) : content_(input.bytes, input.where, ThreeMfText::shapes) {
    for (const auto& [path, model] : content_.models()) {
      auto& colors = colors_[&model];
      for (const pugi::xml_node& resource : xml_child(model.node, "resources").children()) {
        const std::string id(xml_value(resource, "id"));
        const std::string_view name = local_name(resource.name());
        if (name == "basematerials") colors[id] = threemf_colors(resource, "base", "displaycolor");
        textured_ = textured_ || name == "texture2dgroup";
        mixed_ = mixed_ || name == "compositematerials" || name == "multiproperties";
        if (name == "colorgroup") colors[id] = threemf_colors(resource, "color", "color");
      }
    }
  }

  // Tells `warn` what is a part that may not be meant as one, and what of it will not come out again.
  Surface read(const std::function<void(const std::string&)>& warn) {
    surface_.polygon_offsets.push_back(0);
    for (std::size_t u = 0; u < content_.uses().size(); ++u) add_use(u);
    if (surface_.polygon_count() == 0) content_.fail("builds no triangles: nothing to work on");
    for (Vec3& vertex : surface_.vertices) vertex *= content_.unit();
    if (warn) tell(warn);
    if (colored_) surface_.polygon_columns[kColorColumn] = std::move(color_);
    assign_dihedral_faces(surface_, polygon_part_, welded_);
    surface_.sources.push_back(source_in_unit("3mf", content_.unit()));
    return std::move(surface_);
  }

 private:
  void tell(const std::function<void(const std::string&)>& warn) const {
    const auto others = [](const std::set<std::string>& names) {
      return names.size() > 1 ? fmt::format(" (one of {})", names.size()) : "";
    };
    if (!supports_.empty())
      warn(fmt::format("\"{}\"{} is support material for the print, and a part like any other here",
                       *supports_.begin(), others(supports_)));
    if (!sliced_.empty())
      warn(fmt::format(
          "\"{}\"{} has slices beside its triangles, which are not read: a 3MF file that is written "
          "from it has none where the part moved",
          *sliced_.begin(), others(sliced_)));
    std::vector<const char*> kept;  // in the file's own form alone
    if (textured_) kept.push_back("textures");
    if (shaded_) kept.push_back("colours of corners");
    if (mixed_) kept.push_back("mixed materials");
    if (!kept.empty())
      warn(
          fmt::format("{}: {} come out where all of it is written again as one 3MF file; other formats, a "
                      "file for each part and one of several sources leave them out",
                      content_.where(), fmt::join(kept, " and ")));
  }

  void add_use(std::size_t u) {
    const ThreeMfUse& use = content_.uses()[u];
    const std::string name = clean_name(content_.name_of(u));
    const std::string_view type = xml_value(use.object, "type");
    const auto shown = [&] { return name.empty() ? clean_name(xml_value(use.object, "id")) : name; };
    if (type == "support" || type == "solidsupport") supports_.insert(shown());
    if (xml_attribute(use.object, "slicestackid")) sliced_.insert(shown());
    check_stop();
    if (const pugi::xml_node mesh = xml_child(use.object, "mesh")) add_mesh(use, mesh, name);
  }

  void add_mesh(const ThreeMfUse& use, const pugi::xml_node& mesh, const std::string& name) {
    std::vector<Vec3> own;
    own.reserve(use.vertices);
    for_each_xml_child(xml_child(mesh, "vertices"), "vertex", [&](const pugi::xml_node& vertex) {
      const Vec3 at = content_.position(vertex, own.size() + 1);
      own.push_back(use.transform.leftCols<3>() * at + use.transform.col(3));
    });
    for_each_xml_child(xml_child(mesh, "triangles"), "triangle", [&](const pugi::xml_node& triangle) {
      add_triangle(triangle, use);
      add_color(use, triangle);
    });
    for (const std::uint32_t vertex : weld(own)) welded_.push_back(use.first_vertex + vertex);
    surface_.vertices.insert(surface_.vertices.end(), own.begin(), own.end());
    surface_.parts.push_back({name});
  }

  void add_triangle(const pugi::xml_node& triangle, const ThreeMfUse& use) {
    std::array<std::size_t, 3> corners{};
    constexpr std::array<const char*, 3> kNames = {"v1", "v2", "v3"};
    for (std::size_t i = 0; i < 3; ++i)
      if (!whole_number(xml_value(triangle, kNames[i]), use.vertices, corners[i]))
        content_.fail(fmt::format("triangle {} names vertex \"{}\" (from 0), but there are only {}",
                                  surface_.polygon_count() + 1,
                                  clean_name(xml_value(triangle, kNames[i]).substr(0, 20)), use.vertices));
    if (use.mirrored) std::swap(corners[1], corners[2]);
    for (const std::size_t corner : corners)
      surface_.polygon_vertices.push_back(static_cast<std::uint32_t>(use.first_vertex + corner));
    surface_.polygon_offsets.push_back(static_cast<std::uint32_t>(surface_.polygon_vertices.size()));
    polygon_part_.push_back(static_cast<std::uint32_t>(surface_.parts.size()));
  }

  // The triangle's own colour (the mean of its corners'), else its object's, else white.
  void add_color(const ThreeMfUse& use, const pugi::xml_node& triangle) {
    const std::string_view p1 = xml_value(triangle, "p1");
    std::string_view group = xml_value(triangle, "pid");
    if (group.empty()) group = xml_value(use.object, "pid");
    std::array<std::string_view, 3> names;
    names.fill(p1.empty() ? xml_value(use.object, "pindex") : p1);
    if (const std::string_view p2 = xml_value(triangle, "p2"); !p1.empty() && !p2.empty())
      names = {p1, p2, xml_value(triangle, "p3")};
    Rgba color = {1, 1, 1, 1};
    const auto& groups = colors_.at(use.model);
    const auto colors = groups.find(group);
    std::array<std::size_t, 3> which{};
    const bool known = colors != groups.end() && whole_number(names[0], colors->second.size(), which[0]) &&
                       whole_number(names[1], colors->second.size(), which[1]) &&
                       whole_number(names[2], colors->second.size(), which[2]);
    if (known) {
      colored_ = true;
      shaded_ = shaded_ || which[0] != which[1] || which[0] != which[2];
      for (std::size_t i = 0; i < 4; ++i)
        color[i] = which[0] == which[1] && which[0] == which[2]
                       ? colors->second[which[0]][i]
                       : std::min(1.0, (colors->second[which[0]][i] + colors->second[which[1]][i] +
                                        colors->second[which[2]][i]) /
                                           3);
    }
    color_.values.insert(color_.values.end(), color.begin(), color.end());
  }

  ThreeMfContent content_;
  // Colours of the groups of each model, by id.
  std::map<const ThreeMfModel*, std::map<std::string, std::vector<Rgba>, std::less<>>> colors_;
  Surface surface_;
  std::vector<std::uint32_t> polygon_part_, welded_;
  Column color_{4, {}};
  bool colored_ = false;
  bool textured_ = false, shaded_ = false;  // shaded: corners of a triangle differ in colour
  bool mixed_ = false;                      // of several properties or materials at once
  std::set<std::string> supports_;          // names of objects that hold the print up
  std::set<std::string> sliced_;            // and of those with slices
};

Evidence sniff_3mf(const ImportInput& input) {
  const std::string_view text = beginning(input);
  return text.starts_with("PK\x03\x04") && !is_amf_name(first_zip_entry(text)) ? Evidence::magic
                                                                               : Evidence::none;
}

Surface read_3mf(ImportInput& input, const ImportOptions& options) {
  if (options.unit) throw InputError(input.where, "a 3MF file carries its own unit: leave out --unit");
  Surface surface = ThreeMfReader(input).read(options.warn);
  surface.sources[0].bytes = std::move(input.bytes);
  return surface;
}

}  // namespace

constinit const FileReader k3mfReader{.format = &k3mfFormat, .sniff = sniff_3mf, .read = read_3mf};

}  // namespace flexel
