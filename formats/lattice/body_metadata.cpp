// Metadata of a body file. Faces number up to the hundreds of thousands and hardly any has a name, so their
// parts are an array of the file and only the names that exist are listed here. Reading goes through a cursor
// that knows its path ("parts[2].spacing"), so that every message names the key.
#include "formats/lattice/body_metadata.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files/json.h"
#include "base/version.h"

namespace flexel {
namespace {

using Json = nlohmann::json;

bool is_utf8(const std::string& text) {
  try {
    (void)Json(text).dump();
    return true;
  } catch (const Json::type_error&) {
    return false;
  }
}

Json text_to_json(const std::string& text) {
  if (is_utf8(text)) return text;
  Json bytes = Json::array();
  for (const char c : text) bytes.push_back(static_cast<unsigned char>(c));
  return bytes;
}

Json vector_to_json(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Json part_to_json(const Part& part) {
  const Mat3& axes = part.lattice.axes;
  return {{"name", text_to_json(part.name)},
          {"material", text_to_json(part.material)},
          {"placement", part.placement == Placement::corner ? "corner" : "centre"},
          {"origin", vector_to_json(part.lattice.origin)},
          {"axes", {vector_to_json(axes.row(0)), vector_to_json(axes.row(1)), vector_to_json(axes.row(2))}},
          {"spacing", vector_to_json(part.lattice.spacing)},
          {"elements", {part.element_begin, part.element_end}},
          {"cells", {part.cell_begin, part.cell_end}},
          {"surface_volume", part.surface_volume}};
}

Json source_to_json(const SurfaceSource& source, const PackedSource& packed) {
  return {{"file", text_to_json(source.file)},
          {"format", text_to_json(source.format)},
          {"unit", source.unit},
          {"unit_given", source.unit_given},
          {"hash", fmt::format("{:016x}", source.hash)},
          {"size", packed.size},
          {"block_sizes", packed.block_sizes},
          {"header_size", packed.header_size}};
}

Json surface_to_json(const Surface& surface, const std::vector<PackedSource>& sources) {
  Json parts = Json::array(), names = Json::array(), source_list = Json::array();
  for (std::size_t p = 0; p < surface.parts.size(); ++p) {
    parts.push_back({{"name", text_to_json(surface.parts[p].name)}});
    if (!surface.parts[p].assembly.empty())
      parts.back()["assembly"] = text_to_json(surface.parts[p].assembly);
  }
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    if (!surface.faces[f].name.empty()) names.push_back({f, text_to_json(surface.faces[f].name)});
  for (std::size_t s = 0; s < surface.sources.size(); ++s)
    source_list.push_back(source_to_json(surface.sources[s], sources[s]));
  return {{"parts", parts},
          {"part_source", surface.part_source},
          {"face_names", names},
          {"sources", source_list}};
}

// A value and its path from the root.
class Cursor {
 public:
  Cursor(const Json& value, std::string path, const std::string& where)
      : value_(value), path_(std::move(path)), where_(where) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(where_,
                     fmt::format("damaged: flexel_metadata: {} {}", path_.empty() ? "it" : path_, what));
  }
  [[nodiscard]] Cursor operator[](const char* key) const {
    if (!value_.is_object()) fail("is not an object");
    const auto found = value_.find(key);
    const std::string path = path_.empty() ? key : path_ + "." + key;
    if (found == value_.end()) Cursor(value_, path, where_).fail("is missing");
    return {*found, path, where_};
  }
  [[nodiscard]] bool has(const char* key) const { return value_.is_object() && value_.contains(key); }
  [[nodiscard]] Cursor at(std::size_t i) const {
    return {value_.at(i), fmt::format("{}[{}]", path_, i), where_};
  }
  // Number of entries; where `exactly` is given, fails when it is another.
  [[nodiscard]] std::size_t size(std::size_t exactly = std::string::npos) const {
    if (!value_.is_array()) fail("is not a list");
    if (exactly != std::string::npos && value_.size() != exactly)
      fail(fmt::format("has not {} entries", exactly));
    return value_.size();
  }
  [[nodiscard]] bool null() const { return value_.is_null(); }

  [[nodiscard]] std::uint64_t whole(std::uint64_t most) const {
    if (!value_.is_number_unsigned() || value_.get<std::uint64_t>() > most)
      fail("is not a whole number in range");
    return value_.get<std::uint64_t>();
  }
  [[nodiscard]] std::uint32_t index() const { return static_cast<std::uint32_t>(whole(0xffffffffu)); }
  [[nodiscard]] double number() const {
    if (!value_.is_number()) fail("is not a number");
    return value_.get<double>();
  }
  [[nodiscard]] bool boolean() const {
    if (!value_.is_boolean()) fail("is not true or false");
    return value_.get<bool>();
  }
  [[nodiscard]] std::string text() const {
    if (value_.is_string()) return value_.get<std::string>();
    std::string bytes;
    for (std::size_t i = 0; i < size(); ++i) bytes += static_cast<char>(at(i).whole(255));
    return bytes;
  }
  [[nodiscard]] Vec3 vector() const {
    (void)size(3);
    return {at(0).number(), at(1).number(), at(2).number()};
  }

 private:
  const Json& value_;
  std::string path_;
  const std::string& where_;
};

Part part_from_json(const Cursor& json) {
  Part part;
  part.name = json["name"].text();
  part.material = json["material"].text();
  const std::string placement = json["placement"].text();
  if (placement != "corner" && placement != "centre")
    json["placement"].fail("is neither \"corner\" nor \"centre\"");
  part.placement = placement == "corner" ? Placement::corner : Placement::centre;
  part.lattice.origin = json["origin"].vector();
  const Cursor axes = json["axes"];
  (void)axes.size(3);
  for (std::size_t row = 0; row < 3; ++row)
    part.lattice.axes.row(static_cast<Eigen::Index>(row)) = axes.at(row).vector();
  part.lattice.spacing = json["spacing"].vector();
  (void)json["elements"].size(2);
  (void)json["cells"].size(2);
  part.element_begin = json["elements"].at(0).index();
  part.element_end = json["elements"].at(1).index();
  part.cell_begin = json["cells"].at(0).index();
  part.cell_end = json["cells"].at(1).index();
  part.surface_volume = json["surface_volume"].number();
  return part;
}

std::uint64_t hash_from_json(const Cursor& json) {
  const std::string text = json.text();
  const bool digits = text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (!digits) json.fail("is not 16 hexadecimal digits");
  return std::stoull(text, nullptr, 16);
}

// A file of the same folder: anybody may have written the name.
SurfaceBeside beside_from_json(const Cursor& json) {
  SurfaceBeside beside{json["file"].text(), hash_from_json(json["hash"])};
  if (beside.file.empty() || beside.file == "." || beside.file == ".." ||
      beside.file.find('/') != std::string::npos)
    json["file"].fail("is no name of a file in its folder");
  return beside;
}

SurfaceSource source_from_json(const Cursor& json, PackedSource& packed) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 40;
  SurfaceSource source;
  source.file = json["file"].text();
  source.format = json["format"].text();
  source.unit = json["unit"].number();
  source.unit_given = json["unit_given"].boolean();
  source.hash = hash_from_json(json["hash"]);
  packed.size = json["size"].whole(kMostBytes);
  packed.header_size = json["header_size"].whole(kMostBytes);
  const Cursor blocks = json["block_sizes"];
  for (std::size_t b = 0; b < blocks.size(); ++b)
    packed.block_sizes.push_back(blocks.at(b).whole(kMostBytes));
  return source;
}

void surface_from_json(const Cursor& json, Metadata& metadata) {
  Surface& surface = metadata.body.surface;
  const Cursor parts = json["parts"], part_source = json["part_source"], sources = json["sources"];
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Cursor part = parts.at(p);
    surface.parts.push_back({part["name"].text(), part.has("assembly") ? part["assembly"].text() : ""});
  }
  for (std::size_t s = 0; s < sources.size(); ++s) {
    metadata.sources.emplace_back();
    surface.sources.push_back(source_from_json(sources.at(s), metadata.sources.back()));
  }
  const Cursor names = json["face_names"];
  for (std::size_t i = 0; i < names.size(); ++i) {
    (void)names.at(i).size(2);
    metadata.face_names.emplace_back(names.at(i).at(0).index(), names.at(i).at(1).text());
  }
  for (std::size_t p = 0; p < part_source.size(); ++p)
    surface.part_source.push_back(part_source.at(p).index());
}

}  // namespace

std::vector<std::string> materials_of(const Body& body) {
  std::vector<std::string> materials;
  for (const Part& part : body.parts)
    if (std::find(materials.begin(), materials.end(), part.material) == materials.end())
      materials.push_back(part.material);
  return materials;
}

std::string metadata_to_json(const Body& body, bool with_surface, const std::vector<PackedSource>& sources,
                             const std::optional<SurfaceBeside>& beside) {
  Json parts = Json::array(), materials = Json::array(), notes = Json::array();
  for (const Part& part : body.parts) parts.push_back(part_to_json(part));
  for (const std::string& material : materials_of(body)) materials.push_back(text_to_json(material));
  for (const auto& [key, value] : body.notes) notes.push_back({text_to_json(key), text_to_json(value)});
  Json json = {{"program", std::string("flexel ") + version()},
               {"parts", parts},
               {"materials", materials},
               {"notes", notes},
               {"surface", nullptr}};
  if (with_surface) json["surface"] = surface_to_json(body.surface, sources);
  if (beside)
    json["surface_beside"] = {{"file", text_to_json(beside->file)},
                              {"hash", fmt::format("{:016x}", beside->hash)}};
  std::string text = json.dump();
  // Readers that look for the end of the appended data must not find it in a name.
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
    text.replace(at, 1, "\\u003c");
  return text;
}

Metadata metadata_from_json(const std::string& text, const std::string& where) {
  if (json_depth(text) > kDeepestJson)
    throw InputError(where,
                     fmt::format("damaged: flexel_metadata is nested more than {} deep", kDeepestJson));
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw InputError(where, "damaged: flexel_metadata is not JSON");
  const Cursor root(json, "", where);
  Metadata metadata;
  const Cursor parts = root["parts"], notes = root["notes"], surface = root["surface"];
  for (std::size_t p = 0; p < parts.size(); ++p) metadata.body.parts.push_back(part_from_json(parts.at(p)));
  for (std::size_t i = 0; i < notes.size(); ++i) {
    (void)notes.at(i).size(2);
    metadata.body.notes[notes.at(i).at(0).text()] = notes.at(i).at(1).text();
  }
  metadata.with_surface = !surface.null();
  if (metadata.with_surface) surface_from_json(surface, metadata);
  if (root.has("surface_beside")) metadata.beside = beside_from_json(root["surface_beside"]);
  return metadata;
}

}  // namespace flexel
