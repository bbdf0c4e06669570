// Solves a system of model `quadratic`, and measures the answer.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "simulate/quadratic/quadratic_system.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

// A stiffness and its preconditioner, which keeps a reference to it.
struct QuadraticTangent {
  explicit QuadraticTangent(QuadraticOperator of) : stiffness(std::move(of)) {}

  QuadraticOperator stiffness;
  std::optional<QuadraticMultigrid> multigrid = std::nullopt;
};

struct QuadraticSolution {
  std::vector<Vec3> displacement;  // (nodes x 3) m
  std::vector<Vec3> unbalanced;  // (nodes x 3) N: on prescribed components what holds them, else the residual
  std::vector<Mat3> turn;        // (cells) R - 1 where large deflections turned them; none: a linear solution
  std::vector<Vec3> load_turn;  // (loads) rad, that those that follow have turned by; none: a linear solution
  // As far as was looked: where loads are far too small to buckle it nobody does. Nothing: it was not found out.
  std::optional<bool> stable = true;
  double amplification = 1;  // the largest displacement beside that of the linear solution
  double safety = 1;         // of the supports' penalty (QuadraticSystem::stiffness)
  int load_steps = 0, newton_iterations = 0;
  int iterations = 0;  // of conjugate gradients, in all
  double relative_residual = 0;
  std::unique_ptr<QuadraticTangent> tangent = nullptr;  // that it was found with
};

constexpr double kMoreSafety = 4;

// The linear solution, by conjugate gradients, with a residual of at most `tolerance` beside what loads and moves ask for.
// Supports whose penalty is too weak for a sliver show as an indefinite stiffness: from `safety` on it is raised by kMoreSafety,
// at most three times in a call. Throws DivergedError; InputError(scene, ...) naming a rigid motion that is free.
// `progress` is told each iteration and its relative residual.
[[nodiscard]] QuadraticSolution solve(const QuadraticSystem& system, double tolerance, double safety,
                                      const std::string& scene,
                                      const std::function<void(int, double)>& progress);
// Goes on from a linear solution to another tolerance; false where the stiffness shows as indefinite.
[[nodiscard]] bool correct(const QuadraticSystem& system, double tolerance, QuadraticSolution& solution,
                           const std::function<void(int, double)>& progress);

// The gradient (world frame) of a displacement (nodes x 3) in a cell at cell coordinates.
[[nodiscard]] Mat3 gradient_at(const QuadraticSystem& system, const std::vector<Vec3>& displacement,
                               std::size_t cell, const Vec3& at);
// R - 1 of a cell.
[[nodiscard]] const Mat3& turn_of_cell(const QuadraticSolution& solution, std::size_t cell);
// R^T F - 1: the displacement gradient in a cell at cell coordinates, without the cell's rotation.
[[nodiscard]] Mat3 local_gradient(const QuadraticSystem& system, const QuadraticSolution& solution,
                                  std::size_t cell, const Vec3& at);
// The same without the free strain: what stress is proportional to.
[[nodiscard]] Mat3 elastic_gradient(const QuadraticSystem& system, const QuadraticSolution& solution,
                                    std::size_t cell, const Vec3& at);
// The rotation vector of a small displacement gradient.
[[nodiscard]] Vec3 spin_of(const Mat3& gradient);

// (elements x 3) m, 0 where no cell resists.
[[nodiscard]] std::vector<Vec3> element_displacement(const QuadraticSystem& system,
                                                     const QuadraticSolution& solution);

// The column that travels in the body (formats/lattice/quadratic_field.h). In cells that resist nothing (loose crumbs,
// broken ones) the field is trilinear between the elements of `state`, which are carried along.
void write_field(const QuadraticNodes& nodes, const QuadraticSolution& solution, const State& state,
                 Body& body);

// Reactions, loads, elastic energy, smallest J (middle of cells) into `result`.
void report(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result);

// The share of the elastic energy that is in what is no matter (QuadraticSystem::outside()).
[[nodiscard]] double energy_outside(const QuadraticSystem& system, const QuadraticSolution& solution,
                                    double elastic_energy);

// The strain (largest principal value, without the rotation) where the energy is: its mean, weighted by energy.
[[nodiscard]] double typical_strain(const QuadraticSystem& system, const QuadraticSolution& solution);

// The root of the mean square of the strain, from the elastic energy: a lower bound, for lambda + 2 mu is taken as stiffness.
[[nodiscard]] double mean_strain(const QuadraticSystem& system, const QuadraticSolution& solution);

}  // namespace flexel::simulate
