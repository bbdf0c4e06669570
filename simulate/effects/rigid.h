// Rigid parts and manipulators (docs/reference/contact.md): `rigid = true` of [parts.NAME], a part with six degrees of
// freedom; [[manipulator]], a rigid part on a path. Their cells do not resist and cost nothing; they touch
// what [contact] lets them.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/rigid/joints.h"
#include "simulate/rigid/live_tool.h"
#include "simulate/rigid/path.h"
#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {

struct Manipulator {
  std::string part, name;
  ManipulatorPath path;
  std::string origin;                        // "bend.toml:12"
  std::shared_ptr<LiveTool> live = nullptr;  // `path = "stdin"`, or in a run that tells what it feels
};

class RigidParts : public Effect {
 public:
  struct Parameters {
    std::vector<std::string> parts;  // `rigid = true`
    std::vector<Manipulator> manipulators;
    std::vector<std::string> soft;  // `rigid = false`
  };
  static constexpr const char* name = "rigid";

  static void parse(TableReader& scene, Parameters& parameters);
  // Of each part: what the scene makes of it; its own entry of [parts] goes before those of the assemblies that hold it,
  // a smaller assembly before a larger one. Throws InputError: a name that the body does not have, two
  // paths of one part.
  [[nodiscard]] static std::vector<Rigidity> rigidity(const Parameters& parameters, const Body& body);

  [[nodiscard]] static std::optional<RigidParts> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;

  // Of those that move, by number: that of a part of the body, if it is one; its state; whether a path leads it.
  [[nodiscard]] std::optional<std::size_t> number_of(std::uint32_t part) const;
  [[nodiscard]] const RigidBody& body(std::size_t number) const { return moving_[number].body; }
  [[nodiscard]] bool is_led(std::size_t number) const { return moving_[number].led.has_value(); }
  // From now on these joints hold; the states of all, which stay where they are.
  [[nodiscard]] std::vector<const RigidBody*> join(std::shared_ptr<JointSystem> joints);

  [[nodiscard]] bool finishes_steps() const override { return true; }
  [[nodiscard]] bool needs_mass() const override { return true; }
  void start(State& state) override;
  void begin(const State& state) override;
  void finish_step(State& state, const StepDone& done) override;
  [[nodiscard]] std::string refuses_implicit_steps() const override;
  void constrain_implicit_steps(Constraints& constraints) override;
  void lead_to(double time, std::vector<Vec3>& displacement) override;
  void end_implicit_step(const State& state, const StepDone& done,
                         const std::vector<Vec3>& supports) override;
  [[nodiscard]] std::vector<RigidMomenta> rigid_momenta(bool half_kick) const override;
  // N (elements): what keeps a manipulator on its path, in the last step.
  void add_support_forces(std::vector<Vec3>& forces) override;
  [[nodiscard]] std::vector<double> memory() const override;
  void restore(const std::vector<double>& memory) override;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;
  // Reactions in the last step: force and torque on the manipulator, by what leads it, about `about` as it is
  // now.
  [[nodiscard]] std::vector<std::string> history_columns() const override;
  [[nodiscard]] std::vector<double> history_values(const State& state,
                                                   const std::vector<Vec3>& unbalanced) override;

 private:
  struct Before {  // the last step
    Pose pose;
    Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();
  };
  struct Moving {
    RigidBody body;
    Before before;
    std::optional<Manipulator> led;
    std::shared_ptr<RigidLink> link = nullptr;  // of those led, in implicit steps: where it is
    [[nodiscard]] Pose pose_at(double time) const;
    std::vector<Vec3> velocity;                        // (its elements) m/s, that the step began with
    std::vector<Vec3> support;                         // (its elements) N, of the last step; of those led
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // N, N m, of what leads it
    void feel(const Pose& next, const Mat3& rotation, const Vec3& impulse, const Vec3& turning,
              const StepDone& done);
  };
  [[nodiscard]] std::vector<JointedBody> as_jointed() const;

  std::vector<Moving> moving_;
  std::shared_ptr<JointSystem> joints_;  // null: there are none
  const Body* body_ = nullptr;
  std::vector<double> mass_;  // (elements) kg
};

}  // namespace flexel::simulate
