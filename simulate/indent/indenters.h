// Indenters: rigid balls and plates that push the parts' surfaces, at equilibrium and without friction
// ([[indenter]]; docs/reference/scene.md).
//
// A surface point that is inside an indenter by the depth d is pushed out by a penalty: with e = 1 % of a cell, by the
// pressure k d^2 / (2 e) up to e, and beyond by k (d - e / 2), k = 2000 E / h. So the pressure p lets the surface in by
// h sqrt(p / (10^5 E)), under 1 % of a cell up to ten times Young's modulus; the run warns beyond. The energy is twice
// differentiable: where it was not (k d from the surface on) Newton's steps went to and fro between sets of points that
// touch. A multiplier (augmented Lagrangian) would let nothing in, and have no energy by which the steps are judged.
//
// A point of the surface does not know which side it came from: where the indenter goes further in one go than its
// rounding, it may come out on the other. So no load step leads it by more than half of that (longest_load_step()), and
// one in which the part itself goes through (gone_through()) is taken in shorter ones.
#pragma once
#include "simulate/conditions/motion.h"
#include "simulate/effects/effect.h"
#include "simulate/indent/indenter_shape.h"
#include "simulate/matter/surface_points.h"

namespace flexel::simulate {

struct Indenter {
  std::string name;
  std::string origin;  // "beam.toml:12"
  IndenterShape shape;
  IndenterPlace start;  // outside the parts
  Motion motion;        // in proportion to the load

  [[nodiscard]] IndenterPlace at(double share) const;
  // m: the way of what goes furthest, of the ball or of the edge of the plate's face.
  [[nodiscard]] double way() const;
};

// m: how far along `away` an indenter has to go from `place` until it is clear of the surface, whose points are moved by
// `displacement` (elements) m; nothing: not within the parts' size.
[[nodiscard]] std::optional<double> way_clear(const IndenterShape& shape, const IndenterPlace& place,
                                              const Vec3& away, const Problem& problem,
                                              const std::vector<Vec3>& displacement);

class Indenters : public Effect {
 public:
  struct Parameters {
    std::vector<Indenter> indenters;
  };
  static constexpr const char* name = "indenters";
  static constexpr double kPenalty = 2000;  // stiffness per area beyond that, in E / h
  static constexpr double kDeepest = 0.01;  // cells, that the surface is inside

  static void parse(TableReader& scene, Parameters& parameters);
  // Throws InputError: a timed run, a model without cells, a body that was carved, a radius under a cell, an edge that is too
  // sharp, a way that takes too many load steps, an indenter that begins inside a part.
  [[nodiscard]] static std::optional<Indenters> make(const Parameters& parameters, const Problem& problem);
  [[nodiscard]] std::string why() const override;

  [[nodiscard]] EnergyAccount account() const override { return EnergyAccount::work; }
  [[nodiscard]] bool drives() const override { return true; }
  [[nodiscard]] double energy(const State& state) override;
  void add_forces(const State& state, std::vector<Vec3>& forces) override;
  [[nodiscard]] bool adds_stiffness() const override { return true; }
  // Without the part that makes it indefinite where points are deeper than a solution has them.
  void add_stiffness(const State& state, BlockMatrix& matrix) override;
  [[nodiscard]] bool unilateral() const override { return true; }
  [[nodiscard]] std::vector<std::uint32_t> may_pull_at() const override;
  [[nodiscard]] double longest_load_step() const override;
  [[nodiscard]] std::string refuses_load_step(const State& before, const State& after) const override;
  // Cells, that the surface is inside at most, of each.
  [[nodiscard]] std::vector<double> depths(const State& state) const;
  [[nodiscard]] std::vector<IndenterPlace> places(double share) const;
  // The name of one that the surface has gone through on its straight way to `state` from another, where the indenters
  // were at these places; empty: of none.
  [[nodiscard]] std::string gone_through(const std::vector<IndenterPlace>& before,
                                         const std::vector<Vec3>& displacement, const State& state) const;
  // What touches nothing, what is deeper than kDeepest.
  [[nodiscard]] std::vector<std::string> warnings(const State& state) const override;
  void report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) override;

 private:
  struct Point {
    std::array<double, 8> weights{};
    double stiffness = 0;  // N/m
  };
  struct Patch {  // what one cell carries
    std::array<std::uint32_t, 8> elements{};
    std::uint32_t begin = 0, end = 0;  // of the points
    double spread = 1;                 // the largest sum of the absolute values of a point's weights
    double spacing = 0;                // m
  };
  void add_points(const std::vector<SurfacePoint>& points, const Problem& problem);
  [[nodiscard]] std::array<Vec3, 8> corners(const Patch& patch, const std::vector<Vec3>& displacement) const;
  // each(patch, point, gap, position) of all points that are inside, in their order.
  template <class Each>
  void for_each_inside(const Indenter& indenter, const State& state, const Each& each) const;
  template <class Each>
  void for_each_inside(const IndenterShape& shape, const IndenterPlace& place, const Patch& patch,
                       const std::array<Vec3, 8>& corners, const Each& each) const;

  const Body* body_ = nullptr;
  std::vector<Indenter> indenters_;
  std::vector<Point> points_;
  std::vector<Patch> patches_;
};

// Null where there are none.
[[nodiscard]] const Indenters* find_indenters(const std::vector<ActiveEffect>& effects);

}  // namespace flexel::simulate
