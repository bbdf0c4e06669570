// A binding comes out of its file as it went in, and nothing else does.
#include "mapping/binding_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "bodies.h"
#include "mapping/methods/map_surface.h"
#include "motions.h"
#include "tests/scratch.h"

namespace flexel::mapping {
namespace {

class BindingFile : public testing::Test {
 protected:
  void write(std::span<const std::byte> bytes) const {
    OutputFile file(path_);
    file.write(bytes.data(), bytes.size());
    file.commit();
  }
  void expect_refused(const Body& body, const std::string& fragment) const {
    try {
      (void)read_binding(path_, body);
      ADD_FAILURE() << "taken, not refused as " << fragment;
    } catch (const InputError& error) {
      EXPECT_EQ(error.where(), path_);
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
    }
  }

  flexel::test::Scratch scratch_;
  std::string path_ = scratch_.path("rest.binding");
};

TEST_F(BindingFile, GivesTheSameBits) {
  for (const Placement placement : {Placement::corner, Placement::centre}) {
    Body body = test::round_bar(6, placement);
    for (const MapMethod method : {&kGramSchmidt, &kAffine}) {
      const Binding binding = bind(body, method);
      write_binding(binding, body, path_);
      const Binding read = read_binding(path_, body);
      EXPECT_EQ(read.method, method);
      for (const auto& field : {test::bend, test::twist}) {
        test::deform(body, field);
        const MapResult one = map_state(binding, body), two = map_state(read, body);
        EXPECT_EQ(one.displacement, two.displacement);
        EXPECT_EQ(one.flags, two.flags);
        EXPECT_EQ(one.referenced, two.referenced);
        EXPECT_EQ(one.rest_residual, two.rest_residual);
        EXPECT_EQ(one.distance_outside, two.distance_outside);
      }
    }
  }
}

TEST_F(BindingFile, IsRefusedWhenDamaged) {
  const Body body = test::block(3, 2, 2, 0.1, Placement::corner, 2);
  write_binding(bind(body, &kAffine), body, path_);
  const Bytes whole = read_all(path_);
  for (std::size_t size = 1; size < whole.size(); size += 97) {
    write(std::span(whole).first(size));
    expect_refused(body, size < 72 ? "no saved binding" : "damaged");
  }
  for (std::size_t at = 0; at < whole.size(); at += 53) {
    Bytes changed = whole;
    changed[at] ^= std::byte{0x10};
    write(changed);
    EXPECT_THROW((void)read_binding(path_, body), InputError) << at;
  }
  Bytes longer = whole;
  longer.push_back(std::byte{0});
  write(longer);
  expect_refused(body, "damaged");
  Bytes newer = whole;
  newer[16] = std::byte{2};
  write(newer);
  expect_refused(body, "version 2");
}

TEST_F(BindingFile, IsRefusedForAnotherLatticeOrSurface) {
  const Body body = test::block(3, 2, 2, 0.1, Placement::corner, 2);
  write_binding(bind(body, &kAffine), body, path_);
  Body other = body;
  other.position[0].x() += 1;  // another state of the same body
  EXPECT_NO_THROW((void)read_binding(path_, other));
  other.broken[0] = 1;
  expect_refused(other, "another lattice");
  other = body;
  other.rest[3].y() += 1e-9;
  expect_refused(other, "another lattice");
  other = body;
  other.surface.vertices[1].z() += 1e-9;
  expect_refused(other, "another surface");
  other = body;
  std::swap(other.surface.polygon_vertices[0], other.surface.polygon_vertices[1]);
  expect_refused(other, "another surface");
}

TEST_F(BindingFile, IsForTwoMethods) {
  const Body body = test::block(2, 2, 2, 0.1, Placement::corner, 2);
  for (const MapMethod method : {&kBlended, &kSmooth})
    EXPECT_THROW(write_binding(bind(body, method), body, path_), InputError);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

}  // namespace
}  // namespace flexel::mapping
