// Rigid parts and manipulators (docs/reference/contact.md): `rigid = true` of [parts.NAME], a part with six degrees of
// freedom; [[manipulator]], a rigid part on a path. Their cells do not resist and cost nothing; they touch
// what [contact] lets them.
#pragma once
#include "simulate/effects/effect.h"
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

class RigidParts {
 public:
  struct Parameters {
    std::vector<std::string> parts;  // `rigid = true`
    std::vector<Manipulator> manipulators;
  };
  static constexpr const char* name = "rigid";
  static constexpr bool needs_time = true;

  static void parse(TableReader& scene, Parameters& parameters);
  // Of each part: what the scene makes of it. Throws InputError: a name that the body does not have, two
  // paths of one part.
  [[nodiscard]] static std::vector<Rigidity> rigidity(const Parameters& parameters, const Body& body);

  [[nodiscard]] static std::optional<RigidParts> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const;

  void start(State& state) const;
  void begin(const State& state) const;
  void finish_step(State& state, const StepDone& done) const;
  // N (elements): what keeps a manipulator on its path, in the last step.
  void add_support_forces(std::vector<Vec3>& forces) const;
  [[nodiscard]] std::vector<double> memory() const;
  void restore(const std::vector<double>& memory) const;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) const;
  // Reactions in the last step: force and torque on the manipulator, by what leads it, about `about` as it is
  // now.
  [[nodiscard]] std::vector<std::string> history_columns() const;
  [[nodiscard]] std::vector<double> history_values(const State& state,
                                                   const std::vector<Vec3>& unbalanced) const;

 private:
  struct Moving {
    RigidBody body;
    std::optional<Manipulator> led;
    [[nodiscard]] Pose pose_at(double time) const;
    std::vector<Vec3> velocity;                        // (its elements) m/s, that the step began with
    std::vector<Vec3> support;                         // (its elements) N, of the last step; of those led
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // N, N m, of what leads it
  };
  // What moves is the parts; effects themselves stay as they are made.
  std::shared_ptr<std::vector<Moving>> moving_;
  const Body* body_ = nullptr;
  std::vector<double> mass_;  // (elements) kg
};

}  // namespace flexel::simulate
