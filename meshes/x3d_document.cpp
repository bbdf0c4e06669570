// ISO/IEC 19775-1, 4.4.3: a USE stands for the node that has this DEF before it in the file.
#include "meshes/x3d_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <pugixml.hpp>
#include <set>
#include <sstream>
#include <string_view>

#include "base/error.h"
#include "formats/common/readers.h"

namespace flexel::meshes {
namespace {

constexpr std::size_t kMostNodes = 2'000'000;
constexpr int kDeepestNode = 200;

template <std::size_t kCount>
bool is_one_of(const pugi::xml_node& node, const std::array<std::string_view, kCount>& names) {
  return std::find(names.begin(), names.end(), std::string_view(node.name())) != names.end();
}

bool is_group(const pugi::xml_node& node) {
  return is_one_of(node, std::array<std::string_view, 4>{"Group", "StaticGroup", "Transform", "Anchor"});
}

bool is_metadata(const pugi::xml_node& node) {
  return std::string_view(node.name()).starts_with("Metadata");
}

bool has_no_surface(const pugi::xml_node& node) {
  return is_one_of(node,
                   std::array<std::string_view, 9>{"IndexedLineSet", "LineSet", "PointSet", "Polyline2D",
                                                   "Polypoint2D", "Arc2D", "ArcClose2D", "Circle2D", "Text"});
}

class Expander {
 public:
  explicit Expander(const std::string& where) : where_(where) {}

  // Works on the children of a node, in the order of the file.
  void expand(pugi::xml_node parent, int depth) {
    if (depth > kDeepestNode) fail("its nodes lie in one another more than 200 deep");
    for (pugi::xml_node node = parent.first_child(); node;) {
      if (++nodes_ > kMostNodes) fail("its nodes are used again and again, more than two million in all");
      const pugi::xml_node next = node.next_sibling();
      if (!node.attribute("visible").as_bool(true)) {  // X3D 4
        left_out.insert("hidden nodes");
        parent.remove_child(node);
        node = next;
        continue;
      }
      refuse(node);
      const std::string use = node.attribute("USE").value(), name = node.attribute("DEF").value();
      const pugi::xml_node shown = use.empty() ? node : copy_of(use, node);
      if (!use.empty()) parent.remove_child(node);
      choose(shown);
      expand(shown, depth + 1);
      if (use.empty() && !name.empty()) named_[name] = library_.append_copy(shown);
      look_at_colors(shown);
      const bool dropped = look_at_shape(parent, shown);
      if (dropped || (is_group(shown) && !shown.first_child())) parent.remove_child(shown);
      node = next;
    }
  }
  std::size_t shapes = 0;
  std::set<std::string> left_out;

 private:
  [[noreturn]] void fail(const std::string& why) const { throw InputError(where_, "is damaged: " + why); }

  void refuse(const pugi::xml_node& node) const {
    if (std::string_view(node.name()) == "Inline")
      throw InputError(
          where_,
          "shows another file (Inline), which is not opened: put that into this one, or give it alone");
    if (is_one_of(node, std::array<std::string_view, 2>{"Cylinder", "Cone"}))
      throw InputError(
          where_, fmt::format("holds a {}, which assimp does not close: export it as triangles, or as STL",
                              node.name()));
    if (is_one_of(node, std::array<std::string_view, 3>{"ProtoInstance", "Collision", "Billboard"}))
      throw InputError(
          where_,
          fmt::format("holds a {}, which assimp does not read: export it without, or as STL", node.name()));
  }

  // Beside the node, without its name; what lies in it is expanded already, and is counted again.
  pugi::xml_node copy_of(const std::string& use, const pugi::xml_node& node) const {
    const auto found = named_.find(use);
    if (found == named_.end())
      fail(fmt::format("it uses \"{}\", which stands nowhere before", clean_name(use.substr(0, 60))));
    pugi::xml_node copy = node.parent().insert_copy_before(found->second, node);
    copy.remove_attribute("DEF");
    return copy;
  }

  // A Switch or LOD becomes a group of the child that it shows, LOD the finest.
  static void choose(pugi::xml_node node) {
    const bool is_switch = std::string_view(node.name()) == "Switch";
    if (!is_switch && std::string_view(node.name()) != "LOD") return;
    const int chosen = is_switch ? node.attribute("whichChoice").as_int(-1) : 0;
    int number = 0;
    for (pugi::xml_node child = node.first_child(); child;) {
      const pugi::xml_node next = child.next_sibling();
      if (is_metadata(child) || number++ != chosen) node.remove_child(child);
      child = next;
    }
    node.remove_attribute("whichChoice");
    node.set_name("Group");
  }

  void look_at_colors(pugi::xml_node node) {
    if (node.attribute("colorPerVertex").as_bool(true)) return;
    while (node.remove_child("Color") || node.remove_child("ColorRGBA"))
      left_out.insert("colours of polygons");
  }

  // Whether it is a geometry without a surface, which is to go.
  bool look_at_shape(const pugi::xml_node& parent, const pugi::xml_node& node) {
    if (std::string_view(parent.name()) != "Shape" || is_metadata(node)) return false;
    if (is_one_of(node, std::array<std::string_view, 1>{"Appearance"})) return false;
    const bool dropped = has_no_surface(node);
    if (dropped) left_out.insert(node.name());
    shapes += dropped ? 0 : 1;
    return dropped;
  }

  const std::string& where_;
  std::map<std::string, pugi::xml_node> named_;  // in library_
  pugi::xml_document library_;
  std::size_t nodes_ = 0;
};

// <unit category="length" conversionFactor="0.001"/>; metres where nothing is said.
double x3d_unit(const pugi::xml_node& head, const std::string& where) {
  double metres = 1;
  for (const pugi::xml_node& unit : head.children("unit")) {
    const std::string_view category = unit.attribute("category").value();
    const double factor = unit.attribute("conversionFactor").as_double(0);
    if (category == "length") metres = factor;
    if (category == "angle" && factor != 1)
      throw InputError(
          where, "has angles in another unit than radians, which assimp passes over: export it in radians");
  }
  if (!(metres > 0) || metres > 1e12)
    throw InputError(where, "its unit of length is not a positive number of metres");
  return metres;
}

}  // namespace

X3dDocument x3d_document(const Bytes& bytes, const std::string& where) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(bytes.data(), bytes.size(), pugi::parse_default | pugi::parse_declaration);
  if (!parsed)
    throw InputError(where, fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
  const pugi::xml_node x3d = document.child("X3D");
  X3dDocument result;
  result.unit = x3d_unit(x3d.child("head"), where);
  Expander expander(where);
  expander.expand(x3d.child("Scene"), 0);
  result.shapes = expander.shapes;
  result.left_out.assign(expander.left_out.begin(), expander.left_out.end());
  std::ostringstream text;
  document.save(text, "", pugi::format_raw);
  const std::string written = text.str();
  const auto* begin = reinterpret_cast<const std::byte*>(written.data());
  result.bytes.assign(begin, begin + written.size());
  return result;
}

}  // namespace flexel::meshes
