// [[velocity]]: what a selection moves with when a timed run begins. Costs nothing afterwards.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/input/selection.h"

namespace flexel::simulate {

struct StartingVelocity {
  Selection where;
  Vec3 velocity = Vec3::Zero();  // m/s
  Vec3 spin = Vec3::Zero();      // rad/s about `through`, right-handed
  Vec3 through = Vec3::Zero();   // m
  std::string origin;
};

class InitialVelocity : public Effect {
 public:
  struct Parameters {
    std::vector<StartingVelocity> velocities;  // added where they overlap
  };
  static constexpr const char* name = "initial velocity";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<InitialVelocity> make(const Parameters& parameters,
                                                           const Problem& problem);
  [[nodiscard]] std::string why() const override;
  void add_initial_state(State& state) override;

 private:
  std::vector<Vec3> velocity_;  // (elements) m/s
  std::size_t count_ = 0;
};

}  // namespace flexel::simulate
