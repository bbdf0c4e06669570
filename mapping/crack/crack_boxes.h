// The Voronoi cells of a part's elements at rest, as far as they hold matter: boxes one spacing wide around
// each lattice index. Boxes without an element (the surface may pass beyond the lattice) go with the nearest
// element.
//
// Coordinates here are "box coordinates" u: an element with lattice index i is at u = i, whatever the
// placement. Box i ends where box i + 1 begins: at plane i of an axis, u = i + 1/2 + shift. The shift, a tiny
// part of the spacing, keeps flat faces of the part, which lie on multiples of half a spacing, off the
// planes.
#pragma once
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/crack/crack_parted.h"

namespace flexel::mapping {

constexpr std::uint32_t kNoBox = 0xffffffffu;
// In place of a fragment: the box has elements of several (leaves closer to each other than a spacing).
constexpr std::uint32_t kMixed = 0xfffffffeu;

// Boxes from `low` to `high`, both included.
struct BoxRange {
  Index3 low{}, high{};
};

class CrackBoxes {
 public:
  // `triangles`: corners in box coordinates of every triangle of the part's surface.
  CrackBoxes(const Body& body, std::uint32_t part, const Components& fragments, const PartedPairs& parted,
             const Vec3& shift, const std::vector<std::array<Vec3, 3>>& triangles);

  [[nodiscard]] double plane(int axis, int i) const { return i + 0.5 + shift_[axis]; }
  [[nodiscard]] int box_of(int axis, double u) const {
    return static_cast<int>(std::floor(u + 0.5 - shift_[axis]));
  }
  [[nodiscard]] Index3 box_of(const Vec3& u) const {
    return {box_of(0, u[0]), box_of(1, u[1]), box_of(2, u[2])};
  }
  // kNoBox where no matter is.
  [[nodiscard]] std::uint32_t find(const Index3& index) const;
  // Its element; the first where it has several.
  [[nodiscard]] std::uint32_t owner(std::uint32_t box) const { return owner_[box]; }
  // Of its elements, or kMixed.
  [[nodiscard]] std::uint32_t fragment(std::uint32_t box) const { return fragment_[box]; }
  // The first of a box's elements that is of `fragment`; kNoBox: none.
  [[nodiscard]] std::uint32_t owner_in(std::uint32_t box, std::uint32_t fragment) const;

  // A square between a box and the next one along `axis`: of another fragment, or parted from it by a crack
  // that ends inside the fragment; or one of which is mixed.
  struct Square {
    int axis = 0;
    Index3 low{};  // the box below
  };
  [[nodiscard]] const std::vector<Square>& squares() const { return squares_; }
  [[nodiscard]] bool is_square(int axis, const Index3& low) const;
  // The square there: none; between two fragments; of a crack inside one; or with a mixed box.
  enum class Face { whole, fragments, inside, mixed };
  [[nodiscard]] Face face(int axis, const Index3& low) const;
  // The four boxes around a lattice line (along `along`, planes `p`, `q` of the other two axes, ascending; at
  // box `at` along it), as numbers that are equal where matter is connected around the line: by
  // [high along the first axis + 2 high along the second]. A box without matter has one of its own. Nothing
  // where one of them is mixed.
  using Sectors = std::array<std::uint8_t, 4>;
  [[nodiscard]] std::optional<Sectors> sectors(int along, int p, int q, int at) const;
  // True when two of the sectors are of one fragment: a piece touches itself along the line.
  [[nodiscard]] bool touches_itself(int along, int p, int q, int at) const;
  // True when a crack that ends inside passes between the two elements.
  [[nodiscard]] bool parted(std::uint32_t element, std::uint32_t other) const {
    return parted_.contains(element, other);
  }
  // The plane to cut `range` along so that it comes to lie in boxes of one fragment: one that has a square in
  // range, near the middle of the longest such axis. axis < 0: there is none.
  struct Plane {
    int axis = -1, index = 0;
  };
  [[nodiscard]] Plane find_cut(const BoxRange& range) const;

 private:
  template <class Visit>
  void for_each_owner(std::uint32_t box, const Visit& visit) const;
  void add_surface_boxes(const std::vector<std::array<Vec3, 3>>& triangles,
                         std::vector<std::uint64_t>& keys) const;
  [[nodiscard]] std::uint64_t key(std::int64_t slow, std::int64_t middle, std::int64_t fast) const;
  [[nodiscard]] bool has_square(int axis, int plane, const BoxRange& range) const;
  [[nodiscard]] bool parted_boxes(std::uint32_t box, std::uint32_t next) const;
  [[nodiscard]] std::array<Index3, 4> around_line(int along, int p, int q, int at) const;

  const Body& body_;
  const Components& fragments_;
  const PartedPairs& parted_;
  Vec3 shift_;
  std::vector<std::uint64_t> keys_;      // (boxes) ascending
  std::vector<std::uint32_t> owner_;     // (boxes)
  std::vector<std::uint32_t> fragment_;  // (boxes)
  std::vector<Square> squares_;          // by axis, plane
  // By axis: plane, then the next two axes; ascending
  std::array<std::vector<std::uint64_t>, 3> square_keys_;
};

}  // namespace flexel::mapping
