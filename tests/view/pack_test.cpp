// Packs are read back by a decoder of their description, and compared with what went in.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "flexel/view/pack.h"

namespace flexel::view {
namespace {

using Json = nlohmann::json;

struct Unpacked {
  Json about, arrays;
  Bytes data;
  [[nodiscard]] Bytes planes(const std::string& name) const {
    const Json& array = arrays.at(name);
    const auto first = data.begin() + array.at("offset").get<std::ptrdiff_t>();
    const Bytes packed(first, first + array.at("bytes").get<std::ptrdiff_t>());
    return decompress(packed, array.at("count").get<std::size_t>() * array.at("width").get<std::size_t>());
  }
  // Number i of `count`, `width` bytes each, lowest bytes first.
  static std::uint32_t number(const Bytes& planes, std::size_t count, std::size_t i, std::size_t width) {
    std::uint32_t value = 0;
    for (std::size_t b = 0; b < width; ++b)
      value |= std::to_integer<std::uint32_t>(planes[b * count + i]) << 8 * b;
    return value;
  }
  [[nodiscard]] std::vector<Vec3> points(const std::string& name) const {
    const Json& array = arrays.at(name);
    const Bytes bytes = planes(name);
    std::vector<Vec3> result(array.at("count").get<std::size_t>());
    std::array<std::uint16_t, 3> at{};
    for (std::size_t i = 0; i < result.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        at[a] = static_cast<std::uint16_t>(at[a] + number(bytes, 3 * result.size(), 3 * i + a, 2));
        result[i][a] = array.at("lower")[a].get<double>() + array.at("step").get<double>() * at[a];
      }
    return result;
  }
  [[nodiscard]] std::vector<std::uint32_t> indices(const std::string& name) const {
    const Bytes bytes = planes(name);
    std::vector<std::uint32_t> result(bytes.size() / 4);
    for (std::size_t i = 0; i < result.size(); ++i)
      result[i] = (i > 0 ? result[i - 1] : 0) + number(bytes, result.size(), i, 4);
    return result;
  }
  [[nodiscard]] std::vector<float> numbers(const std::string& name) const {
    const Bytes bytes = planes(name);
    std::vector<float> result(bytes.size() / 3);
    for (std::size_t i = 0; i < result.size(); ++i)
      result[i] = std::bit_cast<float>(number(bytes, result.size(), i, 3) << 8);
    return result;
  }
};

Unpacked unpack(const Bytes& bytes) {
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), 4), "FLXV");
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 4, 4);
  const Json text = Json::parse(std::string(reinterpret_cast<const char*>(bytes.data()) + 8, length));
  return {text.at("about"), text.at("arrays"), Bytes(bytes.begin() + 8 + length, bytes.end())};
}

TEST(Pack, PointsAreWrongByHalfAStepAtMost) {
  std::mt19937 random(3);
  for (const double extent : {1e-9, 0.08, 3e5}) {
    std::uniform_real_distribution<double> place(-extent, 0.2 * extent);
    std::vector<Vec3> points(5000);
    for (Vec3& point : points) point = Vec3(place(random) + 7, place(random), 0.1 * place(random));
    ArrayPack pack;
    pack.add_points("p", points);
    const std::vector<Vec3> found = unpack(pack.finish("{}")).points("p");
    ASSERT_EQ(found.size(), points.size());
    const double step = bounding_box(points).size().maxCoeff() / 65535;
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_LE((found[i] - points[i]).cwiseAbs().maxCoeff(), 0.5000001 * step + 1e-15);
  }
}

TEST(Pack, PointsInOnePlaceStayThere) {
  ArrayPack pack;
  pack.add_points("p", std::vector<Vec3>(4, Vec3(1, -2, 3)));
  pack.add_points("none", {});
  const Unpacked unpacked = unpack(pack.finish("{}"));
  for (const Vec3& point : unpacked.points("p")) EXPECT_EQ(point, Vec3(1, -2, 3));
  EXPECT_TRUE(unpacked.points("none").empty());
}

TEST(Pack, IndicesComeBack) {
  std::mt19937 random(5);
  std::vector<std::uint32_t> indices{0, 4294967295U, 0, 7};
  for (int i = 0; i < 3000; ++i) indices.push_back(static_cast<std::uint32_t>(random()));
  ArrayPack pack;
  pack.add_indices("i", indices);
  EXPECT_EQ(unpack(pack.finish("{}")).indices("i"), indices);
}

TEST(Pack, NumbersKeepSixteenBits) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> power(-37, 38), sign(-1, 1);
  std::vector<double> numbers{0, 1, -1, 1.5};
  for (int i = 0; i < 5000; ++i) numbers.push_back(std::copysign(std::pow(10, power(random)), sign(random)));
  ArrayPack pack;
  pack.add_numbers("n", numbers);
  const std::vector<float> found = unpack(pack.finish("{}")).numbers("n");
  ASSERT_EQ(found.size(), numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i)
    EXPECT_LE(std::abs(found[i] - numbers[i]), std::abs(numbers[i]) * 1.01 / 65536) << numbers[i];
}

TEST(Pack, NumbersThatAreNone) {
  const double infinity = std::numeric_limits<double>::infinity();
  ArrayPack pack;
  pack.add_numbers("n", std::vector<double>{std::nan(""), infinity, -infinity, 1e300, -1e300, 1e-300});
  const std::vector<float> found = unpack(pack.finish("{}")).numbers("n");
  EXPECT_TRUE(std::isnan(found[0]));
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_TRUE(std::isfinite(found[i]));
    EXPECT_GT(std::abs(found[i]), 3.3e38f);
    EXPECT_EQ(found[i] > 0, i % 2 == 1);
  }
  EXPECT_EQ(found[5], 0);
}

TEST(Pack, SeveralArraysAndWhatTheyAre) {
  ArrayPack pack;
  pack.add_bytes("b", std::vector<std::uint8_t>{1, 2, 255});
  pack.add_indices("a \"name\"", std::vector<std::uint32_t>{5, 4});
  const Unpacked unpacked = unpack(pack.finish(R"({"label":"x"})"));
  EXPECT_EQ(unpacked.about, Json({{"label", "x"}}));
  EXPECT_EQ(unpacked.planes("b"), (Bytes{std::byte{1}, std::byte{2}, std::byte{255}}));
  EXPECT_EQ(unpacked.indices("a \"name\""), (std::vector<std::uint32_t>{5, 4}));
}

}  // namespace
}  // namespace flexel::view
