// Friction, damping and adhesion of contacts.
//
// They act on both sides at one place, half way between the points, and along one line: momentum and angular
// momentum are kept.
//
// Friction (Jansson and Vergeest, equations 4 and 20, with sticking added): a spring along the surface holds
// the points where they first touched, with 0.8 of the stiffness of the contact (Mindlin 1949: 0.8 at Poisson's
// ratio 1/3); where its force would exceed mu N they slide and it stays at mu N. Damping: a dashpot of tau
// times the contact's stiffness, along the normal and, while the pair sticks, along the surface. Without
// adhesion it never pulls.
//
// Adhesion (Jansson and Vergeest, section 3.2: a connection made when elements meet, destroyed when they are t
// apart): points that have touched are joined by a spring, as stiff as the contact, that pulls until its
// extension is t, where the traction is `stick`; along the surface it holds that traction beside mu N, and
// slides beyond.
#pragma once
#include "simulate/contact/contact_loads.h"

namespace flexel::simulate {

constexpr double kTangential = 0.8;  // stiffness of a pair along the surface, of that along the normal

// Of a point in a pair that rubs: m/s; dv/dx of its cell [1/s]. Rows of simulate/kernels/kernel_contact.h, as those
// of the next one.
struct alignas(64) PointMotion {
  Vec3 velocity = Vec3::Zero();
  Mat3 gradient = Mat3::Zero();
};

// Of an active pair: N, on j; from i to j [m], of which `share` is where they meet.
struct alignas(64) PairRubbing {
  Vec3 force = Vec3::Zero(), way = Vec3::Zero();
  double share = 0;
};

class ContactFriction {
 public:
  // All but `damping` [s] outlive this; slip and adhesion are kept in `memory`.
  ContactFriction(double damping, const ContactSurface& surface, const PairList& list,
                  const PairStates& states, PairMemory& memory);

  // The loads in `state`, for which the pairs have been evaluated.
  [[nodiscard]] const PointLoads& loads(const State& state);
  // Slip and adhesion after a step of `drift` s that led to `state`, likewise evaluated. `active`: whether
  // anything dissipates at all.
  void finish_step(const State& state, double drift, bool active);

  // Of an active pair under pressure: from each of its points where they meet [m]; N/m, of the pair along its
  // normal, from no pressure to the present one.
  [[nodiscard]] std::array<Vec3, 2> meeting_place(const ContactPair& pair) const;
  [[nodiscard]] double secant_stiffness(std::size_t pair) const;

  // For checkpoints: whether no step has been finished.
  [[nodiscard]] bool fresh() const { return fresh_; }
  void set_fresh(bool fresh) { fresh_ = fresh; }

 private:
  bool find_motions(const State& state);  // whether they are others than those found last
  // Of the active pairs to rubbing_; with slips brought up to date, where `drift` [s] is not negative.
  void rub(double drift, bool fresh);
  void rub_chunk(std::size_t begin, std::size_t end, double drift, bool fresh);
  void forget_separated();
  void update_record(std::size_t pair, double drift, bool fresh);
  [[nodiscard]] Vec3 force(std::size_t pair) const;
  [[nodiscard]] Vec3 relative_velocity(const ContactPair& pair) const;
  [[nodiscard]] double extension(std::size_t pair) const;
  [[nodiscard]] double largest_tangential(std::size_t pair) const;

  double damping_;
  const ContactSurface& surface_;
  const PairList& list_;
  const PairStates& states_;
  PairMemory& memory_;
  PointLoads loads_;
  std::vector<PairRubbing> rubbing_;  // (active pairs)
  std::uint64_t rubbed_ = 0;          // the evaluation that they are of
  // (PairList::points()) of those in pairs under pressure or that can stick: for which evaluation of the pairs and
  // velocities of PairList::elements().
  std::vector<PointMotion> motions_;
  std::vector<Vec3> velocities_;
  std::uint64_t evaluation_ = 0;
  std::vector<std::uint64_t> point_found_;  // by which find_motions()
  std::vector<std::uint32_t> wanted_;       // points of the last one
  std::uint64_t found_ = 0;
  // Active pairs of the last finish_step(), in the list of this number.
  std::vector<std::uint32_t> last_active_;
  std::uint64_t last_builds_ = 0;
  bool fresh_ = true;
};

}  // namespace flexel::simulate
