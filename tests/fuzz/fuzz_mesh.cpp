// Mutated PLY and OFF files, read and, moved, written again from their own bytes.
#include "formats/exchange/import.h"
#include "formats/exchange/surface_file.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/tetrahedron.h"

namespace {

using namespace flexel;

constexpr const char* kPly =
    "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty double x\nproperty double y\nproperty "
    "float z\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
    "property uchar blue\nproperty list uchar int tags\nproperty float quality\nelement face 4\n"
    "property list uchar int vertex_indices\nproperty int label\nelement edge 1\nproperty int a\nend_header\n"
    "0 0 0 0 0 1 255 0 0 0 1.5\n10 0 0 0 0 1 0 255 0 2 7 8 -2\n0 10 0 1 0 0 0 0 255 1 9 0\n"
    "0 0 10 0 1 0 51 102 0 0 1e3\n3 0 2 1 5\n3 0 1 3 6\n3 1 2 3 7\n3 2 0 3 8\n42\n";

Bytes binary_ply(bool big) {
  std::string data = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                     "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                     "property ushort red\nproperty ushort green\nproperty ushort blue\nelement face 4\n"
                     "property list uchar uint vertex_index\nend_header\n";
  const auto add = [&](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    data += big ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
  };
  for (const auto& corner : fuzz::kCorners) {
    for (const float x : corner) add(x);
    for (const int channel : {65535, 0, 13107}) add(static_cast<std::uint16_t>(channel));
  }
  for (const auto& triangle : fuzz::kTriangles) {
    add(std::uint8_t{3});
    for (const int v : triangle) add(static_cast<std::uint32_t>(v));
  }
  return fuzz::bytes_of(data);
}

constexpr const char* kOff =
    "COFF # a pyramid\n5 5 0\n\n0 0 0 255 0 0\n2 0 0 0 255 0\n# between\n2 2 0 0 0 255\n0 2 0 51 51 51\n"
    "1 1 1.5 0 0 0\n4 3 2 1 0 255 0 51\n3 0 1 4\n3 1 2 4 0 0 0\n3 2 3 4\n3 3 0 4 # last";
constexpr const char* kNormals =
    "NOFF 4 4 6\n0 0 0 0 0 1 1 0 0 0 0 1\n0 1 0 1 0 0\n0 0 1 1 0 0\n3 0 2 1\n3 0 1 3 0.5 0.5 0.5\n3\n1 2 "
    "3\n3 2 0 3";

}  // namespace

int main(int argc, char** argv) {
  const std::vector<Bytes> corpus = {fuzz::bytes_of(kPly), binary_ply(false), binary_ply(true),
                                     fuzz::bytes_of(kOff), fuzz::bytes_of(kNormals)};
  return fuzz::run(argc, argv, "fuzz_mesh", corpus, [](const std::string& path) {
    const Bytes bytes = read_all(path);
    ImportOptions options;
    options.format = !bytes.empty() && bytes[0] == std::byte{'p'} ? "ply" : "off";
    const Surface surface = import_surface(path, options);
    check(surface, path);
    fuzz::write_moved(surface, *options.format == "ply" ? surface_format("ply") : surface_format("off"),
                      path + ".out");
  });
}
