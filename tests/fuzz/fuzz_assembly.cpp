// Mutated glTF (text, GLB) and 3MF files, also written again, moved. What is neither GLB nor JSON is
// the model of a 3MF file, which is put into an archive here: mutated archives end at their checksums.
#include <filesystem>

#include "base/error.h"
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "tests/formats/make_files.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/tetrahedron.h"

namespace {

using namespace flexel;

std::string tables() {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[1,2],"scale":[2,2,2]},
{"mesh":0,"translation":[5,0,0],"name":"a"},{"mesh":0,"rotation":[0,0,1,0],"name":"b"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":0,"COLOR_0":0,"_HEAT":0},"indices":1,"material":0},
{"attributes":{"POSITION":0},"mode":5}],"extras":{"units":"mm"}}],
"materials":[{"name":"m","pbrMetallicRoughness":{"baseColorFactor":[1,0.2,0,0.5]}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],"buffers":[{"byteLength":60)";
}

std::string buffer() {
  std::vector<float> corners;
  std::vector<std::uint8_t> indices;
  for (const auto& corner : fuzz::kCorners) corners.insert(corners.end(), corner, corner + 3);
  for (const auto& triangle : fuzz::kTriangles)
    for (const int v : triangle) indices.push_back(static_cast<std::uint8_t>(v));
  return test::bytes_of(corners) + test::bytes_of(indices);
}

std::string base64(const std::string& data) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i + 2 < data.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return static_cast<unsigned>(static_cast<unsigned char>(data[i + k]));
    };
    const unsigned bits = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (int shift = 18; shift >= 0; shift -= 6) text += kDigits[bits >> shift & 63];
  }
  return text;
}

constexpr const char* kModel =
    "<?xml version=\"1.0\"?><model unit=\"inch\"><resources><m:colorgroup id=\"9\"><m:color "
    "color=\"#FF0000\"/>"
    "<m:color color=\"#00FF0080\"/></m:colorgroup><object id=\"1\" name=\"tet\" pid=\"9\" pindex=\"0\"><mesh>"
    "<vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1.1\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"1\" "
    "z=\"0\"/>"
    "<vertex x=\"0\" y=\"0\" z=\"1\"/></vertices><triangles><triangle v1=\"0\" v2=\"2\" v3=\"1\"/>"
    "<triangle v1=\"0\" v2=\"1\" v3=\"3\" pid=\"9\" p1=\"1\"/><triangle v1=\"1\" v2=\"2\" v3=\"3\"/>"
    "<triangle v1=\"2\" v2=\"0\" v3=\"3\"/></triangles></mesh></object><object id=\"2\"><components>"
    "<component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/><component objectid=\"1\" "
    "transform=\"0 1 0 -1 0 0 0 0 1 0 0 0\"/></components></object></resources><build><item "
    "objectid=\"2\"/></build>"
    "</model>";

void read_mutant(const std::string& path) {
  const Bytes bytes = read_all(path);
  ImportOptions options;
  options.format = "glb";
  if (bytes[0] == std::byte{'g'} || bytes[0] == std::byte{'{'}) {
    const Surface surface = import_surface(path, options);
    check(surface, path);
    fuzz::write_moved(surface, surface_format("glb"), path + ".out");
    return;
  }
  const std::string archive = path + ".3mf";
  const std::string data = bytes[0] == std::byte{'P'}
                               ? std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())
                               : test::threemf({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  std::ofstream(archive, std::ios::binary) << data;
  options.format = "3mf";
  try {
    const Surface surface = import_surface(archive, options);
    check(surface, archive);
    fuzz::write_moved(surface, surface_format("3mf"), archive + ".out");
  } catch (const InputError&) {
    std::filesystem::remove(archive);
    throw;
  }
  std::filesystem::remove(archive);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string text =
      tables() + R"(,"uri":"data:application/octet-stream;base64,)" + base64(buffer()) + "\"}]}";
  const std::vector<Bytes> corpus = {fuzz::bytes_of(text),
                                     fuzz::bytes_of(test::glb(tables() + "}]}", buffer())),
                                     fuzz::bytes_of(kModel), fuzz::bytes_of(test::threemf(kModel))};
  return fuzz::run(argc, argv, "fuzz_assembly", corpus, read_mutant);
}
