// Interleaved sampling: each pixel of a 4 x 4 block takes a sixteenth of one set of directions (the R2
// sequence of M. Roberts, 2018), so that a block samples the sky evenly. Pixels with the same sixteenth are
// traced together, which keeps the rays of a packet nearly parallel.
#include "flexel/picture/render/light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "base/program/share_scope.h"

namespace flexel::picture {
namespace {

constexpr int kLightTile = 16, kBlock = 4;
constexpr int kSkyRays = 3, kLampRays = 1;  // a pixel
constexpr float kSkyReach = 0.7f;           // of the part's radius: what is farther away darkens nothing
constexpr float kLampSize = 0.22f;          // tangent of the lamp's half angle
constexpr float kLift = 2e-4f;              // off the surface, of the part's radius

// Points in the unit disc, evenly spread: some (place in the block, then ray) for each of the 16 blocks of a
// tile. Each block's set is the R2 sequence turned round the unit square by a shift of its own.
struct DiscPoints {
  std::array<std::array<Eigen::Vector2f, 16 * kSkyRays>, 16> of_block;
  DiscPoints() {
    const auto wrap = [](double x) { return x - std::floor(x); };
    for (std::size_t b = 0; b < of_block.size(); ++b)
      for (std::size_t j = 0; j < of_block[b].size(); ++j) {
        const auto n = static_cast<double>(j), shift = static_cast<double>(b * 7 % 16);
        const double radius = std::sqrt(wrap(0.5 + 0.7548776662466927 * n + 0.6180339887498949 * shift));
        const double angle = 2 * std::numbers::pi * wrap(0.5 + 0.5698402909980532 * n + shift / 16);
        of_block[b][j] = {static_cast<float>(radius * std::cos(angle)),
                          static_cast<float>(radius * std::sin(angle))};
      }
  }
};
const DiscPoints& disc_points() {
  static const DiscPoints points;
  return points;
}

// Cosine-weighted about the facet's normal.
Ray sky_ray(const Surfel& at, const Eigen::Vector2f& disc) {
  const TangentBase base = tangent_base(at.geometric);
  const Vec3f direction = disc.x() * base.x + disc.y() * base.y +
                          std::sqrt(std::max(0.0f, 1 - disc.squaredNorm())) * at.geometric;
  return {at.position + kLift * at.geometric, direction, 0, kSkyReach};
}

Ray lamp_ray(const Surfel& at, const Vec3f& lamp, const TangentBase& base, const Eigen::Vector2f& point) {
  const Eigen::Vector2f disc = kLampSize * point;
  return {at.lifted + kLift * at.geometric, (lamp + disc.x() * base.x + disc.y() * base.y).normalized(), 0,
          1e30f};
}

// Pixels of one tile that share a place in their blocks, with what they show.
struct Group {
  std::vector<std::size_t> pixels;
  std::vector<std::size_t> blocks;  // which of the tile's
  std::vector<Surfel> surfels;
};

Group gather(const PixelBuffer& buffer, const Viewport& viewport, const Camera& camera, const Drawable& drawn,
             int left, int top) {
  Group group;
  for (int y = top; y < std::min(top - top % kBlock + kLightTile, buffer.height); y += kBlock)
    for (int x = left; x < std::min(left - left % kBlock + kLightTile, buffer.width); x += kBlock) {
      const std::size_t i = buffer.index(x, y);
      if (buffer.hits[i].primitive == kNoHit) continue;
      const Ray ray =
          camera.ray(static_cast<float>(viewport.x + x) + 0.5f, static_cast<float>(viewport.y + y) + 0.5f);
      group.pixels.push_back(i);
      group.blocks.push_back(static_cast<std::size_t>(y / kBlock % 4 * 4 + x / kBlock % 4));
      group.surfels.push_back(surfel_at(drawn, ray, buffer.hits[i]));
    }
  return group;
}

void light_group(const Group& group, int place, const Tracer& tracer, const Vec3f& lamp,
                 std::vector<Light>& light) {
  const TangentBase base = tangent_base(lamp);
  std::vector<Ray> rays(group.pixels.size());
  std::vector<std::uint8_t> blocked(rays.size());
  std::vector<int> sky(rays.size(), 0), lamps(rays.size(), 0);
  const auto point = [&](std::size_t i, int k) -> const Eigen::Vector2f& {
    return disc_points().of_block[group.blocks[i]][static_cast<std::size_t>(16 * k + place)];
  };
  for (int k = 0; k < kSkyRays; ++k) {
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = sky_ray(group.surfels[i], point(i, k));
    tracer.occluded(rays, blocked);
    for (std::size_t i = 0; i < rays.size(); ++i) sky[i] += blocked[i];
  }
  for (int k = 0; k < kLampRays; ++k) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      rays[i] = lamp_ray(group.surfels[i], lamp, base, point(i, k));
      // A point whose facet looks away needs no ray, unless the smooth surface would see the lamp.
      if (group.surfels[i].normal.dot(lamp) <= 0) rays[i].far = 0;
    }
    tracer.occluded(rays, blocked);
    for (std::size_t i = 0; i < rays.size(); ++i) lamps[i] += blocked[i];
  }
  for (std::size_t i = 0; i < rays.size(); ++i)
    light[group.pixels[i]] = {1 - static_cast<float>(sky[i]) / kSkyRays,
                              1 - static_cast<float>(lamps[i]) / kLampRays};
}

// How far pixel q is on the same smooth surface as a point with this normal and place.
float kinship(const Vec3f& normal, const Vec3f& other, float off_plane, float tolerance) {
  const float turn = std::clamp((normal.dot(other) - 0.8f) * 5, 0.0f, 1.0f);
  return turn * turn * std::max(0.0f, 1 - std::abs(off_plane) / tolerance);
}

// The mean over seven by seven pixels that are `stride` apart.
std::vector<Light> smooth_at(const std::vector<Light>& light, const PixelBuffer& buffer, const Camera& camera,
                             int stride) {
  const float pixel = 1 / camera.pixels, tolerance = 3 * pixel;
  std::vector<Light> smooth(light.size());
  const auto smooth_pixel = [&](int x, int y) {
    const std::size_t i = buffer.index(x, y);
    if (buffer.hits[i].primitive == kNoHit) return;
    const Vec3f normal = buffer.normals[i];
    // The plane through the point, as depth over pixels.
    const float facing = std::max(0.05f, -normal.dot(camera.forward));
    const float a = normal.dot(camera.right) * pixel, b = -normal.dot(camera.up) * pixel;
    float sky = 0, lamp = 0, total = 0;
    for (int dv = -3; dv <= 3; ++dv)
      for (int du = -3; du <= 3; ++du) {
        const int u = x + stride * du, v = y + stride * dv;
        if (u < 0 || v < 0 || u >= buffer.width || v >= buffer.height) continue;
        const std::size_t j = buffer.index(u, v);
        if (buffer.hits[j].primitive == kNoHit) continue;
        const float off = a * static_cast<float>(u - x) + b * static_cast<float>(v - y) -
                          facing * (buffer.hits[j].t - buffer.hits[i].t);
        const auto tent = static_cast<float>((4 - std::abs(du)) * (4 - std::abs(dv)));
        const float weight = tent * (j == i ? 1 : kinship(normal, buffer.normals[j], off, tolerance));
        sky += weight * light[j].sky;
        lamp += weight * light[j].lamp;
        total += weight;
      }
    smooth[i] = {sky / total, lamp / total};
  };
  parallel_for_each(
      static_cast<std::size_t>(buffer.height),
      [&](std::size_t y) {
        for (int x = 0; x < buffer.width; ++x) smooth_pixel(x, static_cast<int>(y));
      },
      8);
  return smooth;
}

}  // namespace

Vec3f lamp_direction(const Camera& camera) {
  return (-0.50f * camera.right + 0.72f * camera.up - 0.62f * camera.forward).normalized();
}

std::vector<Light> trace_light(const PixelBuffer& buffer, const Viewport& viewport, const Camera& camera,
                               const Drawable& drawn, const Tracer& tracer) {
  std::vector<Light> light(buffer.hits.size());
  const int across = (buffer.width + kLightTile - 1) / kLightTile,
            down = (buffer.height + kLightTile - 1) / kLightTile;
  const Vec3f lamp = lamp_direction(camera);
  const std::size_t tiles = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
  ShareCounter done(tiles);
  parallel_for_each(
      tiles,
      [&](std::size_t tile) {
        const int left = static_cast<int>(tile) % across * kLightTile,
                  top = static_cast<int>(tile) / across * kLightTile;
        for (int place = 0; place < kBlock * kBlock; ++place) {
          // A permutation of the places, so that neighbours get distant points of the sequence.
          const Group group =
              gather(buffer, viewport, camera, drawn, left + place % kBlock, top + place / kBlock);
          if (!group.pixels.empty()) light_group(group, place * 7 % 16, tracer, lamp, light);
        }
        done.add(1);
      },
      4);
  return light;
}

std::vector<Light> smooth_light(const std::vector<Light>& light, const PixelBuffer& buffer,
                                const Camera& camera) {
  return smooth_at(smooth_at(light, buffer, camera, 1), buffer, camera, kBlock);
}

}  // namespace flexel::picture
