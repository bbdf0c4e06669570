#include "base/bucket.h"

#include <gtest/gtest.h>

#include <random>

#include "base/math/weld.h"

namespace flexel {
namespace {

TEST(Buckets, AreThoseOfAStableSortForAnyThreadCount) {
  std::mt19937 random(3);
  for (const std::size_t buckets : {std::size_t{1}, std::size_t{300}, std::size_t{40000}}) {
    std::uniform_int_distribution<std::size_t> pick(0, buckets - 1);
    std::vector<std::size_t> bucket_of(100000);
    for (std::size_t& bucket : bucket_of) bucket = pick(random);
    std::vector<std::vector<std::uint32_t>> expected(buckets);
    for (std::uint32_t i = 0; i < bucket_of.size(); ++i) expected[bucket_of[i]].push_back(i);
    for (const int threads : {1, 2, 5}) {
      const ThreadLimit limit(threads);
      const Buckets<std::uint32_t> found = sort_into_buckets<std::uint32_t>(buckets, [&](const auto& use) {
        for (std::uint32_t i = 0; i < bucket_of.size(); ++i) use(bucket_of[i], i);
      });
      ASSERT_EQ(found.begin.size(), buckets + 1);
      ASSERT_EQ(found.begin.back(), bucket_of.size());
      for (std::size_t b = 0; b < buckets; ++b)
        ASSERT_EQ(std::vector<std::uint32_t>(found.values.begin() + found.begin[b],
                                             found.values.begin() + found.begin[b + 1]),
                  expected[b])
            << "bucket " << b << " of " << buckets;
    }
  }
}

TEST(ResizeTouched, KeepsWhatWasThereAndAppendsZeros) {
  std::vector<std::uint32_t> array = {1, 2, 3};
  resize_touched(array, 500000);
  ASSERT_EQ(array.size(), 500000u);
  EXPECT_EQ(array[0] + array[1] + array[2], 6u);
  EXPECT_TRUE(std::all_of(array.begin() + 3, array.end(), [](std::uint32_t value) { return value == 0; }));
  resize_touched(array, 2);
  EXPECT_EQ(array, (std::vector<std::uint32_t>{1, 2}));
}

// Different positions of one hash are told apart: the hash may be as bad as it likes.
TEST(FirstEqual, DoesNotDependOnTheHash) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> pick(-9, 9);
  std::vector<PositionKey> keys(50000);
  for (PositionKey& key : keys) key = position_key(pick(random), pick(random), pick(random));
  const auto key = [&](std::size_t i) { return keys[i]; };
  const auto good = first_equal(keys.size(), key);
  const auto coarse =
      first_equal(keys.size(), key, [](const PositionKey& k) { return hash_key(k) & ~0xffULL << 50; });
  const auto constant = first_equal(keys.size(), key, [](const PositionKey&) { return std::uint64_t{1}; });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    ASSERT_LE(good[i], i);
    ASSERT_EQ(keys[good[i]], keys[i]);
    ASSERT_EQ(good[good[i]], good[i]);
  }
  EXPECT_EQ(coarse, good);
  EXPECT_EQ(constant, good);
}

}  // namespace
}  // namespace flexel
