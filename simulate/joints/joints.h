// [[joint]]: joints between rigid parts, or of one with the world (simulate/rigid/joints.h, docs/reference/joints.md).
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/rigid/joints.h"

namespace flexel::simulate {

class Bonds;
class RigidParts;

class Joints : public Effect {
 public:
  struct Parameters {
    std::vector<Joint> joints;
  };
  static constexpr const char* name = "joints";

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: an earlier run fused two parts of a joint, which could not move.
  static void refuse_fused(const Parameters& parameters, const Body& body);
  // Joins the parts of `rigid` (null: there are none). Throws InputError: an unknown part, one that is not rigid, none
  // that is free, parts that `bonds` (or null) hold together.
  [[nodiscard]] static std::optional<Joints> make(const Parameters& parameters, const Problem& problem,
                                                  RigidParts* rigid, const Bonds* bonds);
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] std::string refuses_implicit_steps() const override { return "[[joint]]"; }
  [[nodiscard]] double added_frequency(const State& state, const std::vector<double>& mass) override;
  [[nodiscard]] bool needs_step_recheck(const State&) override { return system_->is_exceeded(); }
  [[nodiscard]] double first_step() const override { return system_->first_step(); }
  [[nodiscard]] std::vector<EffectPower> powers(bool after) const override;
  [[nodiscard]] std::vector<double> memory() const override { return system_->memory(); }
  void restore(const std::vector<double>& memory) override;
  // How far joints have turned and slid: whole turns are not seen in a body.
  [[nodiscard]] std::vector<double> transfer_state() const override;
  void restore_from(const std::vector<double>& travelled) override;
  // Of each joint: force and torque on its first part, about its point; angle or travel, and the couple of motors.
  [[nodiscard]] std::vector<std::string> history_columns() const override;
  [[nodiscard]] std::vector<double> history_values(const State&, const std::vector<Vec3>&) override;

 private:
  std::shared_ptr<JointSystem> system_;
  std::vector<const RigidBody*> bodies_;
};

}  // namespace flexel::simulate
