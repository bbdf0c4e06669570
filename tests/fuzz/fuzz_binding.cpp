// Mutated bindings of both methods that a file can hold, then used. What they belong to and their hash are made right
// first: damage that a hash finds ends there.
#include <cstring>
#include <stdexcept>

#include "mapping/binding_file.h"
#include "mapping/methods/map_surface.h"
#include "tests/fuzz/small_body.h"

namespace {

using namespace flexel;

constexpr std::size_t kHead = 72, kOwner = 24, kOwnerSize = 16;  // bytes; mapping/binding_file.cpp

Bytes binding_of(const Body& body, mapping::MapMethod method) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("fuzz-binding-" + std::to_string(getpid()));
  mapping::write_binding(mapping::bind(body, method), body, path);
  const Bytes bytes = read_all(path);
  std::filesystem::remove(path);
  return bytes;
}

void mend(const std::string& path, const Bytes& good) {
  Bytes bytes = read_all(path);
  if (bytes.size() < kHead + 8) return;
  std::memcpy(bytes.data() + kOwner, good.data() + kOwner, kOwnerSize);
  const std::uint64_t hash = content_hash(std::span<const std::byte>(bytes).first(bytes.size() - 8));
  std::memcpy(bytes.data() + bytes.size() - 8, &hash, 8);
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

int main(int argc, char** argv) {
  Body body = fuzz::small_body();
  const std::vector<Bytes> corpus = {binding_of(body, &mapping::kAffine),
                                     binding_of(body, &mapping::kGramSchmidt)};
  for (std::size_t i = 0; i < body.position.size(); ++i)
    body.position[i] += 0.01 * Vec3(body.rest[i].y(), 0, 0);
  return fuzz::run(argc, argv, "fuzz_binding", corpus, [&](const std::string& path) {
    mend(path, corpus.front());
    const mapping::MapResult result = mapping::map_state(mapping::read_binding(path, body), body);
    for (const Vec3& u : result.displacement)
      if (!u.allFinite()) throw std::runtime_error("a vertex goes to where no number is");
  });
}
