// Splits the triangles of a 3MF file. New vertices follow those of their object, and the pieces of a triangle take its
// place with its attributes; colours and texture coordinates of corners become new ones half-way, at the end of their
// group. An object that is shown several times becomes one for each use that is split (own_objects()). The new vertices
// of an object follow its old ones, which is another order than the surface's: SurfaceSource::order has it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "base/error.h"
#include "base/stop.h"
#include "formats/common/refine_files.h"
#include "formats/threemf/threemf_content.h"

namespace flexel {
namespace {

constexpr std::array<const char*, 3> kCornerNames = {"v1", "v2", "v3"}, kPropertyNames = {"p1", "p2", "p3"};

// What cannot be split, in words that follow "holds".
struct NotSplit {
  std::string what;
};

// A group of properties that can be interpolated: its entries as numbers, the file's first.
class PropertyGroup {
 public:
  // Throws NotSplit for a group of another kind.
  explicit PropertyGroup(pugi::xml_node group) : group_(group), kind_(local_name(group.name())) {
    if (kind_ != "colorgroup" && kind_ != "texture2dgroup")
      throw NotSplit{fmt::format("triangles whose corners differ in their \"{}\"", shown_text(kind_))};
    const std::string_view entry = kind_ == "colorgroup" ? "color" : "tex2coord";
    for_each_xml_child(group, entry, [&](const pugi::xml_node& node) {
      last_ = node;
      entries_.push_back(kind_ == "colorgroup"
                             ? color_of(xml_value(node, "color"))
                             : std::vector<double>{coordinate(node, "u"), coordinate(node, "v")});
    });
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  // The entry half-way: "color gradients should be linear in sRGB" (Materials Extension, 1.3).
  std::size_t between(std::size_t a, std::size_t b) {
    if (a == b) return a;
    const auto [found, is_new] = halves_.emplace(std::minmax(a, b), entries_.size());
    if (!is_new) return found->second;
    std::vector<double> mean;
    for (std::size_t i = 0; i < entries_[a].size(); ++i)
      mean.push_back(0.5 * (entries_[a][i] + entries_[b][i]));
    append(mean);
    entries_.push_back(std::move(mean));
    return found->second;
  }

 private:
  static double coordinate(const pugi::xml_node& node, const char* name) {
    const std::string_view text = xml_value(node, name);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
      throw NotSplit{fmt::format("the texture coordinate \"{}\"", shown_text(text))};
    return value;
  }

  static std::vector<double> color_of(std::string_view text) {
    std::vector<double> color;
    if (text.size() != 7 && text.size() != 9)
      throw NotSplit{fmt::format("the colour \"{}\"", shown_text(text))};
    for (std::size_t i = 1; i < text.size(); i += 2) {
      unsigned value = 0;
      const auto [end, error] = std::from_chars(text.data() + i, text.data() + i + 2, value, 16);
      if (text[0] != '#' || error != std::errc{} || end != text.data() + i + 2)
        throw NotSplit{fmt::format("the colour \"{}\"", shown_text(text))};
      color.push_back(value);
    }
    color.resize(4, 255);
    return color;
  }

  void append(const std::vector<double>& numbers) {
    pugi::xml_node node = group_.insert_copy_after(last_, last_);
    last_ = node;
    if (kind_ == "colorgroup") {
      std::string text = "#";
      for (std::size_t i = 0; i < 4; ++i)
        if (i < 3 || std::lround(numbers[i]) != 255) text += fmt::format("{:02X}", std::lround(numbers[i]));
      xml_attribute(node, "color").set_value(text.c_str());
    } else {
      xml_attribute(node, "u").set_value(fmt::format("{}", numbers[0]).c_str());
      xml_attribute(node, "v").set_value(fmt::format("{}", numbers[1]).c_str());
    }
  }

  pugi::xml_node group_, last_;
  std::string kind_;
  std::vector<std::vector<double>> entries_;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> halves_;
};

class ThreeMfRefinement {
 public:
  ThreeMfRefinement(const SurfaceSource& source, const Refinement& refinement)
      : content_(source.bytes, source.file, ThreeMfText::all),
        refinement_(refinement),
        first_piece_(first_pieces(refinement)) {}

  void run(SurfaceSource& source) {
    refuse_ranges_of_triangles();
    find_new_vertices();
    const std::vector<ThreeMfUse>& uses = content_.uses();
    std::vector<bool> split(uses.size());
    for (std::size_t u = 0; u < uses.size(); ++u) split[u] = !added_[u].empty();
    const std::vector<pugi::xml_node> own = own_objects(content_, with_parents(content_, split));
    std::vector<std::uint32_t> order;
    for (std::size_t u = 0; u < uses.size(); ++u) {
      if (split[u]) split_mesh(u, own[u]);
      for (std::uint32_t v = 0; v < uses[u].vertices; ++v) order.push_back(uses[u].first_vertex + v);
      order.insert(order.end(), added_[u].begin(), added_[u].end());
    }
    source.bytes = content_.packed();
    source.order = std::move(order);
  }

 private:
  // Slicers keep settings for triangles by their numbers in a file of their own beside the model.
  void refuse_ranges_of_triangles() {
    for (std::size_t i = 0; i < content_.archive().entries().size(); ++i) {
      const std::string& name = content_.archive().entries()[i].name;
      if (!name.ends_with(".config")) continue;
      const Bytes bytes = content_.archive().read(i);
      const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      if (text.find("firstid=") != std::string_view::npos)
        throw NotSplit{fmt::format("settings for triangles by their numbers (\"{}\")", shown_text(name))};
    }
  }

  // Which use each new vertex belongs to, and its number there.
  void find_new_vertices() {
    const std::vector<ThreeMfUse>& uses = content_.uses();
    added_.resize(uses.size());
    std::uint32_t vertices = 0, triangles = 0;
    std::vector<std::size_t> use_of;
    for (std::size_t u = 0; u < uses.size(); ++u) {
      vertices += uses[u].vertices;
      triangles += uses[u].triangles;
      use_of.resize(vertices, u);
      for (std::uint32_t v = 0; v < uses[u].vertices; ++v) local_.push_back(v);
    }
    if (vertices != refinement_.vertices || triangles + 1 != first_piece_.size())
      content_.fail("the embedded 3MF has another number of vertices or triangles than the surface");
    for (std::uint32_t i = 0; i < refinement_.ends.size(); ++i) {
      const std::size_t use = use_of[refinement_.ends[i][0]];
      use_of.push_back(use);
      local_.push_back(uses[use].vertices + static_cast<std::uint32_t>(added_[use].size()));
      added_[use].push_back(refinement_.vertices + i);
    }
  }

  void split_mesh(std::size_t u, const pugi::xml_node& object) {
    const ThreeMfUse& use = content_.uses()[u];
    const pugi::xml_node mesh = xml_child(object, "mesh");
    for (const pugi::xml_node& part : mesh.children()) {
      const std::string_view name = local_name(part.name());
      if (part.type() == pugi::node_element && name != "vertices" && name != "triangles" &&
          name != "trianglesets")
        throw NotSplit{fmt::format("the element \"{}\" in a mesh", shown_text(name))};
    }
    add_vertices(xml_child(mesh, "vertices"), added_[u]);
    pugi::xml_node triangles = xml_child(mesh, "triangles");
    std::vector<pugi::xml_node> old;
    for_each_xml_child(triangles, "triangle",
                       [&](const pugi::xml_node& triangle) { old.push_back(triangle); });
    for (std::uint32_t t = 0; t < old.size(); ++t) {
      if (first_piece_[use.first_triangle + t + 1] - first_piece_[use.first_triangle + t] == 1) continue;
      check_stop();
      split_triangle(use, object, triangles, old[t], use.first_triangle + t);
    }
    for_each_xml_child(xml_child(mesh, "trianglesets"), "triangleset",
                       [&](const pugi::xml_node& set) { renumber(set, use); });
  }

  void add_vertices(pugi::xml_node list, const std::vector<std::uint32_t>& added) const {
    std::vector<Vec3> positions;
    pugi::xml_node last;
    for_each_xml_child(list, "vertex", [&](const pugi::xml_node& vertex) {
      positions.push_back(content_.position(vertex, positions.size() + 1));
      last = vertex;
    });
    for (const std::uint32_t vertex : added) {
      const auto [a, b] = refinement_.ends_of(vertex);
      const Vec3 at = 0.5 * (positions[local_[a]] + positions[local_[b]]);
      positions.push_back(at);
      pugi::xml_node line = list.insert_child_after(pugi::node_pcdata, last);
      line.set_value("\n");
      last = list.insert_copy_after(last, line);
      xml_attribute(last, "x").set_value(fmt::format("{}", at.x()).c_str());
      xml_attribute(last, "y").set_value(fmt::format("{}", at.y()).c_str());
      xml_attribute(last, "z").set_value(fmt::format("{}", at.z()).c_str());
    }
  }

  // Only what is known to hold for each piece of a triangle too.
  static void refuse_unknown(const pugi::xml_node& triangle) {
    constexpr std::array<std::string_view, 7> kKnown = {"v1", "v2", "v3", "pid", "p1", "p2", "p3"};
    for (const pugi::xml_attribute& each : triangle.attributes())
      if (std::find(kKnown.begin(), kKnown.end(), each.name()) == kKnown.end())
        throw NotSplit{fmt::format("triangles with \"{}\"", shown_text(each.name()))};
    if (triangle.first_child()) throw NotSplit{"elements inside triangles"};
  }

  void split_triangle(const ThreeMfUse& use, const pugi::xml_node& object, pugi::xml_node& list,
                      const pugi::xml_node& triangle, std::uint32_t polygon) {
    refuse_unknown(triangle);
    const auto properties = corner_properties(use, object, triangle);
    PropertyGroup* group = properties ? properties->group : nullptr;
    const auto halve = [&](std::size_t a, std::size_t b, std::uint32_t) { return group->between(a, b); };
    PieceCorners<std::size_t, decltype(halve)> at_corner(refinement_, halve);
    for (std::size_t i = 0; properties && i < 3; ++i) {
      std::size_t corner = 0;
      if (!whole_number(xml_value(triangle, kCornerNames[i]), use.vertices, corner))
        content_.fail("is damaged: a triangle names a vertex that is not there");
      at_corner.add(use.first_vertex + static_cast<std::uint32_t>(corner), properties->indices[i]);
    }
    pugi::xml_node last = triangle;
    for (std::uint32_t piece = first_piece_[polygon]; piece < first_piece_[polygon + 1]; ++piece) {
      if (piece != first_piece_[polygon]) {
        last = list.insert_child_after(pugi::node_pcdata, last);
        last.set_value("\n");
      }
      last = list.insert_copy_after(triangle, last);
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t corner = use.mirrored ? (3 - i) % 3 : i;
        const std::uint32_t vertex = refinement_.corners[refinement_.offsets[piece] + corner];
        set_number(last, kCornerNames[i], local_[vertex]);
        if (properties) set_number(last, kPropertyNames[i], at_corner.at(vertex));
      }
    }
    list.remove_child(triangle);
  }

  static void set_number(const pugi::xml_node& node, const char* name, std::size_t value) {
    xml_attribute(node, name).set_value(std::to_string(value).c_str());
  }

  struct CornerProperties {
    PropertyGroup* group = nullptr;
    std::array<std::size_t, 3> indices{};
  };

  // Nothing where the corners have none, or all the same: then the pieces have the triangle's.
  std::optional<CornerProperties> corner_properties(const ThreeMfUse& use, const pugi::xml_node& object,
                                                    const pugi::xml_node& triangle) {
    std::array<std::string_view, 3> texts;
    for (std::size_t i = 0; i < 3; ++i) texts[i] = xml_value(triangle, kPropertyNames[i]);
    const bool alone = texts[1].empty() && texts[2].empty();
    if (alone || (texts[0] == texts[1] && texts[0] == texts[2])) return std::nullopt;
    std::string_view id = xml_value(triangle, "pid");
    if (id.empty()) id = xml_value(object, "pid");
    CornerProperties properties{&group(*use.model, std::string(id)), {}};
    for (std::size_t i = 0; i < 3; ++i)
      if (!whole_number(texts[i], properties.group->size(), properties.indices[i]))
        throw NotSplit{
            fmt::format("a triangle with the property \"{}\", which is not there", shown_text(texts[i]))};
    return properties;
  }

  PropertyGroup& group(ThreeMfModel& model, const std::string& id) {
    const auto key = std::pair(&model, id);
    if (const auto found = groups_.find(key); found != groups_.end()) return found->second;
    for (const pugi::xml_node& resource : xml_child(model.node, "resources").children())
      if (xml_value(resource, "id") == id && local_name(resource.name()) != "object")
        return groups_.emplace(key, PropertyGroup(resource)).first->second;
    throw NotSplit{fmt::format("triangles with the properties \"{}\", which are not there", shown_text(id))};
  }

  // Sets name triangles of the mesh by number; the pieces of one are a range.
  void renumber(const pugi::xml_node& set, const ThreeMfUse& use) const {
    const auto begin_of = [&](std::size_t t) {
      return first_piece_[use.first_triangle + t] - first_piece_[use.first_triangle];
    };
    const auto number = [&](const pugi::xml_node& node, const char* name) {
      std::size_t value = 0;
      if (!whole_number(xml_value(node, name), use.triangles, value))
        content_.fail("is damaged: a set of triangles names one that is not there");
      return value;
    };
    for (pugi::xml_node node : set.children()) {
      const std::string_view name = local_name(node.name());
      if (name == "refrange") {
        const std::size_t first = number(node, "startindex"), last = number(node, "endindex");
        set_number(node, "startindex", begin_of(first));
        set_number(node, "endindex", begin_of(last + 1) - 1);
      } else if (name == "ref") {
        const std::size_t t = number(node, "index");
        set_number(node, "index", begin_of(t));
        if (begin_of(t + 1) - begin_of(t) == 1) continue;
        node.set_name((std::string(node.name()) + "range").c_str());
        xml_attribute(node, "index").set_name("startindex");
        node.append_attribute("endindex").set_value(std::to_string(begin_of(t + 1) - 1).c_str());
      }
    }
  }

  ThreeMfContent content_;
  const Refinement& refinement_;
  const std::vector<std::uint32_t> first_piece_;
  std::vector<std::uint32_t> local_;  // (vertices of the surface after) number within their object
  std::vector<std::vector<std::uint32_t>> added_;  // (uses) new vertices of the surface
  std::map<std::pair<ThreeMfModel*, std::string>, PropertyGroup> groups_;
};

}  // namespace

std::string refine_3mf(SurfaceSource& source, const Refinement& refinement) try {
  ThreeMfRefinement(source, refinement).run(source);
  return "";
} catch (const NotSplit& held) {
  return held.what;
}

}  // namespace flexel
