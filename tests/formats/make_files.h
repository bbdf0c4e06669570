// Files of several formats, made by hand for the tests: GLB, ZIP, and one part in all of them.
#pragma once
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/math/vec.h"

namespace flexel::test {

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

// A GLB of a JSON and a buffer, both padded as the format demands.
inline std::string glb(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&number), 4);
  };
  return "glTF" + word(2) + word(28 + json.size() + binary.size()) + word(json.size()) + "JSON" + json +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

// A ZIP archive of files that are stored as they are.
inline std::string zip(const std::vector<std::pair<std::string, std::string>>& files) {
  const auto crc = [](const std::string& data) {  // CRC-32 (ISO 3309), bit by bit
    std::uint32_t sum = 0xffffffffu;
    for (const char c : data) {
      sum ^= static_cast<unsigned char>(c);
      for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ ((sum & 1u) != 0 ? 0xedb88320u : 0u);
    }
    return ~sum;
  };
  std::string archive, directory;
  const auto add = [](std::string& to, std::uint32_t value, int width) {
    to.append(reinterpret_cast<const char*>(&value), static_cast<std::size_t>(width));
  };
  const auto common = [&](std::string& to, const std::string& name, const std::string& data) {
    add(to, 20, 2);  // version
    add(to, 0, 4);   // flags, method: stored
    add(to, 0, 4);   // time
    add(to, crc(data), 4);
    add(to, static_cast<std::uint32_t>(data.size()), 4);
    add(to, static_cast<std::uint32_t>(data.size()), 4);
    add(to, static_cast<std::uint32_t>(name.size()), 2);
    add(to, 0, 2);
  };
  for (const auto& [name, data] : files) {
    const auto begin = static_cast<std::uint32_t>(archive.size());
    archive += std::string("PK\3\4", 4);
    common(archive, name, data);
    archive += name + data;
    directory += std::string("PK\1\2", 4);
    add(directory, 20, 2);
    common(directory, name, data);
    add(directory, 0, 4);  // comment, disk
    add(directory, 0, 2);
    add(directory, 0, 4);
    add(directory, begin, 4);
    directory += name;
  }
  const auto begin = static_cast<std::uint32_t>(archive.size());
  archive += directory + std::string("PK\5\6", 4);
  add(archive, 0, 4);
  add(archive, static_cast<std::uint32_t>(files.size()), 2);
  add(archive, static_cast<std::uint32_t>(files.size()), 2);
  add(archive, static_cast<std::uint32_t>(directory.size()), 4);
  add(archive, begin, 4);
  add(archive, 0, 2);
  return archive;
}

// A 3MF of one model file.
inline std::string threemf(const std::string& model) {
  return zip({{"_rels/.rels",
               "<Relationships><Relationship Target=\"/3D/3dmodel.model\" Id=\"r\" "
               "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
              {"3D/3dmodel.model", model}});
}

// An L-shaped prism of 40 x 30 x 20 mm, flanges 10 mm thick: corners in mm and outward polygons. The polygons
// of six corners are not convex.
struct Bracket {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> polygons;
};

inline Bracket bracket() {
  constexpr double kOutline[6][2] = {{0, 0}, {40, 0}, {40, 10}, {10, 10}, {10, 30}, {0, 30}};
  Bracket result;
  for (const double z : {0.0, 20.0})
    for (const auto& [x, y] : kOutline) result.vertices.emplace_back(x, y, z);
  result.polygons = {{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
  for (std::uint32_t i = 0; i < 6; ++i) result.polygons.push_back({i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i});
  return result;
}

// Its triangles, by hand so that no code under test takes part.
inline std::vector<std::array<std::uint32_t, 3>> bracket_triangles() {
  std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 2, 1}, {0, 3, 2}, {0, 4, 3},  {0, 5, 4},
                                                         {6, 7, 8}, {6, 8, 9}, {6, 9, 10}, {6, 10, 11}};
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t j = (i + 1) % 6;
    triangles.push_back({i, j, 6 + j});
    triangles.push_back({i, 6 + j, 6 + i});
  }
  return triangles;
}

}  // namespace flexel::test
