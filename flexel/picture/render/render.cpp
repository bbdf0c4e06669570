// One ray through the centre of each pixel, the light there (light.h), the colour. Then pixels that differ
// from a neighbour are supersampled with sixteen rays, which interpolate the light of the pixels around.
#include "flexel/picture/render/render.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "flexel/picture/canvas/colour_map.h"
#include "flexel/picture/render/light.h"
#include "flexel/picture/render/surfel.h"
#include "flexel/picture/render/thickness.h"

namespace flexel::picture {
namespace {

constexpr int kTile = 16;
constexpr int kFine = 4;                 // rays across a pixel that is drawn again
constexpr float kContrast = 7.0f / 255;  // from a neighbour, that asks for it

constexpr std::array<std::uint32_t, 8> kTints{0xb4c3d4, 0xe3b98f, 0xa9c9a4, 0xd3a5a5,
                                              0xc0b2d6, 0x9cc9c9, 0xd9cf98, 0xc9c2ba};

struct Scene {
  const Viewport& viewport;
  const Camera& camera;
  const Drawable& drawn;
  const Tracer& tracer;
  const ShadeOptions& options;
  Vec3f lamp = lamp_direction(camera), half = (lamp - camera.forward).normalized();

  [[nodiscard]] Ray ray(int x, int y, float dx = 0.5f, float dy = 0.5f) const {
    return camera.ray(static_cast<float>(viewport.x + x) + dx, static_cast<float>(viewport.y + y) + dy);
  }
};

void trace_tile(const Scene& scene, int left, int top, PixelBuffer& buffer) {
  std::vector<Ray> rays;
  std::vector<std::size_t> pixels;
  // In blocks of 4 x 4, the packets of the tracer.
  for (int n = 0; n < kTile * kTile; ++n) {
    const int x = left + 4 * (n / 16 % 4) + n % 4, y = top + 4 * (n / 64) + n / 4 % 4;
    if (x >= buffer.width || y >= buffer.height) continue;
    rays.push_back(scene.ray(x, y));
    pixels.push_back(buffer.index(x, y));
  }
  std::vector<Hit> hits(rays.size());
  scene.tracer.intersect(rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    buffer.hits[pixels[i]] = hits[i];
    if (hits[i].primitive != kNoHit)
      buffer.normals[pixels[i]] = surfel_at(scene.drawn, rays[i], hits[i]).normal;
  }
}

PixelBuffer trace_pixels(const Scene& scene) {
  PixelBuffer buffer{scene.viewport.width, scene.viewport.height, {}, {}};
  buffer.hits.resize(buffer.index(0, buffer.height));
  buffer.normals.resize(buffer.hits.size());
  const int across = (buffer.width + kTile - 1) / kTile, down = (buffer.height + kTile - 1) / kTile;
  const std::size_t tiles = static_cast<std::size_t>(across) * static_cast<std::size_t>(down);
  ShareCounter done(tiles);
  parallel_for_each(
      tiles,
      [&](std::size_t tile) {
        trace_tile(scene, static_cast<int>(tile) % across * kTile, static_cast<int>(tile) / across * kTile,
                   buffer);
        done.add(1);
      },
      4);
  return buffer;
}

// colour_of() as linear light, from a table fine enough for 8 bits.
const Colour& linear_colour_of(float t) {
  constexpr int kSteps = 1023;
  static const std::vector<Colour> table = [] {
    std::vector<Colour> colours;
    for (int i = 0; i <= kSteps; ++i) colours.push_back(to_linear(colour_of(static_cast<float>(i) / kSteps)));
    return colours;
  }();
  return table[static_cast<std::size_t>(std::lround(std::clamp(t, 0.0f, 1.0f) * kSteps))];
}

const Colour& linear_tint(std::uint32_t part) {
  static const std::vector<Colour> table = [] {
    std::vector<Colour> colours;
    for (std::uint32_t i = 0; i < kTints.size(); ++i) colours.push_back(to_linear(part_tint(i)));
    return colours;
  }();
  return table[part % kTints.size()];
}

// x to the power 2^squarings.
float squared_again(float x, int squarings) {
  for (int i = 0; i < squarings; ++i) x *= x;
  return x;
}

// Linear light that the surface has of its own.
Colour own_colour(const Scene& scene, const Surfel& at) {
  if (scene.options.thickness || scene.options.by_value) {
    const float value = scene.options.thickness
                            ? scene.options.unit * thickness_at(scene.tracer, at.position, at.geometric)
                            : at.value;
    if (!std::isfinite(value)) return to_linear(colour_of_nothing());
    const float span = scene.options.high - scene.options.low;
    return linear_colour_of(span > 0 ? (value - scene.options.low) / span : 0.5f);
  }
  return scene.drawn.colours.empty() ? linear_tint(at.part) : to_linear(at.colour);
}

// A sky that is brighter above than below, a wide lamp, and some light from the camera. Weights are such that
// a surface that faces the camera in the open shows its own colour.
Colour shade(const Scene& scene, const Surfel& at, const Light& light) {
  const float sky = 0.40f + 0.16f * at.normal.dot(scene.camera.up);
  const float camera = 0.18f * std::max(0.0f, -at.normal.dot(scene.camera.forward));
  const float cosine = std::max(0.0f, at.normal.dot(scene.lamp));
  const float diffuse = (sky + camera) * (0.12f + 0.88f * light.sky) + 0.62f * cosine * light.lamp;
  const float gloss = squared_again(std::max(0.0f, at.normal.dot(scene.half)), 5) * light.lamp;
  const bool coloured = scene.options.by_value || scene.options.thickness;
  // Colours encode values: weaker shading keeps them readable.
  return own_colour(scene, at) * (coloured ? 0.3f + 0.7f * diffuse : diffuse) +
         Colour::Constant(coloured ? 0.012f + 0.03f * gloss : 0.07f * gloss);
}

// The light at a point of pixel (x, y) that may lie on another surface than the pixel's middle: that of the
// pixels around whose surface is the most like it.
Light light_near(const Scene& scene, const PixelBuffer& buffer, const std::vector<Light>& light,
                 const Surfel& at, int x, int y) {
  const float depth = scene.camera.depth(at.position), tolerance = 6 / scene.camera.pixels;
  float sky = 0, lamp = 0, total = 0;
  for (int v = std::max(0, y - 2); v <= std::min(buffer.height - 1, y + 2); ++v)
    for (int u = std::max(0, x - 2); u <= std::min(buffer.width - 1, x + 2); ++u) {
      const std::size_t j = buffer.index(u, v);
      if (buffer.hits[j].primitive == kNoHit) continue;
      const float alike = std::max(0.0f, at.normal.dot(buffer.normals[j])),
                  apart = (depth - buffer.hits[j].t) / tolerance;
      const float weight = 1e-6f + squared_again(alike, 3) / (1 + apart * apart);
      sky += weight * light[j].sky;
      lamp += weight * light[j].lamp;
      total += weight;
    }
  return total > 0 ? Light{sky / total, lamp / total} : Light{0.8f, 1};
}

std::vector<Colour> shade_pixels(const Scene& scene, const Image& image, const PixelBuffer& buffer,
                                 const std::vector<Light>& light) {
  std::vector<Colour> colours(buffer.hits.size());
  parallel_for_each(
      static_cast<std::size_t>(buffer.height),
      [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < buffer.width; ++x) {
          const std::size_t i = buffer.index(x, y);
          colours[i] =
              buffer.hits[i].primitive == kNoHit
                  ? image.pixels[image.index(scene.viewport.x + x, scene.viewport.y + y)]
                  : to_srgb(shade(scene, surfel_at(scene.drawn, scene.ray(x, y), buffer.hits[i]), light[i]));
        }
      },
      8);
  return colours;
}

bool stands_out(const PixelBuffer& buffer, const std::vector<Colour>& colours, int x, int y) {
  const Colour& own = colours[buffer.index(x, y)];
  for (int v = std::max(0, y - 1); v <= std::min(buffer.height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(buffer.width - 1, x + 1); ++u)
      if ((own - colours[buffer.index(u, v)]).cwiseAbs().maxCoeff() > kContrast) return true;
  return false;
}

// The mean of the colours that sixteen rays see, as light.
Colour fine_colour(const Scene& scene, const PixelBuffer& buffer, const std::vector<Light>& light,
                   const Colour& background, int x, int y) {
  std::array<Ray, kFine * kFine> rays;
  std::array<Hit, kFine * kFine> hits;
  for (int k = 0; k < kFine * kFine; ++k)
    rays[static_cast<std::size_t>(k)] = scene.ray(x, y, (static_cast<float>(k % kFine) + 0.5f) / kFine,
                                                  (static_cast<float>(k / kFine) + 0.5f) / kFine);
  scene.tracer.intersect(rays, hits);
  Colour sum = Colour::Zero();
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (hits[k].primitive == kNoHit) {
      sum += to_linear(background);
      continue;
    }
    const Surfel at = surfel_at(scene.drawn, rays[k], hits[k]);
    sum += shade(scene, at, light_near(scene, buffer, light, at, x, y)).cwiseMin(1.0f);
  }
  return to_srgb(sum / (kFine * kFine));
}

}  // namespace

Colour part_tint(std::uint32_t part) {
  return colour(kTints[part % kTints.size()]);
}

Tracer make_tracer(const Drawable& drawn) {
  return drawn.triangles.empty() ? Tracer(drawn.spheres) : Tracer(drawn.vertices, drawn.triangles);
}

void render(Image& image, const Viewport& viewport, const Camera& camera, const Drawable& drawn,
            const Tracer& tracer, const ShadeOptions& options) {
  constexpr double kTraced = 0.05, kLit = 0.3, kShaded = 0.35;  // shares of the time; edges take the rest
  const Scene scene{viewport, camera, drawn, tracer, options};
  const PixelBuffer buffer = [&] {
    const ShareScope tracing(0, kTraced);
    return trace_pixels(scene);
  }();
  const std::vector<Light> traced = [&] {
    const ShareScope lighting(kTraced, kLit);
    return trace_light(buffer, viewport, camera, drawn, tracer);
  }();
  const std::vector<Light> light = smooth_light(traced, buffer, camera);
  const std::vector<Colour> colours = shade_pixels(scene, image, buffer, light);
  const ShareScope refining(kShaded, 1);
  const auto rows = static_cast<std::size_t>(buffer.height);
  ShareCounter done(rows);
  parallel_for_each(
      rows,
      [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < buffer.width; ++x) {
          Colour& pixel = image.pixels[image.index(viewport.x + x, viewport.y + y)];
          pixel = stands_out(buffer, colours, x, y) ? fine_colour(scene, buffer, light, pixel, x, y)
                                                    : colours[buffer.index(x, y)];
        }
        done.add(1);
      },
      4);
}

}  // namespace flexel::picture
