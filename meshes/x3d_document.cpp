// ISO/IEC 19775-1, 4.4.3: a USE stands for the node that has this DEF before it in the file.
#include "meshes/x3d_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <pugixml.hpp>
#include <sstream>
#include <string_view>

#include "base/error.h"
#include "formats/common/readers.h"

namespace flexel::meshes {
namespace {

constexpr std::size_t kMostNodes = 2'000'000;
constexpr int kDeepest = 200;

bool is_one_of(std::string_view name, std::span<const std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_group(const pugi::xml_node& node) {
  constexpr std::array<std::string_view, 5> kGroups = {"Group", "StaticGroup", "Switch", "Transform",
                                                       "Anchor"};
  return is_one_of(node.name(), kGroups);
}

// What assimp makes a mesh of polygons from.
bool is_shape(const pugi::xml_node& node) {
  constexpr std::array<std::string_view, 14> kShapes = {"IndexedFaceSet",
                                                        "IndexedTriangleSet",
                                                        "IndexedTriangleFanSet",
                                                        "IndexedTriangleStripSet",
                                                        "TriangleSet",
                                                        "TriangleFanSet",
                                                        "TriangleStripSet",
                                                        "ElevationGrid",
                                                        "Extrusion",
                                                        "Box",
                                                        "Cone",
                                                        "Cylinder",
                                                        "Sphere",
                                                        "Rectangle2D"};
  return is_one_of(node.name(), kShapes);
}

bool is_line(const pugi::xml_node& node) {
  constexpr std::array<std::string_view, 10> kLines = {
      "IndexedLineSet", "LineSet",    "PointSet", "Polyline2D", "Polypoint2D",
      "Arc2D",          "ArcClose2D", "Circle2D", "Disk2D",     "Text"};
  return is_one_of(node.name(), kLines);
}

class Expander {
 public:
  explicit Expander(const std::string& where) : where_(where) {}

  // Works on the children of a node, in the order of the file.
  void expand(pugi::xml_node parent, int depth) {
    if (depth > kDeepest) fail("its nodes lie in one another more than 200 deep");
    for (pugi::xml_node node = parent.first_child(); node;) {
      if (++nodes_ > kMostNodes) fail("its nodes are used again and again, more than two million in all");
      const pugi::xml_node next = node.next_sibling();
      if (std::string_view(node.name()) == "Inline")
        throw InputError(
            where_,
            "shows another file (Inline), which is not opened: put that into this one, or give it alone");
      const std::string use = node.attribute("USE").value();
      pugi::xml_node shown = use.empty() ? node : copy_of(use, node);
      expand(shown, depth + 1);
      if (const std::string name = node.attribute("DEF").value(); use.empty() && !name.empty())
        named_[name] = shown;
      if (!use.empty()) parent.remove_child(node);
      shapes += is_shape(shown) ? 1 : 0;
      lines += is_line(shown) ? 1 : 0;
      if (is_line(shown) || (is_group(shown) && !shown.first_child())) parent.remove_child(shown);
      node = next;
    }
  }
  std::size_t shapes = 0, lines = 0;

 private:
  [[noreturn]] void fail(const std::string& why) const { throw InputError(where_, "is damaged: " + why); }

  // Beside the node, without its name; what lies in it is expanded already, and is counted again.
  pugi::xml_node copy_of(const std::string& use, pugi::xml_node& node) const {
    const auto found = named_.find(use);
    if (found == named_.end())
      fail(fmt::format("it uses \"{}\", which stands nowhere before", clean_name(use.substr(0, 60))));
    pugi::xml_node copy = node.parent().insert_copy_before(found->second, node);
    copy.remove_attribute("DEF");
    return copy;
  }

  const std::string& where_;
  std::map<std::string, pugi::xml_node> named_;
  std::size_t nodes_ = 0;
};

}  // namespace

X3dDocument x3d_document(const Bytes& bytes, const std::string& where) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(bytes.data(), bytes.size(), pugi::parse_default | pugi::parse_declaration);
  if (!parsed)
    throw InputError(where, fmt::format("is damaged: its XML does not parse ({})", parsed.description()));
  Expander expander(where);
  expander.expand(document.child("X3D").child("Scene"), 0);
  std::ostringstream text;
  document.save(text, "", pugi::format_raw);
  const std::string written = text.str();
  const auto* begin = reinterpret_cast<const std::byte*>(written.data());
  return {Bytes(begin, begin + written.size()), expander.shapes, expander.lines};
}

}  // namespace flexel::meshes
