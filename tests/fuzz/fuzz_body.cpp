// Mutated body files: two cells in a row, raw and compressed.
#include "tests/fuzz/small_body.h"

int main(int argc, char** argv) {
  using namespace flexel;
  const Body body = fuzz::small_body();
  return fuzz::run(argc, argv, "fuzz_body", {fuzz::file_of(body, false), fuzz::file_of(body, true)},
                   [](const std::string& path) { check(read_body(path), path); });
}
