// What a body is to its natural vibrations: stiffness and inertia over its unknowns, whatever the model.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "simulate/matter/fragments.h"
#include "simulate/modes/eigenpairs.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

struct VibratingNodes {
  std::vector<Vec3> place;           // (nodes) m, about which they move
  std::vector<std::uint8_t> held;    // (nodes) bit i: component i does not move
  std::vector<std::uint32_t> group;  // (nodes) those that hang together have the same number
  std::size_t rigid = 0;             // motions that nothing resists
  [[nodiscard]] std::size_t freedoms() const;
};

class VibratingBody {
 public:
  VibratingBody() = default;
  VibratingBody(const VibratingBody&) = delete;
  VibratingBody& operator=(const VibratingBody&) = delete;
  virtual ~VibratingBody() = default;

  [[nodiscard]] virtual const VibratingNodes& nodes() const = 0;
  // Stiffness [N/m] and inertia [kg], or what stresses add to the stiffness and the stiffness, of (nodes x 3), 0 in components
  // that are held. Lives as long as this does.
  [[nodiscard]] virtual Pencil pencil() const = 0;
  // y = M x, kg m: of components that are held too.
  virtual void inertia(const double* x, double* y) const = 0;
  // Moves the body to where it is held, and by `shape` (nodes x 3) [m] from there; where its elements are then.
  [[nodiscard]] virtual State show(const Eigen::VectorXd& shape, Body& body) const = 0;
  // True where the stiffness may not be positive because supports are held too softly: they are held harder from now on.
  [[nodiscard]] virtual bool hold_harder() { return false; }
  // The scene's loads act.
  [[nodiscard]] virtual bool prestressed() const = 0;
};

// Moves the elements of `body` by `state`, stray ones as what is nearest to them moved (carry_strays()).
void show_elements(const Fragments& fragments, const Problem& problem, const Stencil& stencil, State& state,
                   Body& body);

// (1/s)^2: about the largest eigenvalue that a lattice of these parts has.
[[nodiscard]] double largest_eigenvalue(const Problem& problem);

// Of that largest eigenvalue: what free rigid motions are held with in a preconditioner; what rounding leaves.
constexpr double kSoftHold = 1e-9, kRoundedEigenvalue = 1e-14;

}  // namespace flexel::simulate
