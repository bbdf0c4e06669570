// Loads at contact points, as forces on the elements that carry them; their resultants on free rigid parts.
#pragma once
#include "simulate/contact/pairs/pair_states.h"

namespace flexel::simulate {

// Sums over the pairs of a contact point: a row of simulate/kernels/kernel_contact.h.
struct alignas(64) PointLoad {
  Vec3 force = Vec3::Zero();    // N
  Vec3 turning = Vec3::Zero();  // J, dU/dn
  Mat3 couple = Mat3::Zero();   // N m, sum of force (x) its place from the point
};

// Resultant on a rigid part: N, and N m about the origin or its centre of mass.
struct RigidLoad {
  std::uint32_t part = 0;
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
};

class ContactLoads {
 public:
  // `parts` (parts): 1 for those that can touch. `surface` outlives this.
  ContactLoads(const ContactSurface& surface, const std::vector<std::uint8_t>& parts);

  void clear();
  // Of the acting pairs, along their normals or, `rubbing`, of friction and damping: to `forces` (elements x
  // 3) N and to the resultants.
  void add(const State& state, const PairList& list, const PairStates& states, bool rubbing,
           std::vector<Vec3>& forces);

  // Since clear(), about the origin.
  [[nodiscard]] const std::vector<RigidLoad>& rigid_loads() const { return rigid_loads_; }
  // About the centres of mass in `state`.
  [[nodiscard]] std::vector<RigidLoad> about_centres(const State& state) const;

 private:
  [[nodiscard]] std::array<Vec3, 8> on_elements(const ContactPoint& point, const PointState& now,
                                                const PointLoad& load, const PairStates& states) const;

  static constexpr std::size_t kNotRigid = SIZE_MAX;
  const ContactSurface& surface_;
  std::vector<PointLoad> loads_;         // (PairList::points())
  std::vector<RigidLoad> rigid_loads_;   // of free rigid parts that can touch
  std::vector<std::size_t> rigid_load_;  // (parts) in rigid_loads_, or kNotRigid
};

}  // namespace flexel::simulate
