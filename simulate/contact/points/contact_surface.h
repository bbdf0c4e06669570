// The contact points of a body, the matter that carries them, and where they are in a state. Fixed during a
// run; broken cells are read from the body.
#pragma once
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "simulate/contact/points/contact_points.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// The matter around a point in a state.
struct CellShape {
  Mat3 inverse = Mat3::Identity();  // F^-1 of its cell
  bool shapeless = false;           // the cell is broken or too distorted for a normal
  // Change of a normal, at most, by that of F; infinity where a little more would make it shapeless.
  double normal_rate = 0;
};

struct SideState {
  ContactSide side;
};

// A contact point in a state: a row of simulate/kernels/kernel_contact.h.
struct alignas(64) PointState : SideState, CellShape {};

// A part that does not deform.
struct RigidPart {
  bool free = false;                     // else its motion is prescribed
  Vec3 centre = Vec3::Zero();            // m, of mass, at rest
  double per_mass = 0, per_inertia = 0;  // 1/kg; 1/(kg m^2), the largest
};

class ContactSurface {
 public:
  // `parts` (parts): 1 for those that can touch; `patches`: of the surface, across a cell. The body outlives
  // this.
  ContactSurface(const Problem& problem, const std::vector<std::uint8_t>& parts, int patches = 1);

  [[nodiscard]] const Body& body() const { return body_; }
  [[nodiscard]] const std::vector<ContactPoint>& points() const { return points_; }
  // Elements that carry points, ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& elements() const { return elements_; }
  [[nodiscard]] double widest() const { return widest_; }        // m, spacing; without points 0
  [[nodiscard]] double narrowest() const { return narrowest_; }  // m; without points infinity
  [[nodiscard]] double mass(std::uint32_t element) const { return mass_[element]; }  // kg
  // (8) 1/m, gradients of the weights of a cell's corners.
  [[nodiscard]] const std::array<Vec3, 8>& gradients(std::uint32_t part) const { return gradients_[part]; }
  // Nothing: the part deforms.
  [[nodiscard]] const std::optional<RigidPart>& rigid(std::uint32_t part) const { return rigid_[part]; }
  [[nodiscard]] bool prescribed(std::uint32_t part) const { return rigid_[part] && !rigid_[part]->free; }

  [[nodiscard]] PointState at(std::uint32_t point, const State& state) const;
  // The same for all points that one cell carries; `gradient` of the displacements there.
  [[nodiscard]] CellShape shape_at(std::uint32_t point, const Mat3& gradient) const;
  // `displacement` [m] of the point.
  [[nodiscard]] PointState at(std::uint32_t point, const Vec3& displacement, const CellShape& shape) const;
  // That carries it; nothing: none of eight corners does.
  [[nodiscard]] std::optional<std::uint32_t> cell(std::uint32_t point) const;
  [[nodiscard]] bool broken(std::uint32_t point) const;  // that cell
  // Of those that carry points.
  [[nodiscard]] std::size_t broken_cells() const;

 private:
  void find_cells();

  const Body& body_;
  std::vector<ContactPoint> points_;
  std::vector<std::array<Vec3, 8>> gradients_;   // (parts)
  std::vector<double> mass_;                     // (elements)
  std::vector<std::optional<RigidPart>> rigid_;  // (parts)
  double widest_ = 0, narrowest_ = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> cell_;   // (points_) that carries it; kNoCarrier: none
  std::vector<std::uint32_t> cells_;  // that carry points, ascending
  std::vector<std::uint32_t> elements_;
};

}  // namespace flexel::simulate
