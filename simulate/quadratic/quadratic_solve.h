// Solves a system of model `quadratic`, and measures the answer.
#pragma once
#include <functional>

#include "simulate/matter/stress.h"
#include "simulate/quadratic/quadratic_system.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

struct QuadraticSolution {
  std::vector<Vec3> displacement;  // (nodes x 3) m
  std::vector<Vec3> unbalanced;  // (nodes x 3) N: on prescribed components what holds them, else the residual
  double safety = 1;             // of the supports' penalty (QuadraticSystem::stiffness)
  int iterations = 0;
  double relative_residual = 0;
};

// By conjugate gradients. Supports whose penalty is too weak for a sliver show as an indefinite stiffness: it is
// raised fourfold, three times at most. Throws DivergedError; InputError(scene, ...) naming a rigid motion that is free.
// `progress` is told each iteration and its relative residual.
[[nodiscard]] QuadraticSolution solve(const QuadraticSystem& system, const RunSettings& settings,
                                      const std::string& scene,
                                      const std::function<void(int, double)>& progress);

// The displacement gradient (world frame) of a cell at cell coordinates.
[[nodiscard]] Mat3 gradient_at(const QuadraticSystem& system, const QuadraticSolution& solution,
                               std::size_t cell, const Vec3& at);

// The column that travels in the body (formats/lattice/quadratic_field.h), and the displacement of the elements.
void write_field(const QuadraticSystem& system, const QuadraticSolution& solution, Body& body, State& state);

// In cells that resist nothing (loose crumbs, broken ones), once their elements are carried along: trilinear.
void carry_field(const QuadraticNodes& nodes, const State& state, Body& body);

// Stresses as `stresses()` defines them, from the field itself: of a cell in the middle of its matter; of an element
// there, or at the nearest point of the surface, the mean over the cells that hold the point.
[[nodiscard]] Stresses field_stresses(const QuadraticSystem& system, const QuadraticSolution& solution,
                                      const State& state);

// Reactions, loads, elastic energy, smallest J (middle of cells) into `result`.
void report(const QuadraticSystem& system, const QuadraticSolution& solution, SimulateResult& result);

// rad: how far the matter turns, at most (middle of cells).
[[nodiscard]] double largest_rotation(const QuadraticSystem& system, const QuadraticSolution& solution);

}  // namespace flexel::simulate
