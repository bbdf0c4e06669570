// Fixes and moves: material points that are held or led.
//
// Surface selections are tied by penalty at quadrature points q of the surface: energy 1/2 k_q |u_q - d_q|^2
// on the tied axes with u_q = sum_a w_qa u_a (trilinear, elements of the cell under q; centre placement: the nearest
// element), k_q = 300 E / h times the point's area (E of the part, h the mean spacing; 10 to 300 moves a cantilever's
// tip by under one percent). The led displacement d is affine in the rest position, which trilinear weights reproduce,
// so u_q - d_q = sum_a w_qa (u_a - d(X_a)): one 8 x 8 matrix a cell holds all its points (one
// number an element that carries by itself, which is led to d(X) of its own place). Element
// selections (box, sphere, half-space, part) are followed exactly and eliminated.
//
// A rigid link ([[load]] with link = "rigid") is a tie too, to a motion that follows from its force and
// couple (simulate/conditions/rigid_link.h). Its elements on a cell face that the surface lies on are followed exactly,
// as in a timed run.
//
// In a timed run so stiff a penalty would cut the step by 17. There the elements of a cell face that the
// surface lies on are followed exactly, and where the surface cuts through cells k_q is lowered, cell by
// cell, until its frequency is that of the cells: the step is cut by at most sqrt(2).
#pragma once
#include "simulate/conditions/motion.h"
#include "simulate/effects/effect.h"
#include "simulate/input/selection.h"

namespace flexel::simulate {

// What drives a rigid link.
struct LinkLoad {
  Vec3 force = Vec3::Zero(), torque = Vec3::Zero();  // N, N m
  std::optional<Vec3> at = {};                       // m, rest: where the force acts; nothing: the middle
  bool follower = false;                             // both turn with the link
};

struct Tie {
  Selection where;
  std::array<bool, 3> axes{true, true, true};  // world axes that are held or led; the others are free
  Motion motion;                               // none for a fix
  TimeCurve course = {};                       // in timed runs; none: evenly over the whole run
  std::string name;
  std::string origin;  // "beam.toml:12"
  bool is_move = false;
  std::optional<LinkLoad> link = {};  // a rigid link: its motion is found, all axes are led
};

class Supports : public Effect {
 public:
  struct Parameters {
    std::vector<Tie> ties;
  };
  static constexpr const char* name = "ties";
  static constexpr double kPenalty = 300;  // stiffness per area, in E / h

  static void parse(TableReader& scene, Parameters& parameters);
  [[nodiscard]] static std::optional<Supports> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::work; }
  [[nodiscard]] bool drives() const override;
  [[nodiscard]] bool needs_mass() const override { return true; }
  [[nodiscard]] double added_frequency(const State&, const std::vector<double>& mass) override;
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  void constrain(Constraints& constraints) override;
  // Reactions: penalty forces, and minus the unbalanced forces on eliminated elements.
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;
  // The same in timed runs, of each row of the books.
  [[nodiscard]] std::vector<std::string> history_columns() const override;
  [[nodiscard]] std::vector<double> history_values(const State& state,
                                                   const std::vector<Vec3>& unbalanced) override;

 private:
  [[nodiscard]] std::vector<Reaction> reactions(const State& state,
                                                const std::vector<Vec3>& unbalanced) const;
  struct TiedElements {
    std::uint32_t tie = 0;
    std::uint32_t count = 0;
    std::array<std::uint32_t, 8> elements{};  // `count` of them
    // sum over points of k_q w_qa w_qb [N/m]
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8> stiffness;
  };
  using Displacements = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 8, 3>;
  [[nodiscard]] Displacements violation(const TiedElements& tied, const State& state) const;
  [[nodiscard]] double factor(const Tie& tie, const State& state) const;
  void soften(std::size_t first, const Problem& problem);
  void make_link(Tie& tie, const Selected& selected, const Problem& problem) const;
  void hold(std::uint32_t tie, const std::vector<std::uint32_t>& elements);
  void add_surface_tie(std::uint32_t tie, const std::vector<std::uint32_t>& polygons, const Problem& problem);

  const Body* body_ = nullptr;
  std::vector<Vec3> start_;  // (elements) m, displacement that ties start from; empty: 0
  std::vector<Tie> ties_;
  std::vector<TiedElements> tied_;                         // by tie, then elements
  std::vector<std::vector<std::uint32_t>> held_elements_;  // (ties) eliminated elements
  std::optional<double> added_frequency_;                  // 1/s^2, once it was asked for
};

}  // namespace flexel::simulate
