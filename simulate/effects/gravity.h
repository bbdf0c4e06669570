// Uniform gravity: every cell's matter, f rho V, is drawn the same way; an eighth of it acts on each of the
// cell's elements; at centre placement an element has the matter of its voxel. The field of the paper's
// equation (1) with one distant source (Jansson and Vergeest, section 3.2).
#pragma once
#include "simulate/effects/effect.h"

namespace flexel {

class Gravity {
 public:
  struct Parameters {
    std::optional<Vec3> acceleration;  // m/s^2, world frame
  };
  static constexpr const char* name = "gravity";
  static constexpr Book book = Book::potential;

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Gravity> make(const Parameters& parameters, const Setting& setting);
  [[nodiscard]] std::string why() const;

  [[nodiscard]] bool constant() const { return true; }
  [[nodiscard]] double energy(const State& state) const;
  void add_forces(const State& state, std::vector<Vec3>& forces) const;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) const;

 private:
  Vec3 acceleration_ = Vec3::Zero();
  std::vector<double> mass_;  // (elements) kg, of the matter that resists
};

}  // namespace flexel
