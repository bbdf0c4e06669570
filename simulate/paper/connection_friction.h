// Sliding friction within a part of model `paper` (Jansson and Vergeest, equations 4, 16, 17, 19 and 20): along every
// connection c of an element e with its opposite p
//     F_N = F_b + F_d,   F_f = -|mu_c F_N| v' / |v'|,   v' = v - (v . n) n,   v = v_e - v_p
// with n the direction of the connection, F_b its elastic force, F_d its damping, and mu_c the scene's coefficient
// times the factor that the body's columns give it (connection_factors(); section 3.2).
//
// As printed: the force is not central, so momentum is kept and angular momentum is not, and a body that turns while
// it is strained is braked ("While this behavior does not violate the model, it may not be what is expected"). Added is
// rest: a step takes at most what would end the sliding of a connection if all connections of its elements took as much,
//     |F_f| <= m_e m_p / (m_e + m_p) |v'| / (kick n_c),   n_c the larger number of connections of e and p.
#pragma once
#include "simulate/effects/effect.h"

namespace flexel::simulate {

class ConnectionFriction : public Effect {
 public:
  struct Entry {
    double coefficient = 0;           // mu
    std::optional<std::string> part;  // nothing: every part
    std::string origin;
  };
  struct Parameters {
    std::vector<Entry> entries;  // which goes before which: entries_of_parts()
  };
  static constexpr const char* name = "internal friction";

  static void parse(TableReader& scene, Parameters& parameters);
  // (parts) mu; 0 in parts of other models. Throws InputError as make() does.
  [[nodiscard]] static std::vector<double> coefficients(const Parameters& parameters, const Problem& problem);
  // Throws InputError: an unknown part, a part of another model, no part of model `paper`.
  [[nodiscard]] static std::optional<ConnectionFriction> make(const Parameters& parameters,
                                                              const Problem& problem);
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::dissipation; }
  [[nodiscard]] std::string refuses_implicit_steps() const override {
    return "[internal_friction] of model \"paper\"";
  }
  void attach(const PaperModel& model, const std::vector<double>& damping) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;

 private:
  std::size_t entries_ = 0;
  std::vector<double> coefficient_;  // (parts)
  std::vector<double> mass_;         // (elements) kg
  std::vector<double> friction_;     // (entries of the model's rows) factors; empty: 1
  std::vector<double> tau_;          // (parts) s
  const Body* body_ = nullptr;
  const PaperModel* model_ = nullptr;
};

}  // namespace flexel::simulate
