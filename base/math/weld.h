// Welding of exactly equal positions. The top bits of a hash distribute the positions over buckets, whose
// number depends on the count only; in each bucket one thread finds the first of equal hashes with an
// open-addressing table. One pass then compares the positions themselves; on a hash collision all are sorted
// instead.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <vector>

#include "base/bucket.h"
#include "base/math/parallel_sort.h"
#include "base/parallel.h"

namespace flexel {

// The bits of a position, equal exactly when the positions are (-0 counts as 0; NaN must be ruled out
// before).
using PositionKey = std::array<std::uint64_t, 3>;

[[nodiscard]] inline PositionKey position_key(double x, double y, double z) {
  return {std::bit_cast<std::uint64_t>(x + 0.0), std::bit_cast<std::uint64_t>(y + 0.0),
          std::bit_cast<std::uint64_t>(z + 0.0)};
}

// Multiply and fold (128-bit), as in wyhash (Wang Yi, 2019): every bit of the key reaches the top bits.
[[nodiscard]] inline std::uint64_t hash_key(const PositionKey& key) {
  const auto fold = [](std::uint64_t a, std::uint64_t b) {
    __extension__ using Wide = unsigned __int128;
    const Wide product = static_cast<Wide>(a) * b;
    return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
  };
  return fold(fold(key[0] ^ 0xa0761d6478bd642fULL, key[1] ^ 0xe7037ed1a0b428dbULL) ^ 0x8ebc6af09c88c6e3ULL,
              key[2] ^ 0x589965cc75374cc3ULL);
}

namespace detail {

constexpr std::size_t kWeldChunk = 1 << 16;

struct HashedIndex {
  std::uint64_t hash;
  std::uint32_t index;
};

// Indices [0, n) with their hashes, by the top bits of the hash and ascending inside each bucket. `starts`
// has an entry more than there are buckets.
struct HashBuckets {
  std::vector<HashedIndex> members;
  std::vector<std::uint32_t> starts;
};

template <class Hash>
[[nodiscard]] HashBuckets group_by_hash(std::size_t n, int bits, const Hash& hash) {
  const std::size_t buckets = std::size_t{1} << bits;
  const std::size_t chunks = (n + kWeldChunk - 1) / kWeldChunk;
  const auto bucket_of = [&](std::uint64_t h) { return bits == 0 ? 0 : h >> (64 - bits); };
  std::vector<std::uint32_t> count(chunks * buckets, 0);
  parallel_chunks(n, kWeldChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* row = &count[begin / kWeldChunk * buckets];
    for (std::size_t i = begin; i < end; ++i) ++row[bucket_of(hash(i))];
  });
  HashBuckets result;
  result.starts.resize(buckets + 1);
  std::uint32_t total = 0;
  for (std::size_t b = 0; b < buckets; ++b) {
    result.starts[b] = total;
    for (std::size_t c = 0; c < chunks; ++c) {
      const std::uint32_t here = count[c * buckets + b];
      count[c * buckets + b] = total;
      total += here;
    }
  }
  result.starts[buckets] = total;
  resize_touched(result.members, n);
  parallel_chunks(n, kWeldChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* row = &count[begin / kWeldChunk * buckets];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t h = hash(i);
      result.members[row[bucket_of(h)]++] = {h, static_cast<std::uint32_t>(i)};
    }
  });
  return result;
}

// For each member the first with the same hash.
inline void match_hashes(const HashedIndex* members, std::size_t size, std::vector<std::uint32_t>& first) {
  constexpr std::uint32_t kEmpty = 0xffffffffu;
  const std::size_t mask = std::bit_ceil(2 * size + 1) - 1;
  std::vector<std::uint32_t> table(mask + 1, kEmpty);
  for (std::uint32_t m = 0; m < size; ++m) {
    std::size_t slot = members[m].hash & mask;
    while (table[slot] != kEmpty && members[table[slot]].hash != members[m].hash) slot = (slot + 1) & mask;
    if (table[slot] == kEmpty) table[slot] = m;
    first[members[m].index] = members[table[slot]].index;
  }
}

// The same without hashes, slower.
template <class Key>
[[nodiscard]] std::vector<std::uint32_t> first_equal_by_sorting(std::size_t n, const Key& key) {
  std::vector<std::uint32_t> order(n), first(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = static_cast<std::uint32_t>(i);
  parallel_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const PositionKey p = key(a), q = key(b);
    return p != q ? p < q : a < b;
  });
  for (std::size_t m = 0; m < n; ++m)
    first[order[m]] = m > 0 && key(order[m]) == key(order[m - 1]) ? first[order[m - 1]] : order[m];
  return first;
}

}  // namespace detail

// For each of n positions the index of the first that is equal. `key(i)` gives the position's bits.
template <class Key, class Hash = std::uint64_t (*)(const PositionKey&)>
[[nodiscard]] std::vector<std::uint32_t> first_equal(std::size_t n, const Key& key,
                                                     const Hash& hash = hash_key) {
  const int bits = n < (1u << 15) ? 0 : std::min(8, static_cast<int>(std::bit_width(n >> 14)));
  const detail::HashBuckets buckets =
      detail::group_by_hash(n, bits, [&](std::size_t i) { return hash(key(i)); });
  std::vector<std::uint32_t> first;
  resize_touched(first, n);
  parallel_for_each(
      buckets.starts.size() - 1,
      [&](std::size_t b) {
        detail::match_hashes(buckets.members.data() + buckets.starts[b],
                             buckets.starts[b + 1] - buckets.starts[b], first);
      },
      1);
  // Different positions with one hash, once in 10^7 files of a million vertices.
  std::atomic<bool> collision{false};
  parallel_chunks(n, detail::kWeldChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (first[i] != i && key(first[i]) != key(i)) collision = true;
  });
  return collision ? detail::first_equal_by_sorting(n, key) : first;
}

}  // namespace flexel
