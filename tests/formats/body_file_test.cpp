#include "formats/lattice/body_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "formats/lattice/body_metadata.h"
#include "tests/formats/bodies.h"
#include "tests/formats/import_help.h"

namespace flexel {
namespace {

using test::replaced;

class BodyFile : public testing::Test {
 protected:
  BodyFile() {
    folder_ = std::filesystem::temp_directory_path() /
              ("flexel-body-file-" + std::to_string(getpid()) + "-" +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  ~BodyFile() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  void store(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
  }
  std::string load(const std::string& name) const {
    const Bytes bytes = read_all(path(name));
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  // The message with which reading `text` as a file fails; "" where it does not.
  std::string failure(const std::string& text) const {
    store("bad.vtu", text);
    try {
      (void)read_body(path("bad.vtu"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string written(const Body& body, BodyFileOptions options = {}) const {
    write_body(body, path("good.vtu"), options);
    return load("good.vtu");
  }

  std::filesystem::path folder_;
};

template <class T>
void expect_same_bits(const std::vector<T>& a, const std::vector<T>& b, const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  EXPECT_EQ(a.empty() ? 0 : std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0) << what;
}

bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

void expect_same_parts(const Body& a, const Body& b) {
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t p = 0; p < a.parts.size(); ++p) {
    const Part &x = a.parts[p], &y = b.parts[p];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.material, y.material);
    EXPECT_EQ(x.placement, y.placement);
    for (int i = 0; i < 9; ++i) EXPECT_TRUE(same_bits(x.lattice.axes(i), y.lattice.axes(i)));
    for (int i = 0; i < 3; ++i) {
      EXPECT_TRUE(same_bits(x.lattice.origin[i], y.lattice.origin[i]));
      EXPECT_TRUE(same_bits(x.lattice.spacing[i], y.lattice.spacing[i]));
    }
    EXPECT_EQ(x.element_begin, y.element_begin);
    EXPECT_EQ(x.element_end, y.element_end);
    EXPECT_EQ(x.cell_begin, y.cell_begin);
    EXPECT_EQ(x.cell_end, y.cell_end);
    EXPECT_TRUE(same_bits(x.surface_volume, y.surface_volume));
  }
}

void expect_same_columns(const Columns& a, const Columns& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, column] : a) {
    ASSERT_EQ(b.count(name), 1u) << name;
    EXPECT_EQ(column.components, b.at(name).components);
    expect_same_bits(column.values, b.at(name).values, name.c_str());
  }
}

void expect_same_surface(const Surface& a, const Surface& b) {
  expect_same_bits(a.vertices, b.vertices, "vertices");
  EXPECT_EQ(a.polygon_offsets, b.polygon_offsets);
  EXPECT_EQ(a.polygon_vertices, b.polygon_vertices);
  EXPECT_EQ(a.polygon_face, b.polygon_face);
  EXPECT_EQ(a.part_source, b.part_source);
  expect_same_columns(a.vertex_columns, b.vertex_columns);
  expect_same_columns(a.polygon_columns, b.polygon_columns);
  ASSERT_EQ(a.faces.size(), b.faces.size());
  for (std::size_t f = 0; f < a.faces.size(); ++f) {
    EXPECT_EQ(a.faces[f].name, b.faces[f].name);
    EXPECT_EQ(a.faces[f].part, b.faces[f].part);
  }
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t p = 0; p < a.parts.size(); ++p) EXPECT_EQ(a.parts[p].name, b.parts[p].name);
  ASSERT_EQ(a.sources.size(), b.sources.size());
  for (std::size_t s = 0; s < a.sources.size(); ++s) {
    const SurfaceSource &x = a.sources[s], &y = b.sources[s];
    EXPECT_EQ(x.file, y.file);
    EXPECT_EQ(x.format, y.format);
    EXPECT_TRUE(same_bits(x.unit, y.unit));
    EXPECT_EQ(x.unit_given, y.unit_given);
    EXPECT_EQ(x.hash, y.hash);
    EXPECT_EQ(x.bytes, y.bytes);
    EXPECT_EQ(x.stl_header, y.stl_header);
  }
}

void expect_same(const Body& a, const Body& b) {
  expect_same_parts(a, b);
  expect_same_bits(a.lattice_index, b.lattice_index, "lattice_index");
  expect_same_bits(a.piece, b.piece, "piece");
  expect_same_bits(a.rest, b.rest, "rest");
  expect_same_bits(a.position, b.position, "position");
  expect_same_bits(a.connections, b.connections, "connections");
  expect_same_bits(a.cell_elements, b.cell_elements, "cell_elements");
  expect_same_bits(a.fill, b.fill, "fill");
  expect_same_bits(a.broken, b.broken, "broken");
  expect_same_columns(a.element_columns, b.element_columns);
  expect_same_columns(a.cell_columns, b.cell_columns);
  expect_same_bits(a.surface_cell_offsets, b.surface_cell_offsets, "surface_cell_offsets");
  expect_same_bits(a.surface_cells, b.surface_cells, "surface_cells");
  expect_same_bits(a.moment_cells, b.moment_cells, "moment_cells");
  expect_same_bits(a.moments, b.moments, "moments");
  EXPECT_EQ(a.notes, b.notes);
  expect_same_surface(a.surface, b.surface);
}

TEST_F(BodyFile, RoundTripKeepsEveryBit) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    for (const bool compress : {false, true}) {
      const Body body = test::random_body(seed);
      write_body(body, path("body.vtu"), {compress});
      expect_same(body, read_body(path("body.vtu")));
    }
  }
}

TEST_F(BodyFile, WritingTwiceGivesTheSameBytes) {
  const Body body = test::random_body(3);
  for (const bool compress : {false, true}) EXPECT_EQ(written(body, {compress}), written(body, {compress}));
}

TEST_F(BodyFile, CompressedIsSmallerWhereThereIsSomethingToSqueeze) {
  Body body = test::random_body(1);
  body.element_columns["zero"] = {3, std::vector<double>(3 * body.element_count(), 0.0)};
  EXPECT_LT(written(body, {true}).size(), written(body, {false}).size());
}

TEST_F(BodyFile, AFrameOfASeriesTakesTheSurfaceAndTheMomentsFromTheFirst) {
  const Body body = test::random_body(4);
  write_body(body, path("first.vtu"));
  write_body(body, path("frame.vtu"), {false, SurfaceBeside{"first.vtu", surface_hash(body.surface)}});
  Body bare = body;
  bare.surface = {};
  bare.surface_cells.clear();
  bare.surface_cell_offsets.clear();
  bare.moment_cells.clear();
  bare.moments.clear();
  expect_same(bare, read_frame(path("frame.vtu")));
  expect_same(body, read_body(path("frame.vtu")));
  const auto message = [&] {
    try {
      (void)read_body(path("frame.vtu"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  Body other = body;
  other.surface.vertices[0].x() += 1;
  write_body(other, path("first.vtu"));
  EXPECT_THAT(message(), ::testing::HasSubstr("another one now"));
  write_body(bare, path("first.vtu"));
  EXPECT_NE(message(), "") << "a frame that has none itself";
  std::filesystem::remove(path("first.vtu"));
  EXPECT_THAT(message(), ::testing::HasSubstr("missing"));
  for (const char* file : {"../first.vtu", "", ".."}) {
    write_body(body, path("frame.vtu"), {false, SurfaceBeside{file, 1}});
    EXPECT_THAT(message(), ::testing::HasSubstr("no name of a file")) << file;
  }
}

TEST_F(BodyFile, HexahedraHaveVtksCornerOrder) {
  // VTK_HEXAHEDRON: 0-3 run around the lower face, 4-7 around the upper, 4 above 0; so corner 2 differs from
  // corner 0 in x and y.
  std::mt19937_64 random(1);
  Body body;
  Part part;
  part.name = "p";
  test::add_corner_part(body, part, {{0, 0, 0}}, random);
  const std::string text = written(body);
  std::int32_t expected[8];
  const Vec3 corners[8] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                           {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  for (int v = 0; v < 8; ++v)
    for (int e = 0; e < 8; ++e)
      if (body.rest[e] == corners[v]) expected[v] = e;
  EXPECT_NE(text.find(std::string(reinterpret_cast<const char*>(expected), sizeof expected)),
            std::string::npos);
}

TEST_F(BodyFile, EveryTruncationIsRefused) {
  for (const bool compress : {false, true}) {
    Body body = test::random_body(2);
    body.surface.sources[0].bytes.resize(1000);
    const std::string text = written(body, {compress});
    std::vector<std::size_t> lengths;
    for (std::size_t length = 1; length < text.size(); length += 1 + text.size() / 200)
      lengths.push_back(length);
    for (std::size_t back = 2; back < 200; ++back) lengths.push_back(text.size() - back);
    for (const std::size_t length : lengths)
      EXPECT_NE(failure(text.substr(0, length)), "") << length << " of " << text.size() << " bytes";
  }
}

TEST_F(BodyFile, ATruncatedFileIsCalledTruncated) {
  const std::string text = written(test::random_body(2));
  EXPECT_NE(failure(text.substr(0, text.size() / 2)).find("truncated"), std::string::npos);
  EXPECT_NE(failure(text.substr(0, 2000)).find("truncated"), std::string::npos);
}

TEST_F(BodyFile, GarbageIsNoBodyFile) {
  for (const std::string& text :
       {std::string("solid x\nendsolid x\n"), std::string(4096, '\0'), std::string("<?xml version"),
        std::string("<VTKFile type=\"PolyData\"></VTKFile>")})
    EXPECT_NE(failure(text).find("not a body file"), std::string::npos) << text.substr(0, 20);
  EXPECT_NE(failure(""), "");
}

// Damage by random bytes: a message or a body that passes the check, never anything else (the sanitizers
// watch).
TEST_F(BodyFile, RandomDamageNeverPassesUnchecked) {
  std::mt19937_64 random(7);
  for (const bool compress : {false, true}) {
    Body body = test::random_body(5);
    body.surface.sources[0].bytes.resize(100);
    const std::string good = written(body, {compress});
    const std::size_t head = good.find("<AppendedData");
    int refused = 0;
    for (int trial = 0; trial < 600; ++trial) {
      std::string bad = good;
      const std::size_t reach =
          trial % 2 == 0 ? head + 1200 : bad.size();  // half of them in the head and the metadata
      for (int hits = 1 + static_cast<int>(random() % 4); hits > 0; --hits)
        bad[random() % reach] = static_cast<char>(trial % 3 == 0 ? '0' + random() % 10 : random() % 256);
      refused += failure(bad).empty() ? 0 : 1;
    }
    EXPECT_GT(refused, 200);
  }
}

TEST_F(BodyFile, WrongSizesNameTheField) {
  const Body body = test::random_body(6);
  const std::string text = written(body);
  const std::string n = std::to_string(body.element_count());
  EXPECT_NE(failure(replaced(text, "NumberOfPoints=\"" + n, "NumberOfPoints=\"" + std::string(n.size(), '9')))
                .find("rest"),
            std::string::npos);
  EXPECT_NE(failure(replaced(text, "Name=\"fill\"", "Name=\"fall\"")).find("\"fill\" is missing"),
            std::string::npos);
  EXPECT_NE(failure(replaced(text, "type=\"UInt16\" Name=\"piece\"", "type=\"UInt32\" Name=\"piece\""))
                .find("piece"),
            std::string::npos);
  EXPECT_NE(failure(replaced(text, "\"spacing\":[", "\"spacinh\":[")).find("parts[0].spacing is missing"),
            std::string::npos);
  EXPECT_NE(
      failure(replaced(text, "\"placement\":\"corner", "\"placement\":\"corker")).find("parts[0].placement"),
      std::string::npos);
}

TEST_F(BodyFile, OneArrayOfTheMomentsNeedsTheOther) {
  const std::string text = written(test::random_body(6));
  EXPECT_NE(failure(replaced(text, "Name=\"moments\"", "Name=\"momenta\"")).find("\"moments\" is missing"),
            std::string::npos);
  EXPECT_NE(failure(replaced(text, "Name=\"moment_cells\"", "Name=\"moment_calls\""))
                .find("\"moment_cells\" is missing"),
            std::string::npos);
}

TEST_F(BodyFile, ABodyWithoutMomentsHasNoArraysOfThem) {
  Body body = test::random_body(6);
  body.moment_cells.clear();
  body.moments.clear();
  const std::string text = written(body);
  EXPECT_EQ(text.find("moment"), std::string::npos);
  expect_same(body, read_body(path("good.vtu")));
}

// Vertices stand for elements of centre-placed parts: what their rows of cell data say would be lost.
TEST_F(BodyFile, AFactorOfAVertexIsRefused) {
  Body body = test::random_body(5);
  ASSERT_GT(body.cell_count(), 0u);
  const double factor = 0.723456789;
  body.cell_columns["stiffness_change"] = {1, std::vector<double>(body.cell_count(), factor)};
  std::string text = written(body);
  EXPECT_EQ(failure(text), "");
  const std::string bytes(reinterpret_cast<const char*>(&factor), sizeof factor);
  const std::size_t last = text.rfind(bytes), after = last + sizeof factor;
  ASSERT_NE(last, std::string::npos);
  ASSERT_EQ(text.substr(after, sizeof factor), std::string(sizeof factor, '\0')) << "no vertex follows";
  text.replace(after, sizeof factor, bytes);
  EXPECT_THAT(failure(text), testing::HasSubstr("cell data \"stiffness_change\" is not 0 at a vertex"));
  text.replace(text.find("stiffness_change"), 16,
               "thickness_change");  // another program's, which nothing takes
  EXPECT_EQ(failure(text), "");
}

TEST_F(BodyFile, AnotherVersionSaysWhichIsRead) {
  const Body body = test::random_body(6);
  std::string text = written(body);
  // Where the version's tag says: 8 bytes of size, then the version.
  const std::size_t tag = text.find("offset=\"", text.find("Name=\"flexel_version\"")) + 8;
  text[text.find("encoding=\"raw\">\n_") + 17 + std::stoul(text.substr(tag, 20)) + 8] = 9;
  const std::string message = failure(text);
  EXPECT_NE(message.find("version 9"), std::string::npos) << message;
  EXPECT_NE(message.find("reads version 1"), std::string::npos) << message;
}

TEST_F(BodyFile, HugeSizesAreRefusedBeforeTheyAreAllocated) {
  const std::string text = written(test::random_body(6));
  const std::size_t data = text.find("encoding=\"raw\">\n_") + 17;
  for (std::size_t byte = 0; byte < 8; ++byte) {
    std::string bad = text;
    bad[data + byte] = '\x7f';
    EXPECT_NE(failure(bad), "") << byte;
  }
}

TEST_F(BodyFile, NumbersThatAreNotFiniteAreRefused) {
  Body body = test::random_body(6);
  body.position[3].y() = std::nan("");
  write_body(body, path("nan.vtu"));
  try {
    (void)read_body(path("nan.vtu"));
    FAIL() << "NaN was read";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "damaged body: position[3] is not finite");
    EXPECT_EQ(error.where(), path("nan.vtu"));
  }
}

TEST_F(BodyFile, MetadataThatNestsWithoutEndIsRefused) {
  try {
    (void)metadata_from_json(std::string(100000, '['), "deep.vtu");
    FAIL() << "it was read";
  } catch (const InputError& error) {
    EXPECT_EQ(error.where(), "deep.vtu");
    EXPECT_EQ(std::string(error.what()), "damaged: flexel_metadata is nested more than 500 deep");
  }
}

TEST_F(BodyFile, AColumnWithATakenNameIsOurMistake) {
  Body body = test::random_body(6);
  body.element_columns["rest"] = {1, std::vector<double>(body.element_count(), 0.0)};
  EXPECT_THROW(write_body(body, path("taken.vtu")), std::logic_error);
  EXPECT_FALSE(std::filesystem::exists(path("taken.vtu")));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 0);
}

}  // namespace
}  // namespace flexel
