// Mutated checkpoints. Their sizes and hashes are made right first: damage that a hash finds ends there.
#include <cstring>

#include "simulate/time/checkpoint.h"
#include "tests/fuzz/small_body.h"

namespace {

using namespace flexel;

constexpr std::size_t kHead = 48;  // bytes; simulate/time/checkpoint.h

std::uint64_t word(const Bytes& bytes, std::size_t at) {
  std::uint64_t value = 0;
  std::memcpy(&value, bytes.data() + at, 8);
  return value;
}

void set_word(Bytes& bytes, std::size_t at, std::uint64_t value) {
  std::memcpy(bytes.data() + at, &value, 8);
}

void mend(const std::string& path) {
  Bytes bytes = read_all(path);
  if (bytes.size() <= kHead) return;
  const std::size_t size = bytes.size() - kHead, values = std::min<std::size_t>(word(bytes, 16), size);
  set_word(bytes, 16, values);
  set_word(bytes, 24, size - values);
  const std::span<const std::byte> all(bytes);
  set_word(bytes, 32, content_hash(all.subspan(kHead, values)));
  set_word(bytes, 40, content_hash(all.subspan(kHead + values)));
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

Bytes checkpoint_of(const Body& body) {
  simulate::Checkpoint c;
  c.scene_name = "beam.toml";
  c.scene = "material = \"steel\"\n[run]\ntime = \"1 ms\"\n";
  c.output = "out.pvd";
  c.input = simulate::body_fingerprint(body);
  c.state.displacement.assign(body.element_count(), Vec3(1e-6, 0, 0));
  c.state.velocity.assign(body.element_count(), Vec3(0, 1, 0));
  c.state.time = 0.1;
  c.memory.cells.fill.resize(2);
  c.memory.cells.plastic.resize(2);
  c.fused = {{{1, 2, 3}, {0.5, 0.5, -1}, 6}};
  c.balance.accounts = {{"loads", simulate::Account::Kind::work, 1.5}};
  c.balance.rows = {simulate::BookRow{}};
  c.balance.probes = {"tip"};
  c.frames = {{0, 0.5}, 1, 2};
  const std::string path =
      std::filesystem::temp_directory_path() / ("fuzz-checkpoint-" + std::to_string(getpid()));
  simulate::write_checkpoint(c, fuzz::file_of(body, false), path);
  const Bytes bytes = read_all(path);
  std::filesystem::remove(path);
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_checkpoint", {checkpoint_of(fuzz::small_body())},
                   [](const std::string& path) {
                     mend(path);
                     (void)simulate::read_checkpoint(path);
                   });
}
