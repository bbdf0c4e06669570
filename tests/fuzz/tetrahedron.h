// The smallest solid, as the corpus of several fuzzers.
#pragma once
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "tests/fuzz/driver.h"

namespace flexel::fuzz {

inline constexpr float kCorners[4][3] = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {0, 0, 10}};
inline constexpr int kTriangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

inline Bytes ascii_stl() {
  std::string text = "solid tetrahedron\n";
  for (const auto& triangle : kTriangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const int corner : triangle) {
      const auto& p = kCorners[corner];
      text += "   vertex " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) +
              "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return bytes_of(text + "endsolid tetrahedron\n");
}

inline Bytes binary_stl() {
  Bytes data(84 + 4 * 50);
  const std::uint32_t count = 4;
  std::memcpy(data.data(), "solid that is binary", 20);
  std::memcpy(data.data() + 80, &count, 4);
  for (int t = 0; t < 4; ++t) {
    for (int c = 0; c < 3; ++c)
      std::memcpy(data.data() + 84 + 50 * t + 12 + 12 * c, kCorners[kTriangles[t][c]], 12);
  }
  return data;
}

inline Surface tetrahedron() {
  const std::string path =
      std::filesystem::temp_directory_path() / ("tetrahedron-" + std::to_string(getpid()) + ".stl");
  const Bytes data = binary_stl();
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data.data()), static_cast<std::streamsize>(data.size()));
  Surface surface = import_surface(path);
  std::filesystem::remove(path);
  return surface;
}

// Writes the surface, sheared a little, and removes the file again, also where it is refused.
inline void write_moved(const Surface& surface, SurfaceFormat format, const std::string& path) {
  std::vector<Vec3> displacement;
  for (const Vec3& v : surface.vertices) displacement.emplace_back(-1e-3 * v.y(), 2e-3 * v.x(), 0);
  try {
    write_surface(surface, displacement, format, default_unit(surface), path);
  } catch (const InputError&) {
    std::filesystem::remove(path);
    throw;
  }
  std::filesystem::remove(path);
}

}  // namespace flexel::fuzz
