// Each function passes once over all polygons or vertices; tables hold only the requested ones.
#include "mapping/anchors/polygons_around.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <numeric>

#include "base/bucket.h"
#include "base/math/weld.h"

namespace flexel::mapping {

std::vector<std::uint32_t> first_polygons(const Surface& surface) {
  std::vector<std::uint32_t> result;
  resize_touched(result, surface.vertices.size());
  std::fill(result.begin(), result.end(), kNone);
  parallel_chunks(surface.polygon_count(), kPolygonsAtATime, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      for (const std::uint32_t v : surface.polygon(p)) {
        const std::atomic_ref<std::uint32_t> first(result[v]);
        std::uint32_t known = first.load(std::memory_order_relaxed);
        while (p < known && !first.compare_exchange_weak(known, static_cast<std::uint32_t>(p),
                                                         std::memory_order_relaxed)) {
        }
      }
  });
  return result;
}

Around polygons_around(const Surface& surface, const std::vector<std::uint32_t>& representative,
                       const std::vector<std::uint32_t>& wanted) {
  Around around;
  around.slot.assign(surface.vertices.size(), kNone);
  for (std::size_t i = 0; i < wanted.size(); ++i) around.slot[wanted[i]] = static_cast<std::uint32_t>(i);
  around.offsets.assign(wanted.size() + 1, 0);
  const auto for_each_corner = [&](const auto& visit) {
    for (std::size_t p = 0; p < surface.polygon_count(); ++p)
      for (const std::uint32_t v : surface.polygon(p)) {
        const std::uint32_t slot = around.slot[representative.empty() ? v : representative[v]];
        if (slot != kNone) visit(slot, static_cast<std::uint32_t>(p));
      }
  };
  for_each_corner([&](std::uint32_t slot, std::uint32_t) { ++around.offsets[slot + 1]; });
  for (std::size_t i = 1; i < around.offsets.size(); ++i) around.offsets[i] += around.offsets[i - 1];
  std::vector<std::uint32_t> next(around.offsets.begin(), around.offsets.end() - 1);
  around.polygons.resize(around.offsets.back());
  for_each_corner([&](std::uint32_t slot, std::uint32_t p) { around.polygons[next[slot]++] = p; });
  return around;
}

std::vector<std::uint32_t> at_positions_of(const std::vector<Vec3>& vertices,
                                           const std::vector<std::uint32_t>& wanted) {
  constexpr std::size_t kPlaces = 16;  // for each of them
  constexpr std::size_t kMany = 8;     // one in so many: to leave the others out costs more than it spares
  if (wanted.size() * kMany >= vertices.size()) {
    std::vector<std::uint32_t> all(vertices.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }
  const std::size_t last = std::bit_ceil(kPlaces * wanted.size()) - 1;
  const auto place = [&](std::size_t v) {
    return hash_key(position_key(vertices[v].x(), vertices[v].y(), vertices[v].z())) & last;
  };
  std::vector<std::uint8_t> taken(last + 1, 0), found;
  for (const std::uint32_t v : wanted) taken[place(v)] = 1;
  resize_touched(found, vertices.size());
  parallel_for_each(vertices.size(), [&](std::size_t v) { found[v] = taken[place(v)]; });
  std::vector<std::uint32_t> result;
  for (std::uint32_t v = 0; v < found.size(); ++v)
    if (found[v]) result.push_back(v);
  return result;
}

}  // namespace flexel::mapping
