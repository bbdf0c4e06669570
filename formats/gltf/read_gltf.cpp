// glTF and GLB. A library (tinygltf) would give the JSON as structures, but not the meshes in the world, and
// could not write the same file again, so formats/gltf reads the JSON itself. Every instance of a mesh in the
// scene is a part: its vertices are those of the file, in the file's order, taken through the nodes'
// transforms in double precision. A .gltf with its buffers becomes a GLB first, which is what is kept.
#include "formats/gltf/gltf_content.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "base/text.h"
#include "base/units.h"
#include "formats/common/readers.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

// --- buffers

Bytes decode_base64(std::string_view text, const std::string& where) {
  Bytes bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) throw InputError(where, "is damaged: a buffer is no base64 text");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count & 0xff));
  }
  return bytes;
}

// "a%20b" as "a b".
std::string decode_percent(std::string_view uri) {
  std::string text;
  const auto hex = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) && hex(uri[i + 2])) {
      text += static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

// A file may come from anybody, and what it names must not be told to whoever gets the result: only what lies
// beside it or below, links followed, and no device or FIFO, which may have no end.
std::string buffer_path(const std::string& uri, const ImportInput& input) {
  namespace fs = std::filesystem;
  const fs::path path = fs::path(input.folder) / decode_percent(uri);
  std::error_code error;
  const auto inside = [&](const fs::path& folder) {
    const fs::path from = fs::canonical(folder.empty() ? "." : folder, error);
    if (error) return false;
    const fs::path way = fs::weakly_canonical(path, error).lexically_relative(from);
    return !error && !way.empty() && *way.begin() != "..";
  };
  const auto refuse = [&](const char* why) {
    throw InputError(input.where, fmt::format("has its numbers in \"{}\", {}", shown(uri), why));
  };
  if (!inside(input.folder) && !inside(fs::canonical(input.where, error).parent_path()))
    refuse("outside of its folder, from where nothing is read: put that file beside it, or give a GLB");
  if (!fs::exists(path, error))
    refuse("which is not there: put that file where it looks for it, or give a GLB");
  if (!fs::is_regular_file(path, error)) refuse("which is no file: give a GLB");
  return path.string();
}

Bytes load_uri(const std::string& uri, const ImportInput& input) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(";base64,");
    if (comma == std::string::npos) throw InputError(input.where, "has a buffer that is no base64 text");
    return decode_base64(std::string_view(uri).substr(comma + 8), input.where);
  }
  if (input.where == "stdin")
    throw InputError(input.where,
                     fmt::format("has its numbers in another file, {}: give the file by its name, "
                                 "or a GLB",
                                 clean_name(uri)));
  if (uri.find("://") != std::string::npos)
    throw InputError(input.where, "has its numbers on a network, from where nothing is read");
  return read_all(buffer_path(uri, input));
}

// All buffers as the one of a GLB.
void join_buffers(Gltf& gltf, const ImportInput& input) {
  if (!gltf.json.contains("buffers")) return;
  const std::size_t buffers = gltf.json["buffers"].is_array() ? gltf.json["buffers"].size() : 0;
  Bytes joined;
  std::vector<std::size_t> begins;
  for (std::size_t b = 0; b < buffers; ++b) {
    const GltfJson& buffer = gltf_entry(gltf.json, "buffers", b, input.where);
    const auto uri = buffer.find("uri");
    if (uri != buffer.end() && !uri->is_string())
      throw InputError(input.where, "is damaged: a uri is no text");
    const Bytes bytes = uri != buffer.end() ? load_uri(uri->get<std::string>(), input)
                        : b == 0            ? gltf.binary
                                            : Bytes();
    const std::size_t length = gltf_index(buffer, "byteLength", input.where);
    if (length > bytes.size())
      throw InputError(input.where,
                       fmt::format("is cut off: buffer {} has {} of its {} bytes", b, bytes.size(), length));
    begins.push_back(joined.size());
    joined.insert(joined.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    joined.resize((joined.size() + 3) / 4 * 4);
  }
  if (gltf.json.contains("bufferViews"))
    for (GltfJson& view : gltf.json["bufferViews"]) {
      const std::size_t buffer = gltf_index(view, "buffer", input.where);
      if (buffer >= begins.size())
        throw InputError(input.where, "is damaged: a view of a buffer that is not there");
      view["byteOffset"] = gltf_index(view, "byteOffset", 0, input.where) + begins[buffer];
      view["buffer"] = 0;
    }
  gltf.binary = std::move(joined);
  gltf.json["buffers"] = GltfJson::array({{{"byteLength", gltf.binary.size()}}});
}

bool is_plain_glb(const Gltf& gltf) {
  if (!gltf.json.contains("buffers")) return true;
  const GltfJson& buffers = gltf.json["buffers"];
  return buffers.is_array() && buffers.size() == 1 && buffers[0].is_object() && !buffers[0].contains("uri");
}

// The file as one GLB; input.bytes become its bytes.
Gltf load_gltf(ImportInput& input) {
  Gltf gltf;
  if (looks_like_glb(input.bytes)) {
    gltf = parse_glb(input.bytes, input.where);
    if (is_plain_glb(gltf)) return gltf;
  } else {
    gltf.json =
        parse_gltf_json({reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size()}, input.where);
  }
  join_buffers(gltf, input);
  input.bytes = make_glb(gltf);
  return gltf;
}

// --- meshes

// Metres, or what all meshes say in extras.units (as trimesh writes it).
double unit_of(const Gltf& gltf, const std::vector<GltfInstance>& instances) {
  std::optional<double> unit;
  for (const GltfInstance& instance : instances) {
    const GltfJson& mesh = gltf.json["meshes"][instance.mesh];
    const auto extras = mesh.find("extras");
    if (extras == mesh.end() || !extras->is_object() || !extras->contains("units") ||
        !(*extras)["units"].is_string())
      return 1;
    double named = 1;
    try {
      named = length_unit((*extras)["units"].get<std::string>());
    } catch (const InputError&) {
      return 1;
    }
    if (unit && *unit != named) return 1;
    unit = named;
  }
  return unit.value_or(1);
}

class GltfReader {
 public:
  GltfReader(const Gltf& gltf, const ImportInput& input) : gltf_(gltf), input_(input) {}

  Surface read() {
    const std::vector<GltfInstance> instances = gltf_instances(gltf_, input_.where);
    if (instances.empty()) throw InputError(input_.where, "shows no triangles: nothing to work on");
    const double unit = unit_of(gltf_, instances);
    surface_.polygon_offsets.push_back(0);
    for (const GltfInstance& instance : instances) add(instance);
    for (Vec3& vertex : surface_.vertices) vertex *= unit;
    if (colored_) surface_.polygon_columns[kColorColumn] = std::move(color_);
    assign_group_faces(surface_, polygon_part_, polygon_group_, group_names_, welded_);
    surface_.sources.push_back(source_in_unit("glb", unit));
    return std::move(surface_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(input_.where, what); }

  void add(const GltfInstance& instance) {
    const GltfJson& mesh = gltf_.json["meshes"][instance.mesh];
    refuse_morphing(mesh, instance);
    const std::size_t first = surface_.vertices.size();
    std::vector<std::size_t> begins;
    for (const std::size_t accessor : instance.positions) {
      begins.push_back(surface_.vertices.size());
      add_vertices(accessor, instance.transform);
      add_attributes(mesh, accessor, begins.back());
    }
    if (surface_.vertices.size() > 0xffffffffu) fail("holds too many vertices");
    const bool mirrored = instance.transform.topLeftCorner<3, 3>().determinant() < 0;
    for (const GltfJson& primitive : mesh["primitives"]) {
      if (!has_triangles(primitive, input_.where) || !primitive.contains("attributes") ||
          !primitive["attributes"].contains("POSITION"))
        continue;
      const std::size_t accessor = gltf_index(primitive["attributes"], "POSITION", input_.where);
      const auto at = std::find(instance.positions.begin(), instance.positions.end(), accessor);
      add_primitive(primitive, begins[static_cast<std::size_t>(at - instance.positions.begin())], mirrored);
    }
    const std::vector<Vec3> own(surface_.vertices.begin() + static_cast<std::ptrdiff_t>(first),
                                surface_.vertices.end());
    for (const std::uint32_t vertex : weld(own))
      welded_.push_back(static_cast<std::uint32_t>(first + vertex));
    surface_.parts.push_back({name_of(instance, mesh)});
  }

  void refuse_morphing(const GltfJson& mesh, const GltfInstance& instance) const {
    const GltfJson& node = gltf_.json["nodes"][instance.node];
    const GltfJson& weights =
        node.contains("weights") ? node["weights"] : mesh.value("weights", GltfJson::array());
    for (const GltfJson& weight : weights)
      if (weight != 0)
        fail(fmt::format("node {} shows a morphed mesh: export it in that shape, without morph targets",
                         instance.node));
  }

  [[nodiscard]] std::string name_of(const GltfInstance& instance, const GltfJson& mesh) const {
    const GltfJson& node = gltf_.json["nodes"][instance.node];
    for (const GltfJson* object : {&node, &mesh})
      if (object->contains("name") && (*object)["name"].is_string() && !(*object)["name"].empty())
        return clean_name((*object)["name"].get<std::string>());
    return "";
  }

  void add_vertices(std::size_t accessor, const Eigen::Matrix4d& transform) {
    const GltfAccessor at = gltf_accessor(gltf_, accessor, input_.where);
    if (at.components != 3) fail(fmt::format("is damaged: accessor {} is no list of positions", accessor));
    const std::vector<double> numbers = gltf_numbers(gltf_, at);
    for (std::size_t v = 0; v < at.count; ++v) {
      const Vec3 local(numbers[3 * v], numbers[3 * v + 1], numbers[3 * v + 2]);
      const Vec3 world = transform.topLeftCorner<3, 3>() * local + transform.topRightCorner<3, 1>();
      if (!world.allFinite())
        fail(fmt::format("vertex {} of accessor {} has a coordinate that is not a finite number", v + 1,
                         accessor));
      surface_.vertices.push_back(world);
    }
  }

  // Colours and own attributes (_NAME) of the vertices from `begin` on, of the first primitive that has them.
  void add_attributes(const GltfJson& mesh, std::size_t positions, std::size_t begin) {
    Columns columns;
    const std::size_t count = surface_.vertices.size() - begin;
    for (const GltfJson& primitive : mesh["primitives"]) {
      if (!primitive.contains("attributes") || !primitive["attributes"].contains("POSITION") ||
          gltf_index(primitive["attributes"], "POSITION", input_.where) != positions)
        continue;
      for (const auto& [name, accessor] : primitive["attributes"].items()) {
        const bool color = name == "COLOR_0";
        if (!color && !name.starts_with("_")) continue;
        Column column = read_column(primitive["attributes"], name, count, color);
        if (!column.values.empty())
          columns.try_emplace(color ? kColorColumn : own_name(name), std::move(column));
      }
    }
    append_columns(surface_.vertex_columns, begin, columns, count);
  }

  // "_QUALITY" as "quality".
  static std::string own_name(std::string name) {
    name.erase(0, std::min(name.find_first_not_of('_'), name.size()));
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return column_name(name);
  }

  // Empty where a value is not finite.
  Column read_column(const GltfJson& attributes, const std::string& name, std::size_t count, bool color) {
    const GltfAccessor at =
        gltf_accessor(gltf_, gltf_index(attributes, name.c_str(), input_.where), input_.where);
    if (at.count != count || (color && at.components < 3))
      fail(fmt::format("is damaged: {} does not fit the positions", clean_name(name)));
    Column column{static_cast<int>(at.components), gltf_numbers(gltf_, at)};
    for (std::size_t i = 0; i < column.values.size(); ++i) {
      double& value = column.values[i];
      if (!std::isfinite(value)) return {};
      if (!color) continue;
      value = std::clamp(value, 0.0, 1.0);
      if (i % at.components < 3) value = linear_to_srgb(value);
    }
    return column;
  }

  void add_primitive(const GltfJson& primitive, std::size_t begin, bool mirrored) {
    const std::vector<std::uint32_t> corners = gltf_corners(gltf_, primitive, input_.where);
    const std::size_t count =
        gltf_accessor(gltf_, gltf_index(primitive["attributes"], "POSITION", input_.where), input_.where)
            .count;
    for (std::size_t t = 0; t + 2 < corners.size(); t += 3) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t corner = corners[t + (mirrored ? (3 - i) % 3 : i)];
        if (corner >= count)
          fail(fmt::format("is damaged: a triangle names vertex {} (from 0), but there are only {}", corner,
                           count));
        surface_.polygon_vertices.push_back(static_cast<std::uint32_t>(begin + corner));
      }
      surface_.polygon_offsets.push_back(static_cast<std::uint32_t>(surface_.polygon_vertices.size()));
      polygon_part_.push_back(static_cast<std::uint32_t>(surface_.parts.size()));
      polygon_group_.push_back(static_cast<std::uint32_t>(group_names_.size()));
    }
    if (surface_.polygon_vertices.size() > 0xffffffffu) fail("holds too many triangles");
    add_material(primitive, corners.size() / 3);
  }

  // The material's name for the group and its colour for the triangles.
  void add_material(const GltfJson& primitive, std::size_t triangles) {
    std::array<double, 4> color = {1, 1, 1, 1};
    std::string name;
    if (primitive.contains("material")) {
      const GltfJson& material =
          gltf_entry(gltf_.json, "materials", gltf_index(primitive, "material", input_.where), input_.where);
      if (material.contains("name") && material["name"].is_string())
        name = clean_name(material["name"].get<std::string>());
      const GltfJson factor = material.value("pbrMetallicRoughness", GltfJson::object())
                                  .value("baseColorFactor", GltfJson::array());
      for (std::size_t i = 0; i < std::min<std::size_t>(4, factor.size()); ++i)
        if (factor[i].is_number()) color[i] = std::clamp(factor[i].get<double>(), 0.0, 1.0);
      colored_ = colored_ || color != std::array<double, 4>{1, 1, 1, 1};
    }
    for (std::size_t i = 0; i < 3; ++i) color[i] = linear_to_srgb(color[i]);
    for (std::size_t t = 0; t < triangles; ++t)
      color_.values.insert(color_.values.end(), color.begin(), color.end());
    group_names_.push_back(name);
  }

  const Gltf& gltf_;
  const ImportInput& input_;
  Surface surface_;
  std::vector<std::uint32_t> polygon_part_, polygon_group_;  // (polygons)
  std::vector<std::uint32_t> welded_;                        // (vertices) within each part
  std::vector<std::string> group_names_;
  Column color_{4, {}};
  bool colored_ = false;
};

// JSON that speaks of an asset somewhere near its beginning.
bool looks_like_gltf(std::string_view text) {
  return begins_with_word(text, "{") && text.find("\"asset\"") != std::string_view::npos;
}

Evidence sniff_gltf(const ImportInput& input) {
  const std::string_view text = beginning(input);
  if (text.starts_with("glTF")) return Evidence::magic;
  return looks_like_gltf(text) ? Evidence::weak : Evidence::none;
}

Surface read_gltf(ImportInput& input, const ImportOptions& options) {
  if (options.unit) throw InputError(input.where, "a glTF file carries its own unit: leave out --unit");
  try {
    const Gltf gltf = load_gltf(input);
    Surface surface = GltfReader(gltf, input).read();
    surface.sources[0].bytes = std::move(input.bytes);
    return surface;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(input.where, fmt::format("is damaged: {}", clean_name(error.what())));
  }
}

}  // namespace

constinit const FileReader kGltfReader{.format = &kGltfFormat, .sniff = sniff_gltf, .read = read_gltf};

}  // namespace flexel
