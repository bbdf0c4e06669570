// Writes GLB. From glTF: the same JSON and buffer with other positions and normals. Nodes and their
// transforms stay; the new positions of a mesh are its deformed vertices taken back through the node's
// transform. A mesh that several nodes show becomes one mesh for each instance that moved. New numbers
// overwrite the old where nothing else uses these; else they are appended to the buffer. From other sources:
// a mesh and a node a part, in metres.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/version.h"
#include "formats/common/normal_change.h"
#include "formats/common/surface_writers.h"
#include "formats/gltf/gltf_content.h"

namespace flexel {
namespace {

float single(double value) {
  const auto number = static_cast<float>(value);
  if (!std::isfinite(number))
    throw InputError("the part does not fit the single precision of GLB: write in another format");
  return number;
}

// The rewriting of one source.
class GltfRewrite {
 public:
  explicit GltfRewrite(const DeformedSurface& deformed)
      : deformed_(deformed),
        source_(deformed.surface.sources[0]),
        displacement_(in_file_order(deformed.displacement)),
        gltf_(parse_glb(source_.bytes, source_.file)),
        instances_(gltf_instances(gltf_, source_.file)) {}

  Bytes run() {
    changes_ = in_file_order(vertex_normal_changes(deformed_));
    std::size_t vertex = 0;
    for (const GltfInstance& instance : instances_) {
      std::vector<std::size_t> begins;
      for (const std::size_t accessor : instance.positions) {
        begins.push_back(vertex);
        vertex += gltf_accessor(gltf_, accessor, source_.file).count;
      }
      if (vertex > displacement_.size()) break;
      const auto from = displacement_.begin();
      const bool moved = std::any_of(from + static_cast<std::ptrdiff_t>(begins.front()),
                                     from + static_cast<std::ptrdiff_t>(vertex),
                                     [](const Vec3& d) { return d != Vec3::Zero(); });
      if (moved) rewrite(instance, begins);
    }
    if (vertex != displacement_.size())
      throw InputError(source_.file, "the embedded GLB has another number of vertices than the surface");
    return changed_ ? make_glb(gltf_) : source_.bytes;
  }

 private:
  void rewrite(const GltfInstance& instance, const std::vector<std::size_t>& begins) {
    changed_ = true;
    const std::size_t mesh = own_gltf_mesh(gltf_, instance, source_.file);
    for (std::size_t i = 0; i < begins.size(); ++i) {
      const std::size_t old = instance.positions[i];
      const GltfFloats positions = new_positions(instance, old, begins[i]);
      const std::size_t accessor = put(old, positions);
      set_gltf_bounds(gltf_.json["accessors"][accessor], positions);
      std::map<std::size_t, std::size_t> normals;  // old accessor to new
      for (GltfJson& primitive : gltf_.json["meshes"][mesh]["primitives"]) {
        if (!primitive.contains("attributes") || !primitive["attributes"].contains("POSITION") ||
            gltf_index(primitive["attributes"], "POSITION", source_.file) != old)
          continue;
        primitive["attributes"]["POSITION"] = accessor;
        if (!primitive["attributes"].contains("NORMAL")) continue;
        const std::size_t normal = gltf_index(primitive["attributes"], "NORMAL", source_.file);
        if (!normals.contains(normal))
          normals[normal] = put(normal, new_normals(instance, normal, begins[i]));
        primitive["attributes"]["NORMAL"] = normals[normal];
      }
    }
  }

  // What the surface's vertices have, as the file's come.
  template <class Value>
  [[nodiscard]] std::vector<Value> in_file_order(const std::vector<Value>& values) const {
    if (source_.order.empty()) return values;
    std::vector<Value> result;
    result.reserve(values.size());
    for (const std::uint32_t v : source_.order) result.push_back(values.at(v));
    return result;
  }

  // In the mesh's own frame; a vertex that did not move keeps its numbers.
  GltfFloats new_positions(const GltfInstance& instance, std::size_t accessor, std::size_t begin) const {
    const GltfAccessor at = gltf_accessor(gltf_, accessor, source_.file);
    const std::vector<double> old = gltf_numbers(gltf_, at);
    const Eigen::Matrix3d back = instance.transform.topLeftCorner<3, 3>().inverse();
    GltfFloats positions(at.count);
    for (std::size_t v = 0; v < at.count; ++v) {
      const Vec3 moved = back * displacement_[begin + v] / source_.unit;
      for (std::size_t i = 0; i < 3; ++i)
        positions[v][i] = single(old[3 * v + i] + moved[static_cast<Eigen::Index>(i)]);
    }
    return positions;
  }

  GltfFloats new_normals(const GltfInstance& instance, std::size_t accessor, std::size_t begin) const {
    const GltfAccessor at = gltf_accessor(gltf_, accessor, source_.file);
    const std::vector<double> old = gltf_numbers(gltf_, at);
    if (at.components != 3 || begin + at.count > changes_.size())
      throw InputError(source_.file, "is damaged: its normals do not fit its positions");
    // Normals go to the world by the inverse transpose, and back by the transpose.
    const Eigen::Matrix3d transpose = instance.transform.topLeftCorner<3, 3>().transpose();
    const Eigen::Matrix3d out = transpose.inverse();
    GltfFloats normals(at.count);
    for (std::size_t v = 0; v < at.count; ++v) {
      Vec3 normal(old[3 * v], old[3 * v + 1], old[3 * v + 2]);
      if (const auto rotation = turn(changes_[begin + v]); rotation && normal.allFinite())
        normal = (transpose * (*rotation * (out * normal))).normalized() * normal.norm();
      for (std::size_t i = 0; i < 3; ++i)
        normals[v][i] = static_cast<float>(normal[static_cast<Eigen::Index>(i)]);
    }
    return normals;
  }

  // Writes the numbers over those of `accessor` where no other use of them is left, else appends them;
  // returns the accessor that then has them.
  std::size_t put(std::size_t accessor, const GltfFloats& numbers) {
    const GltfAccessor at = gltf_accessor(gltf_, accessor, source_.file);
    if (at.type == kGltfFloat && !shared(accessor)) {
      for (std::size_t i = 0; i < numbers.size(); ++i)
        std::memcpy(gltf_.binary.data() + at.begin + i * at.stride, numbers[i].data(), 12);
      return accessor;
    }
    const std::size_t added =
        append_gltf_accessor(gltf_, numbers.data(), numbers.size(), 3, kGltfFloat, kGltfArrayBuffer);
    return added;
  }

  // True where the numbers of an accessor are used twice: by other meshes, in another place of a primitive,
  // or by another accessor of the same bytes.
  [[nodiscard]] bool shared(std::size_t accessor) const {
    std::size_t meshes = 0;
    for (const GltfJson& mesh : gltf_.json["meshes"]) meshes += uses(mesh, accessor);
    return meshes > 1 || overlapped(accessor);
  }

  bool uses(const GltfJson& mesh, std::size_t accessor) const {
    const auto named = [&](const GltfJson& attributes) {
      return std::any_of(attributes.begin(), attributes.end(), [&](const GltfJson& value) {
        return value.is_number() && value.get<double>() == static_cast<double>(accessor);
      });
    };
    for (const GltfJson& primitive : mesh.value("primitives", GltfJson::array())) {
      if (named(primitive.value("attributes", GltfJson::object()))) return true;
      for (const GltfJson& target : primitive.value("targets", GltfJson::array()))
        if (named(target)) return true;
    }
    return false;
  }

  // Whether another accessor reads these bytes; one that is damaged, which nothing shown uses, may.
  [[nodiscard]] bool overlapped(std::size_t accessor) const try {
    const GltfAccessor own = gltf_accessor(gltf_, accessor, source_.file);
    const std::size_t own_end = own.begin + own.count * own.stride;
    for (std::size_t other = 0; other < gltf_.json["accessors"].size(); ++other) {
      const GltfJson& json = gltf_.json["accessors"][other];
      if (other == accessor || !json.contains("bufferView") || json.contains("sparse") ||
          json.value("type", "").starts_with("MAT"))
        continue;
      const GltfAccessor at = gltf_accessor(gltf_, other, source_.file);
      const bool apart = at.begin >= own_end || at.begin + at.count * at.stride <= own.begin;
      const bool interleaved = at.stride == own.stride && own.stride >= 12 + 1 &&
                               (at.begin + own.stride - own.begin % own.stride) % own.stride >= 12;
      if (!apart && !interleaved) return true;
    }
    return false;
  } catch (const InputError&) {
    return true;
  }

  const DeformedSurface& deformed_;
  const SurfaceSource& source_;
  std::vector<Vec3> displacement_;  // (vertices of the file x 3) m
  Gltf gltf_;
  std::vector<GltfInstance> instances_;
  std::vector<NormalChange> changes_;
  bool changed_ = false;
};

// --- new files

// Writes one part after the other.
class GltfMaker {
 public:
  explicit GltfMaker(const DeformedSurface& deformed) : deformed_(deformed) {
    gltf_.json = {{"asset", {{"version", "2.0"}, {"generator", fmt::format("Flexel {}", version())}}},
                  {"scene", 0},
                  {"scenes", {{{"nodes", GltfJson::array()}}}},
                  {"nodes", GltfJson::array()},
                  {"meshes", GltfJson::array()},
                  {"buffers", {{{"byteLength", 0}}}},
                  {"bufferViews", GltfJson::array()},
                  {"accessors", GltfJson::array()}};
    const auto color = deformed.surface.polygon_columns.find(kColorColumn);
    if (color != deformed.surface.polygon_columns.end()) color_ = &color->second;
  }

  Bytes run() {
    const Surface& surface = deformed_.surface;
    std::vector<std::vector<std::uint32_t>> polygons(surface.parts.size());
    for (std::size_t p = 0; p < surface.polygon_count(); ++p)
      polygons[surface.polygon_part(p)].push_back(static_cast<std::uint32_t>(p));
    const Triangles triangles = triangulate(surface);
    local_.resize(surface.vertices.size());
    for (std::size_t part = 0; part < polygons.size(); ++part)
      if (!polygons[part].empty()) add_part(part, polygons[part], triangles);
    return make_glb(gltf_);
  }

 private:
  // Polygons that one primitive holds: those of one face, where the part's faces have names, and one colour.
  using Group = std::pair<std::uint32_t, std::vector<double>>;

  void add_part(std::size_t part, const std::vector<std::uint32_t>& polygons, const Triangles& triangles) {
    const GltfJson attributes = add_vertices(polygons);
    std::vector<std::pair<Group, std::vector<std::uint32_t>>> groups;  // in order of appearance
    std::map<Group, std::size_t> numbers;
    for (const std::uint32_t p : polygons) {
      const Group group = group_of(p);
      const auto [entry, added] = numbers.emplace(group, groups.size());
      if (added) groups.push_back({group, {}});
      const std::size_t first = deformed_.surface.polygon_offsets[p] - 2 * std::size_t{p},
                        last = deformed_.surface.polygon_offsets[p + 1] - 2 * (std::size_t{p} + 1);
      for (std::size_t t = first; t < last; ++t)
        for (const std::uint32_t v : triangles.corners[t]) groups[entry->second].second.push_back(local_[v]);
    }
    GltfJson primitives = GltfJson::array();
    for (const auto& [group, corners] : groups) {
      GltfJson primitive = {{"attributes", attributes},
                            {"indices", append_gltf_accessor(gltf_, corners.data(), corners.size(), 1,
                                                             kGltfWhole, kGltfElementBuffer)}};
      if (const std::string name = face_name(group); !name.empty() || !group.second.empty())
        primitive["material"] = material(name, group.second);
      primitives.push_back(std::move(primitive));
    }
    const std::string& name = deformed_.surface.parts[part].name;
    gltf_.json["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
    gltf_.json["nodes"].push_back({{"name", name}, {"mesh", gltf_.json["meshes"].size() - 1}});
    gltf_.json["scenes"][0]["nodes"].push_back(gltf_.json["nodes"].size() - 1);
  }

  [[nodiscard]] Group group_of(std::uint32_t p) const {
    const std::uint32_t face = deformed_.surface.polygon_face[p];
    Group group{deformed_.surface.faces[face].name.empty() ? kNoFace : face, {}};
    if (color_ != nullptr) {
      const auto components = static_cast<std::size_t>(color_->components);
      const double* values = &color_->values[components * p];
      group.second.assign(values, values + components);
    }
    return group;
  }

  [[nodiscard]] std::string face_name(const Group& group) const {
    return group.first == kNoFace ? "" : deformed_.surface.faces[group.first].name;
  }

  // The vertices of these polygons in the surface's order; local_ has their numbers.
  GltfJson add_vertices(const std::vector<std::uint32_t>& polygons) {
    std::vector<std::uint32_t> used;
    for (const std::uint32_t p : polygons) {
      const auto corners = deformed_.surface.polygon(p);
      used.insert(used.end(), corners.begin(), corners.end());
    }
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    GltfFloats positions(used.size());
    for (std::size_t v = 0; v < used.size(); ++v) {
      local_[used[v]] = static_cast<std::uint32_t>(v);
      const Vec3 at = deformed_.surface.vertices[used[v]] + deformed_.displacement[used[v]];  // m
      for (std::size_t i = 0; i < 3; ++i) positions[v][i] = single(at[static_cast<Eigen::Index>(i)]);
    }
    const std::size_t accessor =
        append_gltf_accessor(gltf_, positions.data(), positions.size(), 3, kGltfFloat, kGltfArrayBuffer);
    set_gltf_bounds(gltf_.json["accessors"][accessor], positions);
    GltfJson attributes = {{"POSITION", accessor}};
    for (const auto& [name, column] : deformed_.surface.vertex_columns)
      if (column.components <= 4)
        attributes[attribute_name(name)] = add_column(column, name == kColorColumn, used);
    return attributes;
  }

  // "quality" as "_QUALITY", as the format demands of own attributes.
  static std::string attribute_name(const std::string& name) {
    if (name == kColorColumn) return "COLOR_0";
    std::string upper = "_" + name;
    for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return upper;
  }

  std::size_t add_column(const Column& column, bool color, const std::vector<std::uint32_t>& used) {
    const auto components = static_cast<std::size_t>(column.components);
    std::vector<float> values;
    values.reserve(used.size() * components);
    for (const std::uint32_t v : used)
      for (std::size_t c = 0; c < components; ++c) {
        const double value = column.values[v * components + c];
        values.push_back(single(color && c < 3 ? srgb_to_linear(value) : value));
      }
    return append_gltf_accessor(gltf_, values.data(), used.size(), components, kGltfFloat, kGltfArrayBuffer);
  }

  std::size_t material(const std::string& name, const std::vector<double>& color) {
    GltfJson json = GltfJson::object();
    if (!name.empty()) json["name"] = name;
    GltfJson look = {{"metallicFactor", 0.0}, {"roughnessFactor", 0.6}};
    if (!color.empty()) {
      const double opacity = color.size() == 4 ? color[3] : 1;
      look["baseColorFactor"] = {srgb_to_linear(color[0]), srgb_to_linear(color[1]), srgb_to_linear(color[2]),
                                 opacity};
      if (opacity < 1) json["alphaMode"] = "BLEND";
    }
    json["pbrMetallicRoughness"] = look;
    const auto found = materials_.emplace(json_text(json), materials_.size());
    if (found.second) gltf_.json["materials"].push_back(std::move(json));
    return found.first->second;
  }

  static constexpr std::uint32_t kNoFace = 0xffffffffu;
  const DeformedSurface& deformed_;
  const Column* color_ = nullptr;  // of the polygons
  Gltf gltf_;
  std::vector<std::uint32_t> local_;  // (vertices) number within its part's vertices
  std::map<std::string, std::size_t> materials_;
};

}  // namespace

void rewrite_glb(const DeformedSurface& deformed, OutputFile& out) {
  try {
    const Bytes bytes = GltfRewrite(deformed).run();
    out.write(bytes.data(), bytes.size());
  } catch (const nlohmann::json::exception& error) {
    throw InputError(deformed.surface.sources[0].file, fmt::format("is damaged: {}", error.what()));
  }
}

void write_new_glb(const DeformedSurface& deformed, OutputFile& out) {
  const Bytes bytes = GltfMaker(deformed).run();
  out.write(bytes.data(), bytes.size());
}

}  // namespace flexel
