// Mutated OBJ files.
#include "formats/exchange/import.h"
#include "tests/fuzz/driver.h"

int main(int argc, char** argv) {
  using namespace flexel;
  const std::vector<Bytes> corpus = {
      fuzz::bytes_of(
          "# tetrahedron\nv 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"),
      fuzz::bytes_of(
          "mtllib a.mtl\no cube\nv 0 0 0 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "vt 0 0\nvn 0 0 -1\nvn 0 0 1\ng bottom\nusemtl red\nf 4/1/1 3/1/1 2/1/1 1/1/1\ng top\ns 1\nf -4//2 "
          "-3//2 -2//2 \\\n"
          "-1//2\ng sides\nf 1/1 2/1 6/1 5/1\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n")};
  return fuzz::run(argc, argv, "fuzz_obj", corpus, [](const std::string& path) {
    ImportOptions options;
    options.format = "obj";
    check(import_surface(path, options), path);
  });
}
