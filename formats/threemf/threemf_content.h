// A 3MF file taken apart: its archive, the model files in it, and what the build shows. For reading a file and for
// writing it again with other positions or split triangles. Only formats/threemf uses this.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <pugixml.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/math/vec.h"
#include "formats/threemf/zip.h"

namespace flexel {

// --- XML whose prefixes differ from writer to writer: "m:color" is "color"

[[nodiscard]] std::string_view local_name(std::string_view name);
[[nodiscard]] pugi::xml_attribute xml_attribute(const pugi::xml_node& node, std::string_view name);
[[nodiscard]] std::string_view xml_value(const pugi::xml_node& node, std::string_view name);
[[nodiscard]] pugi::xml_node xml_child(const pugi::xml_node& node, std::string_view name);

template <class Work>
void for_each_xml_child(const pugi::xml_node& node, std::string_view name, const Work& work) {
  for (const pugi::xml_node& found : node.children())
    if (local_name(found.name()) == name) work(found);
}

// Text for messages: no longer than 40 bytes, and nothing that acts on a terminal.
[[nodiscard]] std::string shown_text(std::string_view text);

// --- units

// The units that 3MF knows, the default first, in metres.
[[nodiscard]] std::span<const std::pair<std::string_view, double>> threemf_units();

// --- models

using ThreeMfTransform = Eigen::Matrix<double, 3, 4>;  // of column vectors

// One .model file, parsed, and the objects in it by id.
struct ThreeMfModel {
  std::string path;
  pugi::xml_document document;
  pugi::xml_node node;
  std::map<std::string, pugi::xml_node, std::less<>> objects;
  std::map<std::string, std::string> unread;  // extensions that it requires and that are not read, by prefix
  std::size_t entry = 0;                      // in the archive
  bool changed = false;
};

// An object where the build shows it: by an item, or by a component of another object that is shown.
struct ThreeMfUse {
  static constexpr std::size_t kNone = ~std::size_t{0};
  ThreeMfModel* model = nullptr;
  pugi::xml_node object, shown_by;
  std::size_t parent = kNone;  // the use whose component it is
  ThreeMfTransform transform;  // object to build
  bool mirrored = false;
  std::uint32_t vertices = 0, triangles = 0;           // of its own mesh
  std::uint32_t first_vertex = 0, first_triangle = 0;  // in the surface
};

// How much of the XML is kept: what tells the shapes, or all, to be written again.
enum class ThreeMfText { shapes, all };

class ThreeMfContent {
 public:
  // The bytes must outlive this. Throws InputError: no 3MF file, damaged, an object that is not read, as uses().
  ThreeMfContent(std::span<const std::byte> bytes, std::string where, ThreeMfText kept);
  ThreeMfContent(const ThreeMfContent&) = delete;
  ThreeMfContent& operator=(const ThreeMfContent&) = delete;

  // Everything the build shows, in the order of its items, each use before those of its components.
  [[nodiscard]] const std::vector<ThreeMfUse>& uses() const { return uses_; }
  // By path; those that the build needs.
  [[nodiscard]] std::map<std::string, ThreeMfModel>& models() { return models_; }
  [[nodiscard]] ThreeMfModel& root() { return *root_; }  // the one with the build
  [[nodiscard]] ZipArchive& archive() { return archive_; }
  [[nodiscard]] double unit() const { return unit_; }  // m
  [[nodiscard]] const std::string& where() const { return where_; }
  // The object's own name, else that of what shows it; "" where none has one.
  [[nodiscard]] std::string name_of(std::size_t use) const;

  // Throws InputError where the text is no finite number.
  [[nodiscard]] double number(std::string_view text, const char* what) const;
  [[nodiscard]] Vec3 position(const pugi::xml_node& vertex, std::size_t number_in_mesh) const;
  [[noreturn]] void fail(const std::string& what) const;

  // The archive with its changed models in place of the old ones.
  [[nodiscard]] Bytes packed();

 private:
  using Id = std::pair<std::string, std::string>;  // path of the model, id of the object
  [[nodiscard]] std::string root_model();
  ThreeMfModel& load(const std::string& path);
  [[nodiscard]] double unit_of(const pugi::xml_node& model) const;
  [[nodiscard]] ThreeMfTransform transform_of(const pugi::xml_node& node) const;
  [[nodiscard]] double unfolded(const Id& id, int depth);
  void check_unfolded(double triangles) const;
  void add_use(const pugi::xml_node& shown_by, const std::string& file, std::size_t parent, int depth);
  void add_mesh(ThreeMfUse& use);
  void check_readable(const ThreeMfUse& use, const std::string& name) const;

  std::string where_;
  ThreeMfText kept_;
  ZipArchive archive_;
  std::map<std::string, ThreeMfModel> models_;
  ThreeMfModel* root_ = nullptr;
  std::vector<ThreeMfUse> uses_;
  double unit_ = 0;  // m; 0: no model was read yet
  std::uint64_t vertices_ = 0, triangles_ = 0;
  std::map<Id, double> unfolded_;  // triangles
  double different_ = 0;           // triangles of the objects in unfolded_, each counted once
};

// True where the text is a whole number below `limit`.
[[nodiscard]] bool whole_number(std::string_view text, std::size_t limit, std::size_t& value);

// Gives every use for which `changes` holds an object that nothing else shows, so that it can be changed: the file's
// own where that is possible, else a copy with a new id and UUID beside it. A use whose component changes must change
// too. Returns the object of each use, for those that do not change an empty one.
[[nodiscard]] std::vector<pugi::xml_node> own_objects(ThreeMfContent& content,
                                                      const std::vector<bool>& changes);

// `leaves` and all that show them.
[[nodiscard]] std::vector<bool> with_parents(const ThreeMfContent& content, std::vector<bool> leaves);

}  // namespace flexel
