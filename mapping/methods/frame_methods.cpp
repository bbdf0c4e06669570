// Each distinct frame is rebuilt once from the deformed elements; a vertex then moves by a translation and a
// 3x3 product.
#include "mapping/methods/frame_methods.h"

#include <cstring>

#include "base/bucket.h"
#include "mapping/anchors/frame_kernel.h"
#include "mapping/methods/bind.h"

namespace flexel::mapping {
namespace {

template <bool orthonormal>
std::shared_ptr<const MethodBinding> keep_coordinates(MethodInput& input) {
  auto kept = std::make_shared<FrameCoordinates>();
  kept->orthonormal = orthonormal;
  kept->rest_base = std::move(input.rest_base);
  kept->coordinates = std::move(input.coordinates);
  return kept;
}

void save_coordinates(const MethodBinding& binding, Bytes& bytes) {
  const auto& kept = dynamic_cast<const FrameCoordinates&>(binding);
  const auto base = std::as_bytes(std::span(kept.rest_base));
  const auto coordinates = std::as_bytes(std::span(kept.coordinates));
  bytes.insert(bytes.end(), base.begin(), base.end());
  bytes.insert(bytes.end(), coordinates.begin(), coordinates.end());
}

template <bool orthonormal>
std::shared_ptr<const MethodBinding> load_coordinates(std::span<const std::byte> bytes, std::size_t frames,
                                                      std::size_t vertices) {
  auto kept = std::make_shared<FrameCoordinates>();
  kept->orthonormal = orthonormal;
  kept->rest_base.resize(frames);
  kept->coordinates.resize(vertices);
  const std::size_t of_frames = frames * sizeof(Mat3);
  if (frames > 0) std::memcpy(static_cast<void*>(kept->rest_base.data()), bytes.data(), of_frames);
  if (vertices == 0) return kept;
  std::memcpy(static_cast<void*>(kept->coordinates.data()), bytes.data() + of_frames,
              vertices * sizeof(Vec3));
  return kept;
}

}  // namespace

std::vector<Vec3> FrameCoordinates::apply(const Binding& binding, const Body& body,
                                          const std::vector<Vec3>& position) const {
  constexpr std::size_t kFramesAtATime = 1024, kVerticesAtATime = 8192;
  std::vector<AffineMap> affine;
  resize_touched(affine, binding.frames.size() + 1);
  parallel_chunks(binding.frames.size(), kFramesAtATime, [&](std::size_t begin, std::size_t end) {
    move_frames(&binding.frames[begin], end - begin, &rest_base[begin], body.rest.data(), position.data(),
                orthonormal, &affine[begin]);
    for (std::size_t f = begin; f < end; ++f) {
      if (binding.frames[f].kind == FrameKind::full) continue;
      const FrameMotion motion = frame_motion(binding.frames[f], body.rest, position, orthonormal);
      affine[f] << motion.translation, motion.change;
    }
  });
  std::vector<Vec3> displacement;
  resize_touched(displacement, binding.frame.size());
  parallel_chunks(displacement.size(), kVerticesAtATime, [&](std::size_t begin, std::size_t end) {
    apply_affine(affine.data(), &binding.frame[begin], &coordinates[begin], end - begin,
                 &displacement[begin]);
  });
  return displacement;
}

constinit const MappingMethod kGramSchmidt{.name = "gram-schmidt",
                                           .help = "the paper's",
                                           .orthonormal = true,
                                           .keeps_coordinates = true,
                                           .bind = keep_coordinates<true>,
                                           .file_number = 0,
                                           .bytes_a_frame = sizeof(Mat3),
                                           .bytes_a_vertex = sizeof(Vec3),
                                           .save = save_coordinates,
                                           .load = load_coordinates<true>};
constinit const MappingMethod kAffine{.name = "affine",

                                      .keeps_coordinates = true,
                                      .bind = keep_coordinates<false>,
                                      .file_number = 1,
                                      .bytes_a_frame = sizeof(Mat3),
                                      .bytes_a_vertex = sizeof(Vec3),
                                      .save = save_coordinates,
                                      .load = load_coordinates<false>};

}  // namespace flexel::mapping
