// A GLB is a header of 12 bytes and chunks: JSON, then the buffer. Everything that the JSON says of sizes and
// places is held against the buffer before it is used.
#include "formats/gltf/gltf_content.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/files/json.h"

namespace flexel {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian; bytes are copied");

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

[[noreturn]] void damaged(const std::string& where, const std::string& what) {
  throw InputError(where, "is damaged: " + what);
}

std::size_t whole(const GltfJson& value, const char* key, const std::string& where) {
  constexpr double kMost = 1e15;
  const double number = value.is_number() ? value.get<double>() : -1;
  if (!(number >= 0 && number < kMost) || number != std::floor(number))
    damaged(where, fmt::format("\"{}\" is not a whole number", key));
  return static_cast<std::size_t>(number);
}

std::size_t component_size(std::size_t type, const std::string& where) {
  switch (type) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case kGltfFloat:
      return 4;
    default:
      damaged(where, fmt::format("unknown componentType {}", type));
  }
}

std::size_t component_count(const GltfJson& accessor, const std::string& where) {
  const auto found = accessor.find("type");
  const std::string type = found != accessor.end() && found->is_string() ? found->get<std::string>() : "";
  constexpr std::pair<const char*, std::size_t> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  for (const auto& [name, count] : kTypes)
    if (type == name) return count;
  damaged(where, fmt::format("an accessor of a type \"{}\" that is not expected", type));
}

template <class T>
double number_from(const std::byte* at, bool normalized) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  if constexpr (std::is_integral_v<T>)
    if (normalized)
      return std::max(static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
  return static_cast<double>(value);
}

double number_at(const std::byte* at, std::uint32_t type, bool normalized) {
  switch (type) {
    case 5120:
      return number_from<std::int8_t>(at, normalized);
    case 5121:
      return number_from<std::uint8_t>(at, normalized);
    case 5122:
      return number_from<std::int16_t>(at, normalized);
    case 5123:
      return number_from<std::uint16_t>(at, normalized);
    case 5125:
      return number_from<std::uint32_t>(at, normalized);
    default:
      return number_from<float>(at, normalized);
  }
}

// The numbers of a list in the JSON; `fallback` where it is missing.
std::vector<double> list_of(const GltfJson& json, const char* key, std::vector<double> fallback,
                            const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) return fallback;
  const bool good =
      found->is_array() && found->size() == fallback.size() &&
      std::all_of(found->begin(), found->end(), [](const GltfJson& v) { return v.is_number(); });
  if (!good) damaged(where, fmt::format("\"{}\" of a node is no list of {} numbers", key, fallback.size()));
  return found->get<std::vector<double>>();
}

Eigen::Matrix4d local_transform(const GltfJson& node, const std::string& where) {
  if (node.contains("matrix")) {
    const std::vector<double> m = list_of(node, "matrix", std::vector<double>(16), where);
    return Eigen::Map<const Eigen::Matrix4d>(m.data());
  }
  const std::vector<double> t = list_of(node, "translation", {0, 0, 0}, where),
                            r = list_of(node, "rotation", {0, 0, 0, 1}, where),
                            s = list_of(node, "scale", {1, 1, 1}, where);
  const Eigen::Quaterniond turn(r[3], r[0], r[1], r[2]);
  if (!(turn.norm() > 0)) damaged(where, "the rotation of a node is zero");
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() =
      turn.normalized().toRotationMatrix() * Eigen::Vector3d(s[0], s[1], s[2]).asDiagonal();
  transform.topRightCorner<3, 1>() = Eigen::Vector3d(t[0], t[1], t[2]);
  return transform;
}

void refuse_compression(const GltfJson& json, const std::string& where) {
  const auto required = json.find("extensionsRequired");
  if (required == json.end() || !required->is_array()) return;
  for (const GltfJson& name : *required)
    for (const char* known :
         {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing"})
      if (name == known)
        throw InputError(where,
                         fmt::format("needs the extension {}, which is not read: export it without", known));
}

// Goes through the nodes of a scene.
class Walk {
 public:
  Walk(const Gltf& gltf, const std::string& where) : gltf_(gltf), where_(where) {
    const auto nodes = gltf.json.find("nodes");
    seen_.resize(nodes == gltf.json.end() || !nodes->is_array() ? 0 : nodes->size(), false);
  }

  std::vector<GltfInstance> run() {
    for (const std::size_t root : roots()) pending_.push_back({root, Eigen::Matrix4d::Identity()});
    std::reverse(pending_.begin(), pending_.end());
    while (!pending_.empty()) {
      const auto [node, parent] = pending_.back();
      pending_.pop_back();
      visit(node, parent);
    }
    return std::move(instances_);
  }

 private:
  // The roots of the scene that is shown; without scenes, the nodes without a parent.
  [[nodiscard]] std::vector<std::size_t> roots() const {
    const GltfJson& json = gltf_.json;
    if (json.contains("scenes") && json["scenes"].is_array() && !json["scenes"].empty()) {
      const std::size_t scene = gltf_index(json, "scene", 0, where_);
      return children(gltf_entry(json, "scenes", scene, where_), "nodes");
    }
    std::vector<bool> child(seen_.size(), false);
    for (std::size_t n = 0; n < seen_.size(); ++n)
      for (const std::size_t c : children(gltf_entry(json, "nodes", n, where_), "children"))
        if (c < child.size()) child[c] = true;
    std::vector<std::size_t> result;
    for (std::size_t n = 0; n < seen_.size(); ++n)
      if (!child[n]) result.push_back(n);
    return result;
  }

  [[nodiscard]] std::vector<std::size_t> children(const GltfJson& json, const char* key) const {
    std::vector<std::size_t> result;
    const auto found = json.find(key);
    if (found == json.end()) return result;
    if (!found->is_array()) damaged(where_, fmt::format("\"{}\" is no list", key));
    for (const GltfJson& child : *found) result.push_back(whole(child, key, where_));
    return result;
  }

  void visit(std::size_t number, const Eigen::Matrix4d& parent) {
    const GltfJson& node = gltf_entry(gltf_.json, "nodes", number, where_);
    if (seen_[number]) damaged(where_, fmt::format("node {} hangs on two others, or on itself", number));
    seen_[number] = true;
    const Eigen::Matrix4d transform = parent * local_transform(node, where_);
    if (node.contains("mesh")) add(number, node, transform);
    const std::vector<std::size_t> below = children(node, "children");
    for (auto child = below.rbegin(); child != below.rend(); ++child) pending_.push_back({*child, transform});
  }

  void add(std::size_t number, const GltfJson& node, const Eigen::Matrix4d& transform) {
    GltfInstance instance;
    instance.node = number;
    instance.mesh = gltf_index(node, "mesh", where_);
    instance.transform = transform;
    const GltfJson& mesh = gltf_entry(gltf_.json, "meshes", instance.mesh, where_);
    const std::size_t primitives = mesh.contains("primitives") ? mesh["primitives"].size() : 0;
    for (std::size_t p = 0; p < primitives; ++p) {
      const GltfJson& primitive = gltf_entry(mesh, "primitives", p, where_);
      if (!has_triangles(primitive, where_)) continue;
      const auto attributes = primitive.find("attributes");
      if (attributes == primitive.end() || !attributes->contains("POSITION")) continue;
      const std::size_t accessor = gltf_index(*attributes, "POSITION", where_);
      if (std::find(instance.positions.begin(), instance.positions.end(), accessor) ==
          instance.positions.end())
        instance.positions.push_back(accessor);
    }
    if (instance.positions.empty()) return;
    if (node.contains("skin"))
      throw InputError(where_, fmt::format("the mesh of node {} hangs on a skeleton: export it in its pose, "
                                           "without the skin",
                                           number));
    const double scale = transform.topLeftCorner<3, 3>().norm();
    if (!transform.allFinite() ||
        !(std::abs(transform.topLeftCorner<3, 3>().determinant()) > 1e-18 * scale * scale * scale))
      throw InputError(where_, fmt::format("node {} flattens its mesh: its scale is zero", number));
    instances_.push_back(std::move(instance));
  }

  struct Pending {
    std::size_t node;
    Eigen::Matrix4d parent;
  };
  const Gltf& gltf_;
  const std::string& where_;
  std::vector<bool> seen_;
  std::vector<Pending> pending_;
  std::vector<GltfInstance> instances_;
};

}  // namespace

bool looks_like_glb(std::span<const std::byte> bytes) {
  return bytes.size() >= 4 && word_at(bytes, 0) == kMagic;
}

GltfJson parse_gltf_json(std::string_view text, const std::string& where) {
  if (json_depth(text) > kDeepestJson)
    damaged(where, fmt::format("its JSON is nested more than {} deep", kDeepestJson));
  GltfJson json = parse_json(text);
  if (!json.is_object()) damaged(where, "its JSON does not parse");
  const auto asset = json.find("asset");
  const bool versioned = asset != json.end() && asset->is_object() && asset->contains("version") &&
                         (*asset)["version"].is_string();
  if (!versioned) damaged(where, "its JSON is not that of a glTF file: it names no version");
  if (!(*asset)["version"].get<std::string>().starts_with("2"))
    throw InputError(where, "is glTF of another version than 2.0, which is not read");
  return json;
}

Gltf parse_glb(std::span<const std::byte> bytes, const std::string& where) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (!looks_like_glb(bytes)) throw InputError(where, "is no GLB file");
  if (bytes.size() < kHeader + kChunkHeader) throw InputError(where, "is cut off");
  if (word_at(bytes, 4) != 2)
    throw InputError(where, "is glTF of another version than 2.0, which is not read");
  const std::size_t size = word_at(bytes, 8);
  if (size > bytes.size())
    throw InputError(where,
                     fmt::format("is cut off: {} of its {} bytes are missing", size - bytes.size(), size));
  Gltf gltf;
  bool json = false, binary = false;
  for (std::size_t at = kHeader; at + kChunkHeader <= size;) {
    const std::size_t length = word_at(bytes, at);
    const std::uint32_t type = word_at(bytes, at + 4);
    at += kChunkHeader;
    if (length > size - at) damaged(where, "a chunk is longer than the file");
    const std::span<const std::byte> chunk = bytes.subspan(at, length);
    if (type == kJsonChunk && !std::exchange(json, true))
      gltf.json = parse_gltf_json({reinterpret_cast<const char*>(chunk.data()), chunk.size()}, where);
    else if (type == kBinaryChunk && !std::exchange(binary, true))
      gltf.binary.assign(chunk.begin(), chunk.end());
    at += length;
  }
  if (!json) damaged(where, "it has no JSON chunk");
  return gltf;
}

Bytes make_glb(const Gltf& gltf) {
  std::string json = json_text(gltf.json);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (gltf.binary.size() + 3) / 4 * 4;
  const std::size_t size = 12 + 8 + json.size() + (padded > 0 ? 8 + padded : 0);
  if (size > 0xffffffffu) throw InputError("the part is too large for GLB, which ends at 4 GiB");
  Bytes bytes(size);
  std::size_t at = 0;
  const auto put = [&](const void* data, std::size_t length) {
    if (length > 0) std::memcpy(bytes.data() + at, data, length);
    at += length;
  };
  const auto put_words = [&](std::initializer_list<std::uint32_t> words) {
    for (const std::uint32_t word : words) put(&word, sizeof word);
  };
  put_words(
      {kMagic, 2, static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(json.size()), kJsonChunk});
  put(json.data(), json.size());
  if (padded > 0) put_words({static_cast<std::uint32_t>(padded), kBinaryChunk});
  put(gltf.binary.data(), gltf.binary.size());
  return bytes;
}

std::size_t gltf_index(const GltfJson& json, const char* key, const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end()) damaged(where, fmt::format("\"{}\" is missing", key));
  return whole(*found, key, where);
}

std::size_t gltf_index(const GltfJson& json, const char* key, std::size_t fallback,
                       const std::string& where) {
  return json.contains(key) ? gltf_index(json, key, where) : fallback;
}

const GltfJson& gltf_entry(const GltfJson& json, const char* key, std::size_t i, const std::string& where) {
  const auto list = json.find(key);
  if (list == json.end() || !list->is_array() || i >= list->size() || !(*list)[i].is_object())
    damaged(where, fmt::format("\"{}\" has no entry {}", key, i));
  return (*list)[i];
}

GltfAccessor gltf_accessor(const Gltf& gltf, std::size_t number, const std::string& where) {
  const GltfJson& json = gltf_entry(gltf.json, "accessors", number, where);
  if (json.contains("sparse"))
    throw InputError(where,
                     fmt::format("accessor {} is sparse, which is not read: export it without", number));
  if (!json.contains("bufferView"))
    damaged(where, fmt::format("accessor {} has no data (is the mesh compressed?)", number));
  GltfAccessor result;
  result.count = gltf_index(json, "count", where);
  result.components = component_count(json, where);
  const std::size_t type = gltf_index(json, "componentType", where);
  const std::size_t size = component_size(type, where) * result.components;
  result.type = static_cast<std::uint32_t>(type);
  result.normalized = json.contains("normalized") && json["normalized"] == true;
  const GltfJson& view = gltf_entry(gltf.json, "bufferViews", gltf_index(json, "bufferView", where), where);
  if (gltf_index(view, "buffer", where) != 0) damaged(where, "a view of a buffer that is not there");
  const std::size_t begin = gltf_index(view, "byteOffset", 0, where),
                    length = gltf_index(view, "byteLength", where),
                    offset = gltf_index(json, "byteOffset", 0, where);
  if (begin > gltf.binary.size() || length > gltf.binary.size() - begin)
    damaged(where, "a view reaches beyond the end of its buffer");
  result.stride = gltf_index(view, "byteStride", size, where);
  result.begin = begin + offset;
  if (result.stride < size ||
      (result.count > 0 && (offset > length || size > length - offset ||
                            result.count - 1 > (length - offset - size) / result.stride)))
    damaged(where, fmt::format("accessor {} reaches beyond the end of its view", number));
  return result;
}

std::vector<double> gltf_numbers(const Gltf& gltf, const GltfAccessor& accessor) {
  const std::size_t size = component_size(accessor.type, "");
  std::vector<double> numbers;
  numbers.reserve(accessor.count * accessor.components);
  for (std::size_t i = 0; i < accessor.count; ++i)
    for (std::size_t c = 0; c < accessor.components; ++c)
      numbers.push_back(number_at(gltf.binary.data() + accessor.begin + i * accessor.stride + c * size,
                                  accessor.type, accessor.normalized));
  return numbers;
}

std::vector<GltfInstance> gltf_instances(const Gltf& gltf, const std::string& where) {
  refuse_compression(gltf.json, where);
  return Walk(gltf, where).run();
}

bool has_triangles(const GltfJson& primitive, const std::string& where) {
  constexpr std::size_t kTriangles = 4, kFan = 6;
  const std::size_t mode = gltf_index(primitive, "mode", kTriangles, where);
  return mode >= kTriangles && mode <= kFan;
}

namespace {

std::vector<std::uint32_t> unrolled(const std::vector<std::uint32_t>& listed, bool strip) {
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i + 2 < listed.size(); ++i) {
    const std::size_t odd = i % 2;
    for (const std::size_t corner : strip ? std::array<std::size_t, 3>{i, i + 1 + odd, i + 2 - odd}
                                          : std::array<std::size_t, 3>{i + 1, i + 2, 0})
      corners.push_back(listed[corner]);
  }
  return corners;
}

}  // namespace

std::vector<std::uint32_t> gltf_corners(const Gltf& gltf, const GltfJson& primitive,
                                        const std::string& where) {
  std::vector<std::uint32_t> listed;
  if (primitive.contains("indices")) {
    const GltfAccessor at = gltf_accessor(gltf, gltf_index(primitive, "indices", where), where);
    if (at.components != 1 || at.type == kGltfFloat) damaged(where, "indices are no list of whole numbers");
    for (const double value : gltf_numbers(gltf, at)) {
      if (!(value >= 0)) damaged(where, "an index is negative");
      listed.push_back(static_cast<std::uint32_t>(value));
    }
  } else {
    const std::size_t accessor = gltf_index(primitive["attributes"], "POSITION", where);
    listed.resize(gltf_accessor(gltf, accessor, where).count);
    for (std::size_t i = 0; i < listed.size(); ++i) listed[i] = static_cast<std::uint32_t>(i);
  }
  const std::size_t mode = gltf_index(primitive, "mode", 4, where);
  if (mode != 4) return unrolled(listed, mode == 5);
  if (listed.size() % 3 != 0) damaged(where, "a list of triangles does not end with a whole one");
  return listed;
}

std::size_t append_gltf_accessor(Gltf& gltf, const void* data, std::size_t count, std::size_t components,
                                 std::uint32_t type, int target) {
  constexpr std::array<const char*, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const std::size_t size = 4 * components * count;
  gltf.binary.resize((gltf.binary.size() + 3) / 4 * 4);
  const std::size_t begin = gltf.binary.size();
  gltf.binary.resize(begin + size);
  if (size > 0) std::memcpy(gltf.binary.data() + begin, data, size);
  GltfJson& views = gltf.json["bufferViews"];
  views.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", size}, {"target", target}});
  GltfJson& accessors = gltf.json["accessors"];
  accessors.push_back({{"bufferView", views.size() - 1},
                       {"componentType", type},
                       {"count", count},
                       {"type", kTypes.at(components - 1)}});
  gltf.json["buffers"][0]["byteLength"] = gltf.binary.size();
  return accessors.size() - 1;
}

void set_gltf_bounds(GltfJson& accessor, const GltfFloats& positions) {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const auto& p : positions) {
    const Eigen::Vector3f at(p[0], p[1], p[2]);
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  accessor["min"] = {low.x(), low.y(), low.z()};
  accessor["max"] = {high.x(), high.y(), high.z()};
}

std::size_t own_gltf_mesh(Gltf& gltf, const GltfInstance& instance, const std::string& where) {
  GltfJson& nodes = gltf.json["nodes"];
  std::size_t shown = 0;
  for (const GltfJson& node : nodes)
    shown += node.contains("mesh") && gltf_index(node, "mesh", where) == instance.mesh;
  if (shown < 2) return instance.mesh;
  GltfJson& meshes = gltf.json["meshes"];
  meshes.push_back(GltfJson(meshes[instance.mesh]));
  nodes[instance.node]["mesh"] = meshes.size() - 1;
  return meshes.size() - 1;
}

double linear_to_srgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : std::min(1.0, 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
}

double srgb_to_linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

}  // namespace flexel
