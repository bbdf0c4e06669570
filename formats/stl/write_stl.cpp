// STL files, binary and ASCII. Text is made in chunks of triangles in parallel and put out in order.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/parallel.h"
#include "base/version.h"
#include "formats/common/surface_writers.h"

namespace flexel {
namespace {

static_assert(std::endian::native == std::endian::little,
              "STL is little-endian; writing it here copies bytes");

constexpr std::size_t kHeaderSize = 80, kPreambleSize = 84, kRecordSize = 50;

// Coordinates in single precision, or the first vertex that does not fit.
std::vector<std::array<float, 3>> single_precision(const DeformedSurface& deformed) {
  std::vector<std::array<float, 3>> positions(deformed.displacement.size());
  parallel_for_each(positions.size(), [&](std::size_t v) {
    const Vec3 at = deformed.at(v);
    for (std::size_t i = 0; i < 3; ++i)
      positions[v][i] = static_cast<float>(at[static_cast<Eigen::Index>(i)]);
  });
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (const float value : positions[v])
      if (!std::isfinite(value))
        throw InputError(fmt::format(
            "vertex {} does not fit the single precision of binary STL: write in a larger unit, or "
            "as ASCII (--ascii)",
            v + 1));
  return positions;
}

Vec3 unit_normal(const DeformedSurface& deformed, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3 a = deformed.at(triangle[0]);
  const Vec3 area = (deformed.at(triangle[1]) - a).cross(deformed.at(triangle[2]) - a);
  const double length = area.norm();
  return length > 0 && std::isfinite(length) ? Vec3(area / length) : Vec3(Vec3::Zero());
}

std::string stl_header(const Surface& surface) {
  std::string header;
  if (surface.sources.size() == 1 && surface.sources[0].stl_header.size() == kHeaderSize)
    header.assign(reinterpret_cast<const char*>(surface.sources[0].stl_header.data()), kHeaderSize);
  else
    header = fmt::format("Flexel {}", version());
  header.resize(kHeaderSize, '\0');
  return header;
}

// Polygons by part, in order.
std::vector<std::vector<std::uint32_t>> triangles_by_part(const Surface& surface,
                                                          const Triangles& triangles) {
  std::vector<std::vector<std::uint32_t>> result(surface.parts.size());
  for (std::size_t t = 0; t < triangles.corners.size(); ++t)
    result[surface.polygon_part(triangles.polygon[t])].push_back(static_cast<std::uint32_t>(t));
  return result;
}

}  // namespace

void write_stl_binary(const DeformedSurface& deformed, OutputFile& out) {
  const Triangles triangles = triangulate(deformed.surface);
  const auto positions = single_precision(deformed);
  const std::size_t count = triangles.corners.size(), size = kPreambleSize + count * kRecordSize;
  if (count > std::numeric_limits<std::uint32_t>::max()) throw InputError("too many triangles for STL");
  const auto bytes = std::make_unique_for_overwrite<char[]>(size);
  std::memcpy(bytes.get(), stl_header(deformed.surface).data(), kHeaderSize);
  const auto count32 = static_cast<std::uint32_t>(count);
  std::memcpy(bytes.get() + kHeaderSize, &count32, sizeof count32);
  parallel_for_each(count, [&](std::size_t t) {
    char* record = bytes.get() + kPreambleSize + t * kRecordSize;
    const Eigen::Vector3f normal = unit_normal(deformed, triangles.corners[t]).cast<float>();
    std::memcpy(record, normal.data(), 12);
    for (std::size_t i = 0; i < 3; ++i)
      std::memcpy(record + 12 + 12 * i, positions[triangles.corners[t][i]].data(), 12);
    record[48] = record[49] = 0;
  });
  out.write(bytes.get(), size);
}

void write_stl_ascii(const DeformedSurface& deformed, OutputFile& out) {
  constexpr std::size_t kGrain = 4096;
  const Triangles triangles = triangulate(deformed.surface);
  const auto by_part = triangles_by_part(deformed.surface, triangles);
  for (std::size_t part = 0; part < by_part.size(); ++part) {
    const auto& members = by_part[part];
    std::vector<std::string> chunks(members.size() / kGrain + 1);
    parallel_chunks(members.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      std::string& text = chunks[begin / kGrain];
      for (std::size_t m = begin; m < end; ++m) {
        const auto& corners = triangles.corners[members[m]];
        const Vec3 normal = unit_normal(deformed, corners);
        append_text(text, " facet normal {:.6g} {:.6g} {:.6g}\n  outer loop\n", normal.x(), normal.y(),
                    normal.z());
        for (const std::uint32_t v : corners) {
          text += "   vertex";
          append_position(text, deformed, v);
          text += '\n';
        }
        text += "  endloop\n endfacet\n";
      }
    });
    const std::string& name = deformed.surface.parts[part].name;
    out.write(fmt::format("solid {}\n", name));
    for (const std::string& text : chunks) out.write(text);
    out.write(fmt::format("endsolid {}\n", name));
  }
}

}  // namespace flexel
