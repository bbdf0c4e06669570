// What was fused so far, as effects. With the present positions x and weights w of a point, and its length l at the moment
// of fusing, the energy is 1/2 k (|sum_i w_i x_i| - l)^2: no force at that moment, none by any rigid motion of all, and
// neither momentum nor angular momentum, for the weights sum to 0.
//
// Between two elements of model `paper` that is a connection (Jansson and Vergeest, section 3.2), with the means of what
// its two elements have in the scene and in the body's columns: damping b = tau k (equations 3 and 18), sliding friction mu
// (equation 20), and the length t = l (1 + elongation) past which it ends (section 4.2).
#pragma once
#include "formats/lattice/fused_points.h"
#include "simulate/effects/effect.h"
#include "simulate/paper/connection_yield.h"

namespace flexel::simulate {

// Shared by the two effects.
struct FusedConnections {
  std::vector<FusedPoint> points;
  // (points) Empty: none have it. Of points with a length only.
  std::vector<double> damping;       // s, tau
  std::vector<double> friction;      // mu
  std::vector<double> elongation;    // at which they end; infinity: never
  std::vector<std::uint8_t> broken;  // 1: it pulls no more
  [[nodiscard]] bool is_broken(std::size_t point) const { return !broken.empty() && broken[point] != 0; }
};

// Fills in what the connections among `points` have by `plan` and `friction` (parts; or empty).
[[nodiscard]] FusedConnections fused_connections(const Body& body, std::vector<FusedPoint> points,
                                                 const KernelEffects& plan,
                                                 const std::vector<double>& friction);

class FusedPoints : public Effect {
 public:
  static constexpr const char* name = "fused";

  FusedPoints(const Body& body, std::vector<FusedPoint> points);
  FusedPoints(const Body& body, std::shared_ptr<FusedConnections> fused)
      : body_(&body), fused_(std::move(fused)) {}
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::potential; }
  [[nodiscard]] bool needs_mass() const override { return true; }
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] std::vector<CoupledElements> couples() const override;
  [[nodiscard]] double added_frequency(const State&, const std::vector<double>& mass) override;
  [[nodiscard]] std::vector<double> memory() const override;
  void restore(const std::vector<double>& memory) override;

  // Breaks what passes its limit in `state`, whose forces act on velocities for state.kick from half a step before.
  ConnectionLosses tear(const State& state);
  // Those that are whole.
  [[nodiscard]] std::vector<FusedPoint> left() const;

 private:
  const Body* body_;
  std::shared_ptr<FusedConnections> fused_;
  std::optional<double> added_frequency_;  // 1/s^2, once it was asked for
};

// Damping and friction of the connections among them. In explicit steps either takes at most what would end the motion of
// the two elements if all of their fused connections took as much, as in simulate/paper/connection_friction.h.
class FusedLosses : public Effect {
 public:
  static constexpr const char* name = "fused damping";

  // Nothing where no connection has either. `mass` (elements) [kg].
  [[nodiscard]] static std::optional<FusedLosses> make(const Body& body,
                                                       std::shared_ptr<FusedConnections> fused,
                                                       const std::vector<double>& mass);
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::dissipation; }
  [[nodiscard]] bool resists() const override { return true; }
  [[nodiscard]] double resistance(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  void add_resistance(const State& state, double scale, BlockMatrix& matrix) override;
  [[nodiscard]] std::vector<CoupledElements> couples() const override;

 private:
  struct Passing;  // of two elements
  [[nodiscard]] Passing passing(std::size_t point, const State& state) const;

  const Body* body_ = nullptr;
  std::shared_ptr<FusedConnections> fused_;
  std::vector<double> most_;  // (points) kg, the mass that a step may stop
};

}  // namespace flexel::simulate
