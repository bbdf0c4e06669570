// One cell of springs.
#include "simulate/models/spring_model.h"

#include <bit>

#include "simulate/models/central_spring.h"

namespace flexel::simulate {
namespace {

constexpr double kCornerShare = 0.1;  // t

Stretch stretched(const Spring& spring, const CellVectors& u) {
  Stretch now = stretch(spring.rest, u[spring.b] - u[spring.a]);
  now.elongation -= spring.flowed;
  return now;
}

}  // namespace

SpringKind spring_kind(const Lattice& lattice, const Material& material) {
  const double scale = material.young * lattice.spacing.mean();
  const std::array<double, 3> share = {(0.4 + 4 * kCornerShare / 3) / 4, (0.4 - 4 * kCornerShare / 3) / 2,
                                       kCornerShare};
  SpringKind kind;
  std::size_t next = 0;
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = a + 1; b < 8; ++b) {
      Vec3 step;
      for (std::size_t axis = 0; axis < 3; ++axis)
        step[static_cast<Eigen::Index>(axis)] =
            static_cast<double>(b >> axis & 1) - static_cast<double>(a >> axis & 1);
      const auto axes = static_cast<std::size_t>(std::popcount(a ^ b));
      kind.springs[next++] = {a, b, share[axes - 1] * scale,
                              lattice.axes * step.cwiseProduct(lattice.spacing)};
    }
  return kind;
}

double cell_energy(const SpringKind& kind, const CellVectors& u) {
  double energy = 0;
  for (const Spring& spring : kind.springs) {
    const double elongation = stretched(spring, u).elongation;
    energy += 0.5 * spring.stiffness * elongation * elongation;
  }
  return energy;
}

CellVectors cell_forces(const SpringKind& kind, const CellVectors& u) {
  CellVectors forces;
  forces.fill(Vec3::Zero());
  for (const Spring& spring : kind.springs) {
    const Stretch now = stretched(spring, u);
    const Vec3 force = spring.stiffness * now.elongation * now.direction;
    forces[spring.a] += force;
    forces[spring.b] -= force;
  }
  return forces;
}

Block spring_block(const Spring& spring, const CellVectors& u, bool project) {
  return spring_tangent(spring.stiffness, stretched(spring, u), project);
}

}  // namespace flexel::simulate
