// Splits the triangles of a GLB. The accessors of a primitive's attributes become longer copies in single precision; its
// indices are listed anew. A mesh that several nodes show becomes one for each that is split. The new vertices of an
// accessor follow its old ones, which is another order than the surface's: SurfaceSource::order has it.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/error.h"
#include "formats/common/refine_files.h"
#include "formats/gltf/gltf_content.h"

namespace flexel {
namespace {

// The vertices of one POSITION accessor where one node shows them.
struct Range {
  std::size_t accessor = 0;
  std::uint32_t begin = 0, count = 0;  // in the surface
  std::vector<std::uint32_t> added{};  // new vertices of the surface
};

class GltfRefinement {
 public:
  GltfRefinement(const SurfaceSource& source, const Refinement& refinement)
      : where_(source.file),
        refinement_(refinement),
        first_piece_(first_pieces(refinement)),
        gltf_(parse_glb(source.bytes, source.file)),
        instances_(gltf_instances(gltf_, source.file)) {}

  std::string run(SurfaceSource& source) {
    find_ranges();
    std::vector<std::uint32_t> order;
    std::uint32_t polygon = 0;
    std::size_t range = 0;
    for (const GltfInstance& instance : instances_) {
      const std::span<const Range> own(ranges_.data() + range, instance.positions.size());
      range += own.size();
      if (const std::string held = split_mesh(instance, own, polygon); !held.empty()) return held;
      for (const Range& each : own) {
        for (std::uint32_t v = 0; v < each.count; ++v) order.push_back(each.begin + v);
        order.insert(order.end(), each.added.begin(), each.added.end());
      }
    }
    if (polygon + 1 != first_piece_.size())
      throw InputError(where_, "the embedded GLB has another number of triangles than the surface");
    source.bytes = make_glb(gltf_);
    source.order = std::move(order);
    return "";
  }

 private:
  void find_ranges() {
    std::uint32_t vertex = 0;
    for (const GltfInstance& instance : instances_)
      for (const std::size_t accessor : instance.positions) {
        const auto count = static_cast<std::uint32_t>(gltf_accessor(gltf_, accessor, where_).count);
        ranges_.push_back({accessor, vertex, count});
        vertex += count;
      }
    if (vertex != refinement_.vertices)
      throw InputError(where_, "the embedded GLB has another number of vertices than the surface");
    local_.resize(vertex + refinement_.ends.size());
    for (Range& range : ranges_)
      for (std::uint32_t v = 0; v < range.count; ++v) local_[range.begin + v] = v;
    for (std::uint32_t i = 0; i < refinement_.ends.size(); ++i) {
      std::uint32_t old = refinement_.ends[i][0];
      while (old >= refinement_.vertices) old = refinement_.ends_of(old)[0];
      const auto after =
          std::upper_bound(ranges_.begin(), ranges_.end(), old,
                           [](std::uint32_t v, const Range& range) { return v < range.begin; });
      Range& range = *std::prev(after);
      local_[refinement_.vertices + i] = range.count + static_cast<std::uint32_t>(range.added.size());
      range.added.push_back(refinement_.vertices + i);
    }
  }

  std::string split_mesh(const GltfInstance& instance, std::span<const Range> ranges,
                         std::uint32_t& polygon) {
    const bool splits =
        std::any_of(ranges.begin(), ranges.end(), [](const Range& range) { return !range.added.empty(); });
    const std::size_t mesh = splits ? own_gltf_mesh(gltf_, instance, where_) : instance.mesh;
    const bool mirrored = instance.transform.topLeftCorner<3, 3>().determinant() < 0;
    for (GltfJson& primitive : gltf_.json["meshes"][mesh]["primitives"]) {
      const auto attributes = primitive.find("attributes");
      if (attributes == primitive.end() || !attributes->contains("POSITION")) continue;
      const std::size_t accessor = gltf_index(*attributes, "POSITION", where_);
      const auto range = std::find_if(ranges.begin(), ranges.end(),
                                      [&](const Range& each) { return each.accessor == accessor; });
      const bool triangles = has_triangles(primitive, where_);
      const std::vector<std::uint32_t> corners =
          triangles ? gltf_corners(gltf_, primitive, where_) : std::vector<std::uint32_t>();
      const std::uint32_t first = polygon;
      polygon += static_cast<std::uint32_t>(corners.size() / 3);
      if (polygon >= first_piece_.size())
        throw InputError(where_, "the embedded GLB has another number of triangles than the surface");
      if (range == ranges.end() || range->added.empty()) continue;
      if (const std::string held = not_split(primitive); !held.empty()) return held;
      if (triangles) list_pieces(primitive, corners, first, mirrored);
      extend(primitive, *range, mesh);
    }
    return "";
  }

  // What is tied to the vertices or triangles in ways that are not known here.
  [[nodiscard]] static std::string not_split(const GltfJson& primitive) {
    if (primitive.contains("targets")) return "morph targets";
    if (!primitive.contains("indices") && primitive.value("mode", 4) < 4)
      return "lines or points without indices";
    const GltfJson extensions = primitive.value("extensions", GltfJson::object());
    for (const auto& [name, value] : extensions.items())
      if (name != "KHR_materials_variants") return fmt::format("the extension {}", name);
    for (const auto& [name, value] : primitive["attributes"].items())
      if (name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_")) return "the weights of a skeleton";
    return "";
  }

  void list_pieces(GltfJson& primitive, const std::vector<std::uint32_t>& corners, std::uint32_t first,
                   bool mirrored) {
    std::vector<std::uint32_t> listed;
    for (std::uint32_t t = 0; t < corners.size() / 3; ++t) {
      const std::uint32_t begin = first_piece_[first + t], end = first_piece_[first + t + 1];
      if (end - begin == 1) {
        listed.insert(listed.end(), corners.begin() + 3 * t, corners.begin() + 3 * t + 3);
        continue;
      }
      for (std::uint32_t piece = begin; piece < end; ++piece)
        for (const std::uint32_t i :
             mirrored ? std::array<std::uint32_t, 3>{0, 2, 1} : std::array<std::uint32_t, 3>{0, 1, 2})
          listed.push_back(local_[refinement_.corners[refinement_.offsets[piece] + i]]);
    }
    primitive["indices"] =
        append_gltf_accessor(gltf_, listed.data(), listed.size(), 1, kGltfWhole, kGltfElementBuffer);
    primitive.erase("mode");
  }

  void extend(GltfJson& primitive, const Range& range, std::size_t mesh) {
    for (auto& [name, accessor] : primitive["attributes"].items()) {
      const std::size_t old = gltf_index(primitive["attributes"], name.c_str(), where_);
      const auto [known, is_new] = extended_.emplace(std::tuple(mesh, range.accessor, old), 0);
      if (is_new) known->second = longer(name, old, range);
      accessor = known->second;
    }
  }

  std::size_t longer(const std::string& name, std::size_t old, const Range& range) {
    const GltfAccessor at = gltf_accessor(gltf_, old, where_);
    if (at.count != range.count)
      throw InputError(where_, fmt::format("is damaged: {} does not fit the positions", name));
    if (name.starts_with("_") && at.type != kGltfFloat && !at.normalized)
      return longer_labels(old, at, range);
    std::vector<double> numbers = gltf_numbers(gltf_, at);
    const std::size_t n = at.components;
    const bool direction = (name == "NORMAL" || name == "TANGENT") && n >= 3;
    for (const std::uint32_t vertex : range.added) {
      const auto [a, b] = refinement_.ends_of(vertex);
      const std::size_t i = n * local_[a], j = n * local_[b];
      for (std::size_t c = 0; c < n; ++c) numbers.push_back(0.5 * (numbers[i + c] + numbers[j + c]));
      if (!direction) continue;
      const Vec3 mean = mean_normal(Vec3(numbers[i], numbers[i + 1], numbers[i + 2]),
                                    Vec3(numbers[j], numbers[j + 1], numbers[j + 2]));
      const std::size_t last = numbers.size() - n;
      for (std::size_t c = 0; c < 3; ++c) numbers[last + c] = mean[static_cast<Eigen::Index>(c)];
      if (n == 4) numbers[last + 3] = numbers[i + 3];  // the handedness
    }
    const std::vector<float> floats(numbers.begin(), numbers.end());
    const std::size_t added =
        append_gltf_accessor(gltf_, floats.data(), floats.size() / n, n, kGltfFloat, kGltfArrayBuffer);
    if (name != "POSITION") return added;
    GltfFloats positions(floats.size() / 3);
    for (std::size_t i = 0; i < floats.size(); ++i) positions[i / 3][i % 3] = floats[i];
    set_gltf_bounds(gltf_.json["accessors"][added], positions);
    return added;
  }

  // Whole numbers of the file's own are labels: new vertices take those of one end, in the same type.
  std::size_t longer_labels(std::size_t old, const GltfAccessor& at, const Range& range) {
    constexpr std::uint32_t kShort = 5122, kUnsignedShort = 5123;
    const std::size_t each = at.type < kShort ? 1 : at.type <= kUnsignedShort ? 2 : 4;
    const std::size_t row = each * at.components, stride = (row + 3) / 4 * 4;
    std::vector<std::byte> rows(stride * (range.count + range.added.size()));
    for (std::size_t v = 0; v < range.count; ++v)
      std::copy_n(gltf_.binary.data() + at.begin + v * at.stride, row, rows.data() + v * stride);
    for (std::size_t i = 0; i < range.added.size(); ++i)
      std::copy_n(rows.data() + local_[refinement_.ends_of(range.added[i])[0]] * stride, row,
                  rows.data() + (range.count + i) * stride);
    gltf_.binary.resize((gltf_.binary.size() + 3) / 4 * 4);
    const std::size_t begin = gltf_.binary.size();
    gltf_.binary.resize(begin + rows.size());
    std::copy(rows.begin(), rows.end(), gltf_.binary.begin() + static_cast<std::ptrdiff_t>(begin));
    GltfJson& views = gltf_.json["bufferViews"];
    views.push_back({{"buffer", 0},
                     {"byteOffset", begin},
                     {"byteLength", rows.size()},
                     {"byteStride", stride},
                     {"target", kGltfArrayBuffer}});
    GltfJson accessor = gltf_.json["accessors"][old];
    accessor.erase("byteOffset");
    accessor["bufferView"] = views.size() - 1;
    accessor["count"] = range.count + range.added.size();
    gltf_.json["accessors"].push_back(std::move(accessor));
    gltf_.json["buffers"][0]["byteLength"] = gltf_.binary.size();
    return gltf_.json["accessors"].size() - 1;
  }

  const std::string& where_;
  const Refinement& refinement_;
  const std::vector<std::uint32_t> first_piece_;
  Gltf gltf_;
  std::vector<GltfInstance> instances_;
  std::vector<Range> ranges_;
  std::vector<std::uint32_t> local_;  // (vertices of the surface after) number within their range
  std::map<std::tuple<std::size_t, std::size_t, std::size_t>, std::size_t> extended_;
};

}  // namespace

std::string refine_glb(SurfaceSource& source, const Refinement& refinement) {
  try {
    return GltfRefinement(source, refinement).run(source);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(source.file, fmt::format("is damaged: {}", error.what()));
  }
}

}  // namespace flexel
