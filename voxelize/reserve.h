// Room for large arrays in huge pages: much of the time to fill a new array is the system's, which zeroes and
// maps it page by page. Only a wish: where huge pages are not to be had, nothing changes.
#pragma once
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace flexel {

// Makes room for n entries in all, at least doubling what room there was, so that many small steps stay
// linear.
template <class Value>
void reserve_large(std::vector<Value>& array, std::size_t n) {
  constexpr std::uintptr_t kPage = 4096, kHuge = std::uintptr_t{1} << 21;
  if (n <= array.capacity()) return;
  array.reserve(std::max(n, 2 * array.capacity()));
  const auto begin = reinterpret_cast<std::uintptr_t>(array.data());
  const std::uintptr_t end = (begin + array.capacity() * sizeof(Value)) & ~(kPage - 1);
  const std::uintptr_t first = (begin + kPage - 1) & ~(kPage - 1);
  if (end > first + 2 * kHuge) (void)::madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
}

// The same, and n entries in all.
template <class Value>
void resize_large(std::vector<Value>& array, std::size_t n) {
  reserve_large(array, n);
  array.resize(n);
}

}  // namespace flexel
