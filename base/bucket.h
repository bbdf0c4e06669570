// Large arrays filled by all threads: counting sort, and first touch of fresh memory in parallel.
#pragma once
#if __has_include(<sys/mman.h>)
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <type_traits>
#include <vector>

#include "base/parallel.h"

namespace flexel {

// Asks the system for large pages under what a long array has reserved: fewer first touches.
inline void prefer_large_pages([[maybe_unused]] void* begin, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
  constexpr std::uintptr_t kLarge = std::uintptr_t{1} << 21;
  const auto at = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t skipped = (at + kLarge - 1) / kLarge * kLarge - at;
  if (skipped + kLarge > bytes) return;
  madvise(static_cast<std::byte*>(begin) + skipped, (bytes - skipped) / kLarge * kLarge,
          MADV_HUGEPAGE);  // advice only
#endif
}

// array.resize(n). The system gives memory page by page on first touch, which costs as much as filling the
// array: here all threads touch the pages, before the array is zeroed.
template <class Value>
void resize_touched(std::vector<Value>& array, std::size_t n) {
  static_assert(std::is_trivially_destructible_v<Value>);
  constexpr std::size_t kPage = 4096, kGrain = 64 * kPage;
  if (n > array.capacity()) {
    array.reserve(std::max(n, 2 * array.capacity()));
    prefer_large_pages(array.data(), array.capacity() * sizeof(Value));
  }
  if (n <= array.size()) {
    array.resize(n);
    return;
  }
  const std::size_t bytes = (n - array.size()) * sizeof(Value);
  volatile char* first = reinterpret_cast<volatile char*>(array.data() + array.size());
  parallel_chunks(bytes, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; at += kPage) first[at] = 0;
  });
  array.resize(n);
}

// Values in buckets: bucket b holds values [begin[b], begin[b + 1]).
template <class Value>
struct Buckets {
  std::vector<std::uint32_t> begin;  // (buckets + 1)
  std::vector<Value> values;
};

// Counting sort: for_each(use) calls use(bucket, value) for all values, the same ones in the same order each
// time; inside a bucket they keep that order. Each thread goes through all of them and takes those of its own
// range of buckets, so that no two threads write to one place and the result does not depend on their number.
template <class Value, class ForEach>
[[nodiscard]] Buckets<Value> sort_into_buckets(std::size_t count, const ForEach& for_each) {
  constexpr std::size_t kSmall = 1 << 14, kMostRanges = 8;
  const std::size_t ranges = count < kSmall ? 1 : std::min(thread_count(), kMostRanges);
  Buckets<Value> result;
  resize_touched(result.begin, count + 1);
  std::vector<std::uint32_t>& next = result.begin;  // [b + 1]: first the size of bucket b, then where it ends
  const auto over_ranges = [&](const auto& use) {
    parallel_for_each(
        ranges,
        [&](std::size_t range) {
          const std::size_t low = range * count / ranges, size = (range + 1) * count / ranges - low;
          for_each([&](std::size_t bucket, const Value& value) {
            if (bucket - low < size) use(bucket, value);
          });
        },
        1);
  };
  over_ranges([&](std::size_t bucket, const Value&) { ++next[bucket + 1]; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  resize_touched(result.values, next.back());
  // Written from where the bucket begins, next[b], which so becomes its end; then all are shifted by one.
  over_ranges([&](std::size_t bucket, const Value& value) { result.values[next[bucket]++] = value; });
  std::copy_backward(next.begin(), next.end() - 1, next.end());
  next[0] = 0;
  return result;
}

}  // namespace flexel
