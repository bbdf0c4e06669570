// fuse: matter that touches becomes one. Parts are held together point by point where they are nearer than a
// distance; broken cells that are nearly whole again resist again. docs/reference/events.md
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/events/event.h"

namespace flexel::simulate {

class Fuse {
 public:
  static constexpr const char* name = "fuse";
  [[nodiscard]] static Fuse parse(TableReader& reader);
  // Throws InputError: nothing in the region is near enough to anything.
  [[nodiscard]] std::string apply(EventContext& context) const;

 private:
  EventRegion region_;
  double within_ = 0;  // m
  std::string origin_;
};

// The points that were fused so far, as an effect. With the present positions x and weights w of a point, and its
// length l at the moment of fusing, the energy is 1/2 k (|sum_i w_i x_i| - l)^2: no force at that moment, none by any
// rigid motion of all, and neither momentum nor angular momentum, for the weights sum to 0. Between elements of model
// `paper` that is a connection (Jansson and Vergeest, section 3.2).
class FusedPoints : public Effect {
 public:
  static constexpr const char* name = "fused";

  FusedPoints(const Body& body, std::vector<FusedPoint> points) : body_(&body), points_(std::move(points)) {}
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::potential; }
  [[nodiscard]] bool needs_mass() const override { return true; }
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] std::vector<CoupledElements> couples() const override;
  [[nodiscard]] double added_frequency(const State&, const std::vector<double>& mass) override;

 private:
  [[nodiscard]] Vec3 gap(const FusedPoint& point, const State& state) const;

  const Body* body_;
  std::vector<FusedPoint> points_;
  std::optional<double> added_frequency_;  // 1/s^2, once it was asked for
};

}  // namespace flexel::simulate
