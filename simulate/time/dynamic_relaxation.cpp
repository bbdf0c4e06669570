// The scene's courses, sums over the body, and when it has come to rest.
#include "simulate/time/dynamic_relaxation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/rigid.h"
#include "simulate/probes/report.h"
#include "simulate/stepping/failure_messages.h"

namespace flexel::simulate {
namespace {

constexpr double kSettledTolerance = 1e-5;         // unless the scene says otherwise
constexpr double kRamp = 10, kMostTravels = 3000;  // times that sound takes through the body

// s, that sound takes along the body's diagonal in its slowest part.
double sound_time(const Scene& scene, const Body& body) {
  double slowest = 0;
  const auto materials = materials_of_parts(scene, body);
  for (const Material& material : materials)
    slowest = std::max(slowest, std::sqrt(material.density / material.young));
  return body_extent(body) * slowest;
}

}  // namespace

bool settles(const Scene& scene) {
  const auto& rigid = scene.get<RigidParts>();
  const auto& contact = scene.get<Contact>();
  return !scene.run.time &&
         (contact.on || !contact.planes.empty() || !rigid.parts.empty() || !rigid.manipulators.empty());
}

DynamicRelaxation::DynamicRelaxation(Scene& scene, const Body& body) {
  const double sound = sound_time(scene, body);
  extent_ = body_extent(body);
  for (const Vec3& at : body.rest) middle_ += at / static_cast<double>(body.element_count());
  ramp_ = kRamp * sound;
  const TimeCurve grows{{0, ramp_}, {0, 1}};
  for (Load& load : scene.get<Loads>().loads) load.course = grows;
  for (Tie& tie : scene.get<Supports>().ties)
    if (tie.is_move) tie.course = grows;
  double whole = 0;  // s, until the last tool is there
  for (Manipulator& each : scene.get<RigidParts>().manipulators) {
    if (each.live)
      throw InputError(each.origin, "path = \"stdin\" is for timed runs: give [run] time = \"1 s\"");
    if (!each.path.time.empty()) whole = std::max(whole, each.path.time.back());
  }
  for (Manipulator& each : scene.get<RigidParts>().manipulators)
    for (double& key : each.path.time) key *= whole > 0 ? ramp_ / whole : 1;
  // what begins inside something else is out when the rest is looked for
  if (double& parting = scene.get<Contact>().parting; parting > 0) parting = ramp_;
  scene.run.time = ramp_ + kMostTravels * sound;
  summary_.tolerance = scene.run.tolerance_given ? scene.run.tolerance : kSettledTolerance;
}

void DynamicRelaxation::before(const State& state) {
  velocity_ = state.velocity;
}

double DynamicRelaxation::after(const State& state, const std::vector<double>& mass,
                                const std::function<void(SimulateResult&)>& tell) {
  struct Sums {
    double stiffness = 0, mass = 0, kinetic = 0;
    Sums& operator+=(const Sums& other) {
      stiffness += other.stiffness;
      mass += other.mass;
      kinetic += other.kinetic;
      return *this;
    }
  };
  const bool first = force_.empty();
  force_.resize(mass.size(), Vec3::Zero());
  const Sums sums = parallel_sum<Sums>(mass.size(), [&](std::size_t e) {
    const Vec3 force = mass[e] / state.kick * (state.velocity[e] - velocity_[e]);
    const Vec3 change = force - force_[e];
    force_[e] = force;
    return Sums{-velocity_[e].dot(change), mass[e] * velocity_[e].squaredNorm(),
                0.5 * mass[e] * state.velocity[e].squaredNorm()};
  });
  ++summary_.steps;
  kinetic_ = sums.kinetic;
  largest_ = std::max(largest_, kinetic_);
  if (*state.time > ramp_ && summary_.steps % kLook == 0) look(state, tell);
  if (first || !(sums.stiffness > 0)) return 1;
  const double turned = std::sqrt(sums.stiffness * state.kick / sums.mass);  // omega dt
  return std::exp(-2 * std::min(turned, 1.0));
}

// A couple has no force: it counts by its moment over the body's extent. About the body's middle that of a force is less than
// the force.
void DynamicRelaxation::look(const State& state, const std::function<void(SimulateResult&)>& tell) {
  SimulateResult told;
  tell(told);
  Vec3 middle = middle_;
  for (const Vec3& moved : state.displacement)
    middle += moved / static_cast<double>(state.displacement.size());
  const auto moment = [&](const AppliedLoad& load) -> Vec3 { return load.moment - middle.cross(load.force); };
  double scale = 0;
  for (const AppliedLoad& load : told.loads)
    scale += std::max(load.force.norm(), moment(load).norm() / extent_);
  for (const Reaction& reaction : told.reactions) scale += reaction.force.norm();
  const double left = parallel_sum<double>(force_.size(), [&](std::size_t e) { return force_[e].norm(); });
  summary_.residual = scale > 0 ? left / scale : left > 0 ? HUGE_VAL : 0;
  summary_.kinetic = kinetic_;
  done_ = summary_.residual <= summary_.tolerance && kinetic_ <= summary_.tolerance * largest_;
}

void DynamicRelaxation::report(SimulateResult& result) const {
  result.settled = summary_;
  result.timed.reset();
  sum_up_imbalance(result);
}

std::string DynamicRelaxation::failure(const Body& body, const State& state) const {
  return fmt::format(
      "the body does not come to rest: after {} steps the forces left over are {:.2g} of loads and reactions "
      "(tolerance {:.2g}), the kinetic energy {:.3g} J, fastest near {}; look for a part that nothing stops, "
      "or "
      "give [run] a "
      "larger tolerance",
      summary_.steps, summary_.residual, summary_.tolerance, summary_.kinetic, fastest_near(body, state));
}

}  // namespace flexel::simulate
