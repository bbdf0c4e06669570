// Sums over the elements of a part in their order, on one thread: changes are few.
#include "simulate/time/carried_motion.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/math/small_matrices.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/matter/masses.h"

namespace flexel::simulate {
namespace {

constexpr double kKineticRounding = 1e-12;  // of all kinetic energy: less than that is rounding

PartMomenta momenta_of(const Body& body, const Part& part, const State& state,
                       const std::vector<double>& mass) {
  PartMomenta sum;
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
    const Vec3 momentum = mass[e] * state.velocity[e];
    sum.linear += momentum;
    sum.angular += (body.rest[e] + state.displacement[e]).cross(momentum);
  }
  return sum;
}

// J: of a rigid body with the inertia and the angular momentum that the part has about its centre of mass.
double spin_energy(const Body& body, const Part& part, const State& state, const std::vector<double>& mass) {
  double sum = 0;
  Vec3 centre = Vec3::Zero();
  const auto place = [&](std::uint32_t e) -> Vec3 { return body.rest[e] + state.displacement[e]; };
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
    sum += mass[e];
    centre += mass[e] * place(e);
  }
  if (!(sum > 0)) return 0;
  centre /= sum;
  Mat3 inertia = Mat3::Zero();
  Vec3 angular = Vec3::Zero();
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
    const Mat3 arm = cross_matrix(place(e) - centre);
    inertia -= mass[e] * arm * arm;
    angular += mass[e] * arm * state.velocity[e];
  }
  return 0.5 * angular.dot(Vec3(solve_least_norm(inertia, angular)));
}

// Rigid motions of what is held nowhere.
class FreeMotions {
 public:
  FreeMotions(const Body& body, const Part& part, const std::vector<std::uint8_t>& held, const State& state)
      : body_(body), part_(part), held_(held), state_(state) {
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      centre_ += place(e) / (part.element_end - part.element_begin);
  }

  // Velocity of an element (rows) of those of the part and its spin about its middle (columns).
  [[nodiscard]] Eigen::Matrix<double, 3, 6> of(std::uint32_t e) const {
    Eigen::Matrix<double, 3, 6> rows;
    rows << Mat3::Identity(), -cross_matrix(place(e) - centre_);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (!held_.empty() && held_[e] >> axis & 1) rows.row(axis).setZero();
    return rows;
  }
  // Of all with those momenta the least.
  [[nodiscard]] Eigen::VectorXd with(const PartMomenta& momenta, const std::vector<double>& mass) const {
    Eigen::MatrixXd inertia = Eigen::MatrixXd::Zero(6, 6);
    for (std::uint32_t e = part_.element_begin; e < part_.element_end; ++e) {
      const Eigen::Matrix<double, 3, 6> rows = of(e);
      inertia += mass[e] * rows.transpose() * rows;
    }
    // Spins in units that make them as large as velocities.
    const double reach = std::sqrt(inertia.diagonal().tail<3>().sum() / inertia.diagonal().head<3>().sum());
    if (!std::isfinite(reach) || !(reach > 0)) return Eigen::VectorXd::Zero(6);
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(6), right(6);
    scale.tail<3>().setConstant(1 / reach);
    right << momenta.linear, momenta.angular - centre_.cross(momenta.linear);
    const Eigen::MatrixXd scaled = scale.asDiagonal() * inertia * scale.asDiagonal();
    return scale.cwiseProduct(solve_least_norm(scaled, scale.cwiseProduct(right)));
  }

 private:
  [[nodiscard]] Vec3 place(std::uint32_t e) const { return body_.rest[e] + state_.displacement[e]; }

  const Body& body_;
  const Part& part_;
  const std::vector<std::uint8_t>& held_;
  const State& state_;
  Vec3 centre_ = Vec3::Zero();
};

}  // namespace

CarriedMotion::CarriedMotion(const Problem& problem, const State& state, double stored) {
  const std::vector<double> mass = lumped_masses(problem);
  for (const Part& part : problem.body.parts) {
    momenta_.push_back(momenta_of(problem.body, part, state, mass));
    spin_.push_back(spin_energy(problem.body, part, state, mass));
  }
  const auto [internal, kinetic] = internal_and_kinetic(problem, state);
  internal_ = internal + stored;
  kinetic_ = kinetic;
}

void CarriedMotion::give_back(const Problem& problem, const std::vector<std::uint8_t>& held,
                              State& state) const {
  const Body& body = problem.body;
  const std::vector<double> mass = lumped_masses(problem);
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    const FreeMotions motions(body, part, held, state);
    const PartMomenta now = momenta_of(body, part, state, mass);
    const Eigen::VectorXd lacking =
        motions.with({momenta_[p].linear - now.linear, momenta_[p].angular - now.angular}, mass);
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      state.velocity[e] += motions.of(e) * lacking;
  }
}

// Angular momentum stays, so the energy of a spin goes by the inverse of the moment of inertia, as its speed does.
void CarriedMotion::warn_of_spin(const Problem& problem, const State& state,
                                 const std::vector<std::uint8_t>& held_parts, const std::string& origin,
                                 Progress& progress) const {
  constexpr double kNoticeable = 1e-3;  // of the energy
  const std::vector<double> mass = lumped_masses(problem);
  for (std::size_t p = 0; p < spin_.size(); ++p) {
    if (held_parts[p] != 0 || !(spin_[p] > kNoticeable * (internal_ + kinetic_))) continue;
    const Part& part = problem.body.parts[p];
    const double change = spin_energy(problem.body, part, state, mass) / spin_[p] - 1;
    if (!(std::abs(change) > kLargestEnergyChange)) continue;
    progress.warn(
        fmt::format("{}: part \"{}\" spins {:.2g} % {} on its new lattice, on which it has another moment of "
                    "inertia; its angular "
                    "momentum stays: smaller cells change less, or leave its lattice as it is",
                    origin, part.name, 100 * std::abs(change), change < 0 ? "slower" : "faster"));
  }
}

std::string CarriedMotion::change_of_energy(const Problem& problem, const State& state, double stored,
                                            double borne, const std::string& origin,
                                            Progress& progress) const {
  const double now = internal_and_kinetic(problem, state)[0] + stored;
  if (!std::isfinite(now))
    throw DivergedError(
        fmt::format("{}: on the new lattice a cell is folded: change the resolution where the "
                    "body is deformed less",
                    origin));
  if (!(internal_ > kKineticRounding * kinetic_)) return "";
  const double change = now / internal_ - 1;
  if (std::abs(change) > borne)
    progress.warn(
        fmt::format("{}: the energy of the body changed by {:+.2g} % with its lattice: what it does "
                    "takes smaller cells",
                    origin, 100 * change));
  return fmt::format("{:.4g} J of the body became {:.4g} J ({:+.2g} %)", internal_, now, 100 * change);
}

}  // namespace flexel::simulate
