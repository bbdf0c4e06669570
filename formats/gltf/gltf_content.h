// glTF 2.0 (Khronos, 2021) as one GLB: its JSON and its one binary buffer. For reading a file and for writing
// it again with other positions or split triangles. Only formats/gltf uses this.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"
#include "base/math/vec.h"

namespace flexel {

using GltfJson = nlohmann::ordered_json;

constexpr std::uint32_t kGltfFloat = 5126, kGltfWhole = 5125;
constexpr int kGltfArrayBuffer = 34962, kGltfElementBuffer = 34963;

struct Gltf {
  GltfJson json;
  Bytes binary;  // buffer 0
};

// True when the bytes begin like a GLB.
[[nodiscard]] bool looks_like_glb(std::span<const std::byte> bytes);

// Takes a GLB apart; its buffer is empty where it has no binary chunk. Throws InputError: no GLB, cut off, of
// another version, damaged JSON.
[[nodiscard]] Gltf parse_glb(std::span<const std::byte> bytes, const std::string& where);
// The JSON alone, as a .gltf file has it.
[[nodiscard]] GltfJson parse_gltf_json(std::string_view text, const std::string& where);
[[nodiscard]] Bytes make_glb(const Gltf& gltf);

// The whole number `json[key]`. Throws InputError where it is missing, negative, or no whole number.
[[nodiscard]] std::size_t gltf_index(const GltfJson& json, const char* key, const std::string& where);
[[nodiscard]] std::size_t gltf_index(const GltfJson& json, const char* key, std::size_t fallback,
                                     const std::string& where);
// Entry i of the list `json[key]`, an object. Throws InputError where there is none.
[[nodiscard]] const GltfJson& gltf_entry(const GltfJson& json, const char* key, std::size_t i,
                                         const std::string& where);

// Where an accessor's numbers are in the buffer.
struct GltfAccessor {
  std::size_t count = 0, components = 1;
  std::uint32_t type = kGltfFloat;  // componentType
  bool normalized = false;
  std::size_t begin = 0, stride = 0;  // bytes
};
// Throws InputError: it reaches out of its view or the buffer, has no data, is sparse.
[[nodiscard]] GltfAccessor gltf_accessor(const Gltf& gltf, std::size_t accessor, const std::string& where);
// (count x components), integers that are normalized as -1 ... 1.
[[nodiscard]] std::vector<double> gltf_numbers(const Gltf& gltf, const GltfAccessor& accessor);

// A mesh where a node of the scene puts it.
struct GltfInstance {
  std::size_t node = 0, mesh = 0;
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  // node to world
  std::vector<std::size_t> positions;  // the POSITION accessors of its triangles, each once, in order of use
};
// The instances of the scene that is shown, in the order of its nodes (each before its children); those
// without triangles left out. Throws InputError: nodes in a circle, a transform that flattens, a skin, a
// compression that is not read.
[[nodiscard]] std::vector<GltfInstance> gltf_instances(const Gltf& gltf, const std::string& where);

// True when a primitive is made of triangles (also strips and fans).
[[nodiscard]] bool has_triangles(const GltfJson& primitive, const std::string& where);

// Of a primitive with triangles: three indices each, strips and fans unrolled.
[[nodiscard]] std::vector<std::uint32_t> gltf_corners(const Gltf& gltf, const GltfJson& primitive,
                                                      const std::string& where);

// Appends numbers of four bytes as an accessor with its own view, and returns its number.
std::size_t append_gltf_accessor(Gltf& gltf, const void* data, std::size_t count, std::size_t components,
                                 std::uint32_t type, int target);
// Three numbers of single precision for each vertex.
using GltfFloats = std::vector<std::array<float, 3>>;
void set_gltf_bounds(GltfJson& accessor, const GltfFloats& positions);

// The mesh of the instance, for it alone: a copy where other nodes show it too.
std::size_t own_gltf_mesh(Gltf& gltf, const GltfInstance& instance, const std::string& where);

// Colours: glTF has linear intensities, the columns of a surface those of screens (sRGB, IEC 61966-2-1).
[[nodiscard]] double linear_to_srgb(double linear);
[[nodiscard]] double srgb_to_linear(double srgb);

}  // namespace flexel
