// The file of a checkpoint: what is written comes back to the bit, and nothing that is cut or changed does.
#include "simulate/time/checkpoint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "base/error.h"
#include "base/files/files.h"
#include "formats/lattice/body_file.h"
#include "tests/scratch.h"
#include "tests/simulate/box_body.h"

namespace flexel::simulate {
namespace {

// Every list of another length, every number another.
Checkpoint some_checkpoint(const Body& body) {
  Checkpoint c;
  c.scene_name = "beam.toml";
  c.scene = "material = \"steel\"\n";
  c.output = "out.pvd";
  c.history = "h.csv";
  c.compress = true;
  c.input = body_fingerprint(body);
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    c.state.displacement.emplace_back(1.0 / 3 + static_cast<double>(e), -0.0, 5e-324);
    c.state.velocity.emplace_back(std::sqrt(2.0), 1e300, static_cast<double>(e));
  }
  c.state.time = 0.1;
  c.state.kick = 0.25;
  c.clock = {1, 2, 3, 4, 5, 6};
  c.memory.cells.fill.resize(2);
  c.memory.cells.plastic.resize(3);
  c.memory.cells.plastic[2].hourglass[3][2][1] = 7;
  c.memory.cells.springs.resize(4);
  c.memory.cells.springs[3].broken[7] = 8;
  c.memory.cells.spring_flow.resize(1);
  c.memory.reach = INFINITY;
  c.events = 2;
  c.settled = c.state.velocity;
  c.fused = {{{1, 2, 3}, {0.5, 0.5, -1}, 6}, {{}, {}, 7}};
  c.balance.accounts = {{"loads", Account::Kind::work, 1.5}, {"damping", Account::Kind::dissipation, -2}};
  BookRow row;
  row.time = 9;
  row.energies.residual = 1e-17;
  row.accounts = {10, 11};
  row.momentum = Vec3(1, 2, 3);
  row.angular = Vec3(4, 5, 6);
  row.probes = {12};
  c.balance.rows = {BookRow{}, row};
  c.balance.probes = {"tip"};
  c.balance.start = -1;
  c.balance.changed = true;
  c.next_row = 13;
  c.next_frame = 14;
  c.frames = {{0, 0.5}, 1, 2};
  return c;
}

class CheckpointFile : public ::testing::Test {
 protected:
  void SetUp() override {
    body_ = testing::box_body({});
    path_ = scratch_.path("checkpoint");
    write_checkpoint(some_checkpoint(body_), body_bytes(body_), path_);
    bytes_ = read_all(path_);
  }
  void put(const Bytes& bytes) const {
    std::ofstream file(path_, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  flexel::test::Scratch scratch_;
  Body body_;
  std::string path_;
  Bytes bytes_;
};

TEST_F(CheckpointFile, ComesBackToTheBit) {
  const Resumed resumed = read_checkpoint(path_);
  write_checkpoint(resumed.checkpoint, body_bytes(resumed.body), path_);
  EXPECT_EQ(read_all(path_), bytes_);
  const Checkpoint wanted = some_checkpoint(body_), &found = resumed.checkpoint;
  EXPECT_EQ(found.scene, wanted.scene);
  EXPECT_EQ(found.state.displacement, wanted.state.displacement);
  EXPECT_EQ(found.clock.steps, 6);
  EXPECT_EQ(found.memory.cells.plastic[2].hourglass[3][2][1], 7);
  EXPECT_EQ(found.memory.cells.springs[3].broken[7], 8);
  EXPECT_EQ(found.balance.rows[1].angular, Vec3(4, 5, 6));
  EXPECT_EQ(found.balance.accounts[1].name, "damping");
  EXPECT_EQ(found.fused[0].weights, wanted.fused[0].weights);
  EXPECT_TRUE(found.balance.changed);
  EXPECT_EQ(found.frames.times, wanted.frames.times);
  EXPECT_EQ(found.frames.surface_frame, wanted.frames.surface_frame);
  EXPECT_EQ(found.frames.surface_parts, wanted.frames.surface_parts);
  EXPECT_EQ(body_fingerprint(resumed.body), found.input);
}

TEST_F(CheckpointFile, NothingThatIsCutIsTaken) {
  for (std::size_t size = 1; size < bytes_.size(); size += 1 + size / 16) {
    put(Bytes(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_THROW((void)read_checkpoint(path_), InputError) << size;
  }
}

TEST_F(CheckpointFile, NothingThatIsChangedIsTaken) {
  for (std::size_t at = 0; at < bytes_.size(); at += 1 + at / 32) {
    Bytes changed = bytes_;
    changed[at] ^= std::byte{0x10};
    put(changed);
    EXPECT_THROW((void)read_checkpoint(path_), InputError) << at;
  }
}

TEST_F(CheckpointFile, BodiesAreToldApart) {
  Body other = body_;
  other.position[3].y() += 1e-15;
  EXPECT_NE(body_fingerprint(other), body_fingerprint(body_));
  other = body_;
  other.broken[1] = 1;
  EXPECT_NE(body_fingerprint(other), body_fingerprint(body_));
}

}  // namespace
}  // namespace flexel::simulate
