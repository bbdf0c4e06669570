// The `blended` deformation as a map of space: phi(x) and its gradient at any point in or near the part.
// Twice continuously differentiable, as fitting curves and surfaces (STEP) needs.
#pragma once
#include <memory>
#include <optional>
#include <unordered_map>

#include "base/bucket.h"
#include "mapping/anchors/nearest.h"
#include "mapping/anchors/vertex_batches.h"
#include "mapping/methods/element_motion.h"

namespace flexel::mapping {

class SpaceMap {
 public:
  // The state body.position. `body` must outlive this and stay as it is. Throws InputError: a part without
  // elements.
  explicit SpaceMap(const Body& body);

  struct Value {
    Vec3 position = Vec3::Zero();      // phi(x), m
    Mat3 gradient = Mat3::Identity();  // d phi / d x; a determinant of 0 or less: space is folded there
    bool in_radius =
        true;           // false: farther than kBlendRadius from every element, carried by the nearest frame
    double weight = 0;  // of all elements together: falls to 0 where none is near
  };

  // Evaluates points; keeps what it gathered for the cells of the last ones. One for each thread. It must not
  // outlive the map.
  class Probe {
   public:
    explicit Probe(const SpaceMap& map) : map_(map), finder_(map.connections_) {}
    Probe(const Probe&) = delete;
    Probe& operator=(const Probe&) = delete;
    // `x` (m, world frame, at rest) of part `part`. `polygon`: of the surface, near x; it selects the wall
    // where two walls are nearer to each other than a spacing.
    [[nodiscard]] Value at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon = {});
    // The same without the gradient, which is left as it is in a new Value.
    [[nodiscard]] Value place(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon = {});

    // The cell that x lies in, or that is nearest to it; nothing where no whole cell is there.
    [[nodiscard]] std::optional<std::uint32_t> cell_at(const Vec3& x, std::uint32_t part,
                                                       std::optional<std::size_t> polygon = {}) const;

   private:
    // Of a cell or an element: those whose weights may count near it.
    struct Reached {
      Group group;
      std::vector<std::uint32_t> elements;
      std::vector<std::uint8_t> from;  // (elements)
      std::vector<Vec3> offset;        // (elements) spacings, as seen from the group
    };
    [[nodiscard]] const Reached& reached(const Group& group);
    [[nodiscard]] Value nearest(const Reached& near, const Vec3& x) const;
    template <bool kGradient>
    [[nodiscard]] Value blend(const Reached& near, const Vec3& x) const;
    const SpaceMap& map_;
    ReachFinder finder_;
    std::unordered_map<std::uint64_t, Reached> reached_;  // by owner
    const Reached* last_ = nullptr;                       // of reached_
  };

  // (elements) The motion around each.
  [[nodiscard]] const std::vector<ElementMotion>& motions() const { return motions_; }
  // The cells that have the element.
  [[nodiscard]] std::span<const std::uint32_t> cells_of(std::uint32_t element) const {
    return {cells_of_.values.data() + cells_of_.begin[element],
            cells_of_.begin[element + 1] - cells_of_.begin[element]};
  }

 private:
  [[nodiscard]] Group group_at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon) const;
  const Body& body_;
  Adjacency connections_;
  Buckets<std::uint32_t> cells_of_;                  // (elements) cells around each
  std::vector<ElementMotion> motions_;               // (elements)
  std::vector<std::unique_ptr<ElementGrid>> grids_;  // (parts)
};

}  // namespace flexel::mapping
