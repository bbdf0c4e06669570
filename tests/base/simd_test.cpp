// Functions of eight numbers side by side against the standard library's.
// Vectors wider than the portable registers never cross a call that is not inlined. The compiler looks at that where the file
// ends, so it is not taken back.
#pragma GCC diagnostic ignored "-Wpsabi"

#include "base/simd.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace flexel {
namespace {

std::array<double, 8> exponentials(const std::array<double, 8>& x) {
  std::array<double, 8> values{};
  simd::store(values.data(), simd::exp_minus(simd::load(x.data())));
  return values;
}

TEST(Simd, ExponentialsFallAsTheStandardLibrarysDo) {
  constexpr double kUlps = 4 * std::numeric_limits<double>::epsilon();
  for (double from = 0; from < 699; from += 0.0437) {
    std::array<double, 8> x{};
    for (std::size_t l = 0; l < 8; ++l) x[l] = from + 0.0051 * static_cast<double>(l);
    const std::array<double, 8> values = exponentials(x);
    for (std::size_t l = 0; l < 8; ++l) EXPECT_NEAR(values[l] / std::exp(-x[l]), 1, kUlps) << x[l];
  }
  const std::array<double, 8> ends = exponentials({0, 1e-300, 1e-17, 700, 701, 1e9, 1e300, 0.5});
  EXPECT_EQ(ends[0], 1);
  EXPECT_EQ(ends[1], 1);
  EXPECT_EQ(ends[2], 1);
  for (const std::size_t l : {4u, 5u, 6u}) EXPECT_EQ(ends[l], ends[3]);
}

}  // namespace
}  // namespace flexel
