// Ambient drag: a medium at rest of density rho resists what moves through it.
//
// Corner-placed parts, on the exposed surface: every piece of it that moves outward feels the pressure
//     p = 1/2 rho C v_n^2, v_n = v . n > 0                 (C the coefficient; Newton's sine-squared law)
// with v and n of the surface as it is now: n dA = cof(F) N dA, F the mean deformation gradient of the cell
// under it (Nanson). Pieces that move inward or along feel none; where parts touch nothing is exposed. A flat
// front of area A that moves squarely feels 1/2 rho C A v^2, at any resolution; a ball of radius R half of
// what its shadow pi R^2 would.
//
// Parts of model `paper`, as printed (Jansson and Vergeest, equations 5 and 12), on every element, inner ones
// too:
//     F = -pi r^2 rho |v| v, r half the spacing            (no coefficient: as printed it is that of C = 2)
//
// In one step drag takes at most a fifth of the velocity away: a light body in a dense medium is slowed, not
// thrown back, and the bound on the step stays what it is. For a surface piece: its impulse is at most 0.2
// v_n of the mass that its share of the elements' surface carries, with which the sum over all pieces is at
// most 0.2 m v of every element. Implicit steps take the drag whole, at the velocity that they end with:
// minus the derivative of 1/6 rho C A v_n^3, and of 1/3 pi r^2 rho |v|^3.
#pragma once
#include "simulate/effects/effect.h"
#include "simulate/models/cell_model.h"

namespace flexel::simulate {

class Drag : public Effect {
 public:
  struct Parameters {
    std::optional<double> density;  // kg/m^3, of the medium
    double coefficient = 1;         // C
  };
  static constexpr const char* name = "drag";

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Drag> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;
  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::dissipation; }
  [[nodiscard]] bool resists() const override { return true; }
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] double resistance(const State& state) override;
  void add_resistance(const State& state, double scale, BlockMatrix& matrix) override;

 private:
  // The surface of one polygon in one cell.
  struct Face {
    std::array<std::uint32_t, 8> elements{};
    std::array<double, 8> weights{};
    Vec3 area = Vec3::Zero();  // m^2, at rest, outward
    double exposed = 1;        // share of it
    double surface_mass = 0;   // kg/m^2, the least of its elements': mass over surface
    std::uint32_t part = 0;
  };
  struct Ball {  // an element of model paper
    std::uint32_t element = 0;
    double area = 0, mass = 0;  // m^2, kg
  };
  [[nodiscard]] static std::vector<Face> faces(const Problem& problem);
  static void uncover(const Problem& problem, std::vector<Face>& faces);
  static void weigh(const std::vector<double>& mass, std::vector<Face>& faces);
  // Of one piece of surface as it is now.
  struct Front {
    Vec3 area = Vec3::Zero();  // m^2, outward
    double outward = 0;        // m/s, along it; 0: nothing is felt
  };
  [[nodiscard]] Front front(const Face& face, const State& state) const;
  [[nodiscard]] Vec3 force(const Face& face, const State& state) const;

  double density_ = 0, coefficient_ = 1;
  std::vector<CellKind> kinds_;  // (parts)
  std::vector<Face> faces_;
  std::vector<Ball> balls_;
};

}  // namespace flexel::simulate
