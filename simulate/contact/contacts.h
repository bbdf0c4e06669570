// Contact of parts with one another, with themselves and with rigid planes.
//
// Candidate pairs of contact points (PairList) have a present state (PairStates), records from step to step
// (PairMemory) and initial penetrations that are released (OverlapRelease); from these follow conservative
// forces along the normals, dissipative ones (ContactFriction) and a bound of the time step
// (ContactStepBound). Forces on elements are summed in the order of the pairs, so that the bits do not depend
// on the number of threads. One object serves all the hooks of a run.
#pragma once
#include <utility>

#include "simulate/conditions/part_touch.h"
#include "simulate/contact/contact_friction.h"
#include "simulate/contact/contact_step_bound.h"
#include "simulate/contact/contact_stiffness.h"
#include "simulate/contact/implicit_contact.h"

namespace flexel::simulate {

class Contacts {
 public:
  // The body of `problem` outlives this.
  Contacts(ContactSettings settings, const Problem& problem);
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;

  // Whether there may be friction, damping or adhesion.
  [[nodiscard]] bool dissipate() const { return list_.materials().dissipate(); }
  [[nodiscard]] const std::vector<ContactPoint>& points() const { return surface_.points(); }
  [[nodiscard]] const std::vector<UnsureFit>& unsure_fits() const { return list_.unsure_fits(); }

  [[nodiscard]] double energy(const State& state);  // J, of the forces along the normals
  [[nodiscard]] bool act(const State& state);       // whether any pair is near
  void add_forces(const State& state, std::vector<Vec3>& forces);
  // Of friction, damping and adhesion.
  void add_dissipative_forces(const State& state, std::vector<Vec3>& forces);
  // After a step of `drift` s that led to `state`: how softly contact begins; slip and adhesion.
  void finish_step(const State& state, double drift);
  void finish_losses(const State& state, double drift);
  // J, since they were asked for last: what the release of initial penetrations has put in, and what contacts
  // that rest have lost as they hardened; what implicit steps have lost of what is stored.
  struct Energies {
    double released = 0, hardened = 0, numerical = 0;
  };
  [[nodiscard]] Energies take_energies(const State& state);

  // Implicit steps, as the hooks of simulate/effects/effect.h. The share of the step that is borne: none goes
  // further than a spacing, nor than a quarter of one where surfaces are near one another.
  [[nodiscard]] std::string refuses_implicit_steps() const;
  [[nodiscard]] double begin_implicit_step(const State& before, const State& aimed, double step);
  [[nodiscard]] bool take_recoupled() { return std::exchange(coupled_at_, list_.builds()) != list_.builds(); }
  [[nodiscard]] std::vector<CoupledElements> couples() const { return implicit_.couples(); }
  [[nodiscard]] const std::vector<std::uint32_t>& carrying_elements() const { return list_.elements(); }
  void add_normal_stiffness(const State& trial, ContactTangent kind, BlockMatrix& matrix);
  [[nodiscard]] double friction_potential(const State& trial) const;
  void add_friction_stiffness(const State& trial, BlockMatrix& matrix) const;
  [[nodiscard]] bool settles(const State& found);
  void end_implicit_step(const State& state);

  // For checkpoints: all that the next steps depend on beside the state. Throws InputError: `memory` is of
  // other contacts.
  [[nodiscard]] std::vector<double> memory() const;
  void restore(const std::vector<double>& memory);
  // For the contacts of a body that an event has changed: the number of parts and when they joined [s], then
  // pairs by their positions at rest. Pairs that are not there any more are left out.
  [[nodiscard]] std::vector<double> transfer_state() const;
  void restore_from(const std::vector<double>& transfer_state);

  // Throws InputError (simulate/contact/initial_overlap.h). Only before the first evaluation, and after an
  // event for the parts that have joined.
  void refuse_overlap(const State& state);

  // Resultants of the last step's forces on free rigid parts, about the origin; about the centres of mass.
  [[nodiscard]] const std::vector<RigidLoad>& rigid_loads() const { return loads_.rigid_loads(); }
  [[nodiscard]] std::vector<RigidLoad> rigid_loads_about_centres(const State& state) const {
    return loads_.about_centres(state);
  }

  // 1/s^2, added to the square of the largest frequency, or what bounds the motion of a step.
  [[nodiscard]] double frequency(const State& state);
  // Whether more is needed than frequency() said last. The displacements are these until the next
  // finish_step(): the pairs are not looked at again.
  [[nodiscard]] bool needs_step_recheck(const State& state);

  // As the hook of simulate/effects/effect.h; not before the first frequency() of explicit steps, which
  // refuses what overlaps.
  void add_touches(const State& state, double ahead, std::vector<PartTouch>& touches);

  // Pairs under pressure, as numbers of points (a plane: behind the last point), ascending.
  [[nodiscard]] std::vector<std::array<std::uint32_t, 2>> touching(const State& state);

 private:
  // The list of pairs; `ahead`: with the way of the next step.
  void update_list(const State& state, bool ahead);
  // `all`: candidates that cannot touch yet too, for the bound of the step.
  void update(const State& state, bool all = false);

  ContactSettings settings_;
  ContactSurface surface_;
  std::optional<ContactSurface> start_;  // finer, for refuse_overlap() of several parts
  PairList list_;
  PairMemory memory_;
  OverlapRelease release_;
  PairStates states_;
  ContactFriction friction_;
  ContactStepBound bound_;
  ContactLoads loads_;
  ImplicitContact implicit_;
  bool stepping_ = false;         // within an implicit step
  double stored_ = 0;             // J, as it began
  double numerical_ = 0;          // J, of Energies
  std::uint64_t coupled_at_ = 0;  // the list that take_recoupled() has seen
  bool went_through_ = false;     // finish_step() of the step that finish_losses() is asked for
  bool is_current_ = false;       // list and states, for the displacements of the last needs_step_recheck()
};

}  // namespace flexel::simulate
