// The cells that carry the points of a list of pairs, and where the points are and go in a state. Elements are
// numbered as in PairList::elements(), so that what a step reads of them lies together in memory; what points of one cell share
// is found once.
#pragma once
#include <utility>

#include "simulate/contact/pairs/pair_list.h"
#include "simulate/kernels/kernel_contact.h"

namespace flexel::simulate {

struct CarryingCell {
  std::uint32_t part = 0, point = 0;                         // one of those that it carries
  std::array<std::uint32_t, 8> corners{};                    // in PairList::elements()
  std::uint32_t count = 0;                                   // of corners
  [[nodiscard]] bool deforms() const { return count == 8; }  // else its points have no normal
};

using contact_kernels::CarriedPoint;

// Of this machine.
[[nodiscard]] const contact_kernels::ContactTable& contact_kernel_table();

// Of a point: m/s; dv/dx of its cell [1/s]. A row of simulate/kernels/kernel_contact.h.
struct alignas(64) PointMotion {
  Vec3 velocity = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
};

class CarryingCells {
 public:
  explicit CarryingCells(const ContactSurface& surface);  // outlives this

  // To the points of a new list; those that nothing of eight corners carries get a cell each.
  void reset(const PairList& list);

  [[nodiscard]] const std::vector<CarryingCell>& cells() const { return cells_; }
  [[nodiscard]] const std::vector<CarriedPoint>& points() const { return points_; }  // (PairList::points())
  // Points whose state and, if `moving`, motion place() finds: none, and those that are wanted since.
  void want_none();
  void want(std::uint32_t point) {
    if (std::exchange(wanted_by_[point], asked_) != asked_) wanted_.push_back(point);
  }
  [[nodiscard]] const std::vector<std::uint32_t>& wanted() const { return wanted_; }
  void place(const State& state, bool moving);
  [[nodiscard]] const std::vector<PointState>& states() const { return states_; }     // (points())
  [[nodiscard]] const std::vector<PointMotion>& motions() const { return motions_; }  // (points())

  // (axes) 1/m, gradients of the cell's weights along its axes: that of corner a is the sum of these with the
  // signs of a.
  [[nodiscard]] const std::array<Vec3, 3>& slopes(std::uint32_t part) const { return slopes_[part]; }

  // Norm of the gradient of `values` (PairList::elements()) in a cell that deforms, by the places at rest: the mean
  // over it.
  [[nodiscard]] double gradient_norm(const CarryingCell& cell, const std::vector<Vec3>& values) const;

 private:
  // (axes) sums over the corners with their signs.
  [[nodiscard]] static std::array<Vec3, 3> differences(const CarryingCell& cell,
                                                       const std::vector<Vec3>& values);

  [[nodiscard]] CarriedPoint carried(const ContactPoint& point, bool broken) const;

  const ContactSurface& surface_;
  std::vector<CarryingCell> cells_;
  std::vector<std::uint32_t> places_,
      cell_;  // (elements) in PairList::elements(); (cells) in cells_: of reset()
  std::vector<CarriedPoint> points_;
  std::vector<std::array<Vec3, 3>> slopes_;  // (parts)
  std::vector<Vec3> steepness_;              // (parts) 1/m, norms of the slopes
  std::vector<std::uint32_t> wanted_;
  std::vector<std::uint64_t> wanted_by_;  // (points_) by which of all askings
  std::uint64_t asked_ = 0;
  std::vector<PointState> states_;
  std::vector<PointMotion> motions_;
};

}  // namespace flexel::simulate
