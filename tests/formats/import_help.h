// Helpers of the import tests: scratch files, errors, the parts folder.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/exchange/import.h"
#include "formats/part/topology.h"
#include "tests/scratch.h"

namespace flexel::test {

inline std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// `text` with `to` in place of the first `from`, which is there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

// No displacement of any vertex.
inline std::vector<Vec3> nothing(const Surface& surface) {
  return std::vector<Vec3>(surface.vertices.size(), Vec3::Zero());
}

inline std::string part_path(const std::string& name) {
  return (std::filesystem::path(FLEXEL_PARTS_DIR) / name).string();
}
#define SKIP_WITHOUT_PARTS() \
  if (!std::filesystem::exists(FLEXEL_PARTS_DIR)) GTEST_SKIP() << "no parts folder: " << FLEXEL_PARTS_DIR

// "where|what" of the InputError that importing gives, "" when it gives none.
inline std::string import_error(const std::string& path, const ImportOptions& options = {}) {
  try {
    static_cast<void>(import_surface(path, options));
  } catch (const InputError& error) {
    return error.where() + "|" + error.what();
  }
  return "";
}

using Facets = std::vector<std::array<std::array<float, 3>, 3>>;

// A binary STL; `count` overrides the header's number of triangles.
inline std::string binary_stl(const Facets& facets, const std::string& header = "", std::int64_t count = -1) {
  std::string bytes = header;
  bytes.resize(80, '\0');
  const auto n = static_cast<std::uint32_t>(count < 0 ? static_cast<std::int64_t>(facets.size()) : count);
  bytes.append(reinterpret_cast<const char*>(&n), 4);
  for (const auto& facet : facets) {
    bytes.append(12, '\0');
    for (const auto& corner : facet) bytes.append(reinterpret_cast<const char*>(corner.data()), 12);
    bytes.append(2, '\0');
  }
  return bytes;
}

// A box from `low` to `high` as 12 triangles, outward.
inline Facets box_facets(std::array<float, 3> low, std::array<float, 3> high) {
  const auto corner = [&](int i) {
    return std::array<float, 3>{i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]};
  };
  constexpr int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                               {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  Facets facets;
  for (const auto& q : quads) {
    facets.push_back({corner(q[0]), corner(q[1]), corner(q[2])});
    facets.push_back({corner(q[0]), corner(q[2]), corner(q[3])});
  }
  return facets;
}

struct Shape {
  Triangles triangles;
  Topology topology;
  double volume = 0;  // m^3
};

inline Shape shape(const Surface& surface) {
  Shape result;
  result.triangles = triangulate(surface);
  result.topology = topology(result.triangles.corners, weld(surface.vertices));
  result.volume = signed_volume(surface.vertices, result.triangles.corners);
  return result;
}

}  // namespace flexel::test
