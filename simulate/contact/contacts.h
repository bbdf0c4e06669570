// Contact of parts with one another, with themselves and with rigid planes: which points touch
// (simulate/contact/contact_points.h), what they do to each other (simulate/contact/pair_law.h) and what they
// remember.
//
// Pairs that could touch come from a grid (simulate/contact/broad_phase.h) with a margin, and are looked for
// anew only when an element of the surface has moved by half of it, relative to all others: motion of
// everything together costs nothing. Forces on the elements are summed pair by pair in the order of the
// pairs, so that the bits do not depend on the number of threads. Not copied: one object serves all the hooks
// of a run.
#pragma once
#include <limits>
#include <optional>
#include <vector>

#include "simulate/contact/broad_phase.h"
#include "simulate/contact/contact_points.h"
#include "simulate/contact/pair_law.h"
#include "simulate/contact/settings.h"

namespace flexel::simulate {

class Contacts {
 public:
  Contacts(ContactSettings settings, const Problem& problem);
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;

  [[nodiscard]] bool empty() const { return points_.empty(); }
  [[nodiscard]] bool loses() const;  // there is friction, damping or what sticks
  [[nodiscard]] const std::vector<ContactPoint>& points() const { return points_; }

  [[nodiscard]] double energy(const State& state);  // J, of the forces along the normals
  void add_forces(const State& state, std::vector<Vec3>& forces);
  // Friction, damping and what pulls because it sticks.
  void add_losses(const State& state, std::vector<Vec3>& forces);
  // After a step of `drift` s that led to `state`: what slid, slid; what touched, sticks; what was torn off
  // is free.
  void remember(const State& state, double drift);
  // All that the next steps depend on besides the state, and back.
  [[nodiscard]] std::vector<double> memory() const;
  void restore(const std::vector<double>& memory);
  // What friction and glue remember, by the places of the points at rest, to go on with in the contacts of a
  // body that an event has changed; what is not there any more is forgotten.
  [[nodiscard]] std::vector<double> transfer_state() const;
  void restore_from(const std::vector<double>& transfer_state);

  // Throws InputError: parts that are inside each other, or a part inside a plane, deeper than contact bears
  // or lets out. Only at the first look, and in one after an event for the parts that have joined.
  void refuse_overlap(const State& state) const;
  // J, that letting out has put into the contacts since this was asked last, beside the work of their forces.
  [[nodiscard]] double injected_energy(const State& state);

  // What contact did to the free rigid parts in the last step: N, and N m about the origin, or about the
  // centre of mass as it is in `state`.
  struct Felt {
    std::uint32_t part = 0;
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
  };
  [[nodiscard]] const std::vector<Felt>& felt() const { return felt_; }
  [[nodiscard]] std::vector<Felt> felt_about_centres(const State& state) const;

  // 1/s^2, what the contacts add to the square of the largest frequency; at least what keeps the motion of a
  // step small against the contact spheres.
  [[nodiscard]] double frequency(const State& state);
  // Whether more is needed now than frequency() said last.
  [[nodiscard]] bool needs_step_recheck(const State& state);

  // Pairs whose spheres are near now, as numbers of points (a plane: after the last point), ascending.
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> touching(const State& state);

 private:
  static constexpr std::uint32_t kNoPoint = 0xffffffff;
  static constexpr double kFree = -1;
  // Surfaces meet from outside. A pair that is deep behind the surface where it comes near is that of a place
  // which something else keeps apart, or of a wall that was passed: `passed`, it does nothing until it has
  // come out. Otherwise the way out would give energy that no way in took.
  enum class PairPhase : std::uint8_t { apart, meeting, passed };
  struct Pair {
    std::uint32_t i = 0, j = kNoPoint;  // numbers in near_; j kNoPoint: of a plane
    std::uint32_t plane = 0;
    std::uint64_t key = 0;
    double friction = 0;
    PairConstants constants;
    double holds = 0;  // m, apart, until what sticks lets go; 0: it does not stick
  };
  // A near point as it is now.
  struct Side {
    ContactSide at;
    Mat3 inverse = Mat3::Identity();  // F^-1 of its cell
    bool shapeless = false;           // the cell is broken, or tells no directions
  };
  // Sums over the pairs of a near point.
  struct Total {
    Vec3 force = Vec3::Zero();    // N
    Vec3 turning = Vec3::Zero();  // dU/dn
    Mat3 couple = Mat3::Zero();   // N m, sum of force (x) its place from the point
  };

  // contact_list.cpp
  void refresh(const State& state);
  void build(const State& state);
  void find_near_matter(const Problem& problem);
  [[nodiscard]] bool near_in_matter(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] bool bonded(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] PairConstants constants(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] PairConstants plane_constants(std::uint32_t i) const;
  [[nodiscard]] bool led(std::uint32_t part) const { return rigid_[part] && !rigid_[part]->free; }
  [[nodiscard]] double friction_of(std::uint32_t point) const { return friction_[points_[point].part]; }
  [[nodiscard]] double foundation(std::uint32_t i, std::uint32_t j) const;
  [[nodiscard]] double stick_of(std::uint32_t point) const;
  [[nodiscard]] double holds(std::uint32_t i, double stick, double foundation) const;
  [[nodiscard]] double reach(std::uint32_t i, std::uint32_t j) const;
  void add_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals);
  void add_plane_pairs(const std::vector<Vec3>& positions, const std::vector<Vec3>& normals);
  void number_near();

  // contacts.cpp
  void find_cells();
  [[nodiscard]] std::size_t broken_cells() const;
  [[nodiscard]] Vec3 position(const ContactPoint& point, const State& state) const;
  [[nodiscard]] Mat3 gradient(const ContactPoint& point, const std::vector<Vec3>& displacement) const;
  [[nodiscard]] Side side(std::uint32_t point, const State& state) const;
  void look(const State& state);
  void stand(std::size_t pair, PairState& now);
  void take_state(std::size_t pair, PairState now);
  [[nodiscard]] bool out_of_reach(const Pair& pair) const;
  bool seen(const State& state);
  [[nodiscard]] ContactSide other_side(const Pair& pair) const;
  [[nodiscard]] PairState state_of(std::size_t pair, double allowed) const;
  void spread(const State& state, const std::vector<Total>& totals, std::vector<Vec3>& forces);
  // contact_overlap.cpp
  struct Overlap {
    double depth = 0, most = 0;  // m: how deep, how deep it may be to be let out; 0: none
    bool over = false;           // deeper than looked
  };
  [[nodiscard]] std::vector<std::uint8_t> inside(const std::vector<std::uint32_t>& points,
                                                 std::uint32_t other, const std::vector<Side>& sides,
                                                 const State& state) const;
  [[nodiscard]] Overlap overlap(const std::array<std::uint32_t, 2>& parts, const Box& common,
                                const std::vector<Side>& sides, const State& state) const;
  // contact_parting.cpp
  [[nodiscard]] std::vector<double> shares(const State& state) const;
  [[nodiscard]] double allowed(std::size_t pair) const;
  [[nodiscard]] std::uint32_t later_part(const Pair& pair) const;
  [[nodiscard]] std::uint64_t other_of(const Pair& pair) const;
  void find_inside(const State& state);
  void let_in(const std::vector<std::uint32_t>& pairs);
  void book_letting_out(const std::vector<double>& before);
  // contact_losses.cpp
  struct Motion {  // of a near point: its velocity [m/s] and that of the matter around it, dv/dx [1/s]
    Vec3 velocity = Vec3::Zero();
    Mat3 gradient = Mat3::Zero();
  };
  void find_motions(const State& state);
  [[nodiscard]] std::array<Vec3, 2> meeting(const Pair& pair) const;
  void forget_parted();
  [[nodiscard]] double drawn(std::size_t pair) const;
  [[nodiscard]] double secant(std::size_t pair) const;
  [[nodiscard]] double most_across(std::size_t pair) const;
  [[nodiscard]] Vec3 relative_velocity(const Pair& pair) const;
  // contact_bound.cpp
  [[nodiscard]] double stiffness_bound() const;
  [[nodiscard]] double speed(const State& state) const;

  ContactSettings settings_;
  const Body& body_;
  std::vector<ContactPoint> points_;
  std::vector<std::array<Vec3, 8>> gradients_;         // (parts) 1/m, of the corners' weights
  std::vector<double> foundation_, friction_, stick_;  // (parts) kappa [Pa/m]; mu; Pa, infinity: glue
  Neighbours near_matter_;  // pairs that look at each other through less than three cells
  double widest_ = 0, narrowest_ = std::numeric_limits<double>::infinity();  // m, spacings

  std::vector<std::uint32_t> cell_;      // (points_) that carries it; kNoPoint: none
  std::vector<std::uint32_t> cells_;     // that carry points, ascending
  std::vector<std::uint32_t> elements_;  // that carry points, ascending
  std::vector<Vec3> built_at_;           // (elements_) their displacements when the pairs were found
  bool built_ = false;
  std::size_t built_with_ = 0;       // broken cells then
  double slack_ = 0;                 // m, by which they may move before new ones can touch
  std::vector<Pair> pairs_;          // ascending by key
  std::vector<std::uint32_t> near_;  // points of pairs, ascending
  // The state that was last looked at: displacements of the elements of near_, sides and pairs.
  std::vector<std::uint32_t> near_elements_;
  std::vector<Vec3> seen_;
  std::uint64_t seen_builds_ = 0;
  std::vector<Side> sides_;        // (near_)
  std::vector<PairState> states_;  // (pairs_) of those that are not near nothing
  // The others, ascending: most that are listed only may come near, and the hooks pass them by.
  std::vector<std::uint32_t> close_;
  std::vector<std::uint8_t> is_close_;  // (pairs_)
  std::uint64_t looks_ = 0;             // states looked at so far
  // Motions of the near points, at the look and with the velocities of near_elements_ that they are of.
  std::vector<Motion> motions_;
  std::vector<Vec3> moving_;
  std::uint64_t moved_looks_ = 0;
  // What pairs remember, ascending by key: with the places where the list was made the only state of contact
  // that is not a function of where everything is now.
  struct Memory {
    std::uint64_t key = 0;
    Vec3 stretch = Vec3::Zero();  // m, of the spring along the surface that resists sliding
    double stuck = kFree;         // m, the gap at which what sticks pulls nothing; kFree: it does not stick
    PairPhase standing = PairPhase::apart;
    double inside = 0;  // m, that they began in each other: a share of it they may still be
  };
  std::vector<Memory> memory_;             // (pairs_); before the first list what was taken over
  std::vector<std::uint32_t> remembered_;  // close_ of the last remember(), in the list
  std::uint64_t remembered_builds_ = 0;    //   of this number
  bool fresh_ = true;                      // nothing has been remembered yet
  // s, when each part joined: those that are looked at already. What begins inside something else has been
  // looked for among them.
  std::vector<double> joined_;
  // (parts) of Memory::inside that is allowed for, in the state last looked at, of pairs whose later part it
  // is; empty before the first look of these contacts, or where nothing is let out.
  std::vector<double> shares_;
  std::vector<double> pressing_;  // (parts) J a share, there: pressures times Memory::inside
  double put_in_ = 0;             // J
  std::vector<Felt> felt_;
  std::vector<double> mass_;  // (elements) kg
  struct Whole {              // of a rigid part
    bool free = false;
    Vec3 centre = Vec3::Zero();            // m, at rest
    double per_mass = 0, per_inertia = 0;  // 1/kg, 1/(kg m^2), the largest
  };
  std::vector<std::optional<Whole>> rigid_;   // (parts)
  double promised_ = 0;                       // 1/s^2
  std::uint64_t builds_ = 0, looked_at_ = 0;  // lists so far, and when the bound was last looked at
};

}  // namespace flexel::simulate
