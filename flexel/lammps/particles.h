// A timed run of Flexel in LAMMPS's terms: atoms, bonds, steady forces with a course in time, groups that are
// held or led, steps of one length. No file format. Only what means the same in both is here; the rest is
// refused.
//
// Flexel's steps are velocity Verlet's: v(n + 1/2) = v(n - 1/2) + dt f(x(n), v(n - 1/2)) / m, x(n + 1) = x(n)
// + dt v(n + 1/2). They differ in the first kick alone, which is of half a step in LAMMPS and with method =
// "verlet", of a whole one with "symplectic".
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "flexel/lammps/springs.h"
#include "simulate/conditions/constraints.h"
#include "simulate/scene/scene.h"

namespace flexel::lammps {

// What acts on elements with one course in time.
struct SteadyForce {
  simulate::TimeCurve course;  // none: 1 all along
  std::vector<Vec3> force;     // (elements) N
};

// Elements whose axes are held, or led by the same motions.
struct SupportGroup {
  std::uint8_t mask = 0;                  // bit i: axis i is
  std::array<std::uint32_t, 3> motion{};  // index into Particles::motions of each of them
};

struct Particles {
  std::vector<Vec3> position;       // (elements) m
  std::vector<Vec3> velocity;       // (elements) m/s
  std::vector<double> mass;         // (elements) kg
  std::vector<std::uint32_t> part;  // (elements)
  std::vector<Spring> springs;
  Vec3 gravity = Vec3::Zero();  // m/s^2
  std::vector<SteadyForce> forces;
  std::vector<simulate::Motion> motions;
  std::vector<simulate::TimeCurve> courses;  // (motions)
  std::vector<Vec3> led_from;                // (elements) m, what the motions turn; empty: nothing is led
  std::vector<SupportGroup> supports;
  std::vector<std::uint32_t> support;  // (elements) 1 + index into supports; 0: free
  double step = 0;                     // s
  std::uint64_t steps = 0, frames = 0;
  bool half_kick = false;  // method = "verlet"
  bool step_given = false;
  double longest = 0;  // m, of the springs as they are

  [[nodiscard]] bool damped() const;
  [[nodiscard]] bool leads(const SupportGroup& group) const;  // or holds only
};

// Where axis `axis` of an element goes that `motion` leads: `arm` and `back`, with which it is displaced by
// f translation + sin(f angle) arm + (1 - cos(f angle)) back when the factor of its course is f.
struct Turn {
  double arm = 0, back = 0;  // m
};
[[nodiscard]] Turn turn_of(const simulate::Motion& motion, const Vec3& from, std::size_t axis);

// `body` is the run's at its start: it gets the names of its materials. Throws InputError: the scene has no
// time, or something that LAMMPS does not have, named.
[[nodiscard]] Particles particles_of(Body& body, const simulate::Scene& scene, Progress& progress);

}  // namespace flexel::lammps
