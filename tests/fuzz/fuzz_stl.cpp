// Mutated STL files, ASCII and binary.
#include "formats/exchange/import.h"
#include "tests/fuzz/driver.h"
#include "tests/fuzz/tetrahedron.h"

int main(int argc, char** argv) {
  using namespace flexel;
  const std::vector<Bytes> corpus = {fuzz::ascii_stl(), fuzz::binary_stl()};
  return fuzz::run(argc, argv, "fuzz_stl", corpus, [](const std::string& path) {
    ImportOptions options;
    options.format = "stl";
    check(import_surface(path, options), path);
  });
}
