// The element of a part that is nearest to a point at rest.
#pragma once
#include <cstdint>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::mapping {

// A uniform grid over the elements of one part, along the axes of its lattice.
class ElementGrid {
 public:
  // `body` must outlive nothing: the rest positions are copied. The part must have at least one element.
  ElementGrid(const Body& body, std::uint32_t part);

  // The nearest element at rest to `point` (m, world frame), wherever the point lies; of those equally near
  // (within 1e-9) the one nearest to the middle of the part, then the lowest.
  [[nodiscard]] std::uint32_t nearest(const Vec3& point) const;

 private:
  struct Best {
    double squared_distance, from_middle;  // m^2
    std::uint32_t element;
  };
  [[nodiscard]] std::array<std::int64_t, 3> bucket_of(const Vec3& local) const;
  void look_into(std::int64_t i_begin, std::int64_t i_end, std::int64_t j, std::int64_t k, const Vec3& local,
                 Best& best) const;
  void look_into_shell(const std::array<std::int64_t, 3>& home, std::int64_t radius, const Vec3& local,
                       Best& best) const;
  [[nodiscard]] double distance_beyond(const std::array<std::int64_t, 3>& home, std::int64_t radius,
                                       const Vec3& inside) const;

  Mat3 to_local_;                        // world -> along the lattice's axes
  Vec3 world_origin_, size_;             // m
  Vec3 width_;                           // m, of a bucket
  std::array<std::int64_t, 3> count_{};  // buckets along each axis
  std::vector<std::uint32_t> offsets_;   // (buckets + 1)
  std::vector<std::uint32_t> elements_;  // (elements) by bucket, ascending within one
  std::vector<Vec3> local_;              // (elements x 3) m, in the order of elements_
};

}  // namespace flexel::mapping
