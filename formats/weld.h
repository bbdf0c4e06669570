// Which positions are exactly equal. Positions are spread by the top bits of a hash over buckets that depend
// on their number only; each bucket is then searched by one thread with an open-addressing table, in
// ascending order, so that the first of equal positions is found whatever the number of threads.
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "formats/parallel.h"

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

// Indices [0, n) grouped by bucket, ascending inside each. `starts` has bucket_count + 1 entries.
struct Buckets {
  std::vector<std::uint32_t> members, starts;
};

[[nodiscard]] inline Buckets group_by_bucket(const std::vector<std::uint64_t>& hashes, int bits) {
  const std::size_t n = hashes.size(), buckets = std::size_t{1} << bits;
  const std::size_t chunks = (n + kWeldChunk - 1) / kWeldChunk;
  const auto bucket_of = [&](std::size_t i) { return bits == 0 ? 0 : hashes[i] >> (64 - bits); };
  std::vector<std::uint32_t> count(chunks * buckets, 0);
  parallel_chunks(n, kWeldChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* row = &count[begin / kWeldChunk * buckets];
    for (std::size_t i = begin; i < end; ++i) ++row[bucket_of(i)];
  });
  Buckets result{std::vector<std::uint32_t>(n), std::vector<std::uint32_t>(buckets + 1, 0)};
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
  parallel_chunks(n, kWeldChunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* row = &count[begin / kWeldChunk * buckets];
    for (std::size_t i = begin; i < end; ++i)
      result.members[row[bucket_of(i)]++] = static_cast<std::uint32_t>(i);
  });
  return result;
}

}  // namespace detail

// For each of n positions the index of the first that is equal. `key(i)` gives the position's bits.
template <class Key>
[[nodiscard]] std::vector<std::uint32_t> first_equal(std::size_t n, const Key& key) {
  constexpr std::uint32_t kEmpty = 0xffffffffu;
  std::vector<std::uint64_t> hashes(n);
  parallel_for_each(
      n, [&](std::size_t i) { hashes[i] = hash_key(key(i)); }, detail::kWeldChunk);
  const int bits = n < (1u << 15) ? 0 : std::min(8, static_cast<int>(std::bit_width(n >> 14)));
  const detail::Buckets buckets = detail::group_by_bucket(hashes, bits);
  std::vector<std::uint32_t> first(n);
  parallel_chunks(buckets.starts.size() - 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const std::size_t size = buckets.starts[b + 1] - buckets.starts[b];
      const std::size_t mask = std::bit_ceil(2 * size + 1) - 1;
      std::vector<std::uint32_t> table(mask + 1, kEmpty);
      for (std::size_t m = buckets.starts[b]; m < buckets.starts[b + 1]; ++m) {
        const std::uint32_t i = buckets.members[m];
        std::size_t slot = hashes[i] & mask;
        while (table[slot] != kEmpty && (hashes[table[slot]] != hashes[i] || key(table[slot]) != key(i)))
          slot = (slot + 1) & mask;
        if (table[slot] == kEmpty) table[slot] = i;
        first[i] = table[slot];
      }
    }
  });
  return first;
}

}  // namespace flexel
