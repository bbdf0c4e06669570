// The start of the run is made by the run's own code (simulate/time/time_segment.h), so that masses,
// velocities, the step and what is held are its own.
#include "flexel/lammps/particles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/units.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/supports.h"
#include "simulate/models/rest_shape.h"
#include "simulate/scene/scene_checks.h"
#include "simulate/time/time_segment.h"

namespace flexel::lammps {
namespace {

constexpr std::uint64_t kFrames = 50;      // as of a .pvd series
constexpr std::size_t kMostSupports = 24;  // LAMMPS has 32 groups

// What of a scene has no counterpart, before anything is made of it.
void refuse_run(const simulate::Scene& scene) {
  const simulate::RunSettings& run = scene.run;
  if (!run.time)
    throw InputError(
        scene.name,
        "only timed runs are exported to LAMMPS: give [run] time = \"10 ms\"; equilibrium goes to "
        "CalculiX (--calculix)");
  if (run.method == simulate::TimeMethod::implicit_euler ||
      run.method == simulate::TimeMethod::explicit_euler)
    throw InputError(
        scene.name,
        fmt::format("[run] method = \"{}\" has no counterpart in LAMMPS, whose steps are velocity "
                    "Verlet's: \"verlet\" and \"symplectic\" are exported",
                    run.method == simulate::TimeMethod::implicit_euler ? "implicit" : "explicit"));
  if (run.renormalise)
    throw InputError(scene.name, "[run] renormalise has no counterpart in LAMMPS: leave it out");
  if (!scene.events.empty())
    throw InputError(
        scene.events.front().origin,
        fmt::format("[[event]] {} has no counterpart in LAMMPS: leave it out", scene.events.front().name));
}

void refuse_models(const simulate::Scene& scene, const Body& body) {
  const std::vector<simulate::Model> models = models_of_parts(scene, body);
  for (std::size_t p = 0; p < models.size(); ++p)
    if (models[p] == simulate::Model::cells || models[p] == simulate::Model::quadratic)
      throw InputError(
          scene.name,
          fmt::format(
              "part \"{}\": model \"{}\" has no counterpart in LAMMPS, whose bonds are springs: models "
              "\"springs\" and \"paper\" are exported (--model springs)",
              body.parts[p].name, models[p] == simulate::Model::cells ? "cells" : "quadratic"));
}

// Throws InputError where an effect is none of those that are taken.
void refuse_effects(const simulate::TimeSegment& segment, const simulate::Scene& scene) {
  const auto refuse = [&](const simulate::ActiveEffect& effect, const std::string& why) {
    throw InputError(scene.name,
                     fmt::format("{} ({}) has no counterpart in LAMMPS{}", effect.name, effect.why, why));
  };
  for (const simulate::ActiveEffect& each : segment.effects()) {
    const simulate::Effect& effect = each.untimed();
    if (dynamic_cast<const simulate::InitialVelocity*>(&effect) ||
        dynamic_cast<const simulate::Damping*>(&effect))
      continue;
    if (dynamic_cast<const simulate::Gravity*>(&effect)) {
      if (effect.needs_time()) refuse(each, ": acceleration alone is exported; leave source and mutual out");
    } else if (dynamic_cast<const simulate::Loads*>(&effect)) {
      if (effect.follows()) refuse(each, ": loads are exported as they are at rest; leave follower out");
    } else if (dynamic_cast<const simulate::Supports*>(&effect)) {
      if (each->added_frequency(segment.state(), segment.stepper().mass()) > 0)
        refuse(each,
               " where a surface cuts through cells, whose elements are tied by weights: select elements (a "
               "box, "
               "sphere or half-space), or a size whose cells end at the surface");
    } else if (dynamic_cast<const simulate::Bonds*>(&effect)) {
      refuse(each,
             ", which has no springs between more than two elements: put bond = false, or export one part");
    } else {
      refuse(each, ": leave it out");
    }
  }
}

std::vector<double> damping_times(const simulate::TimeSegment& segment, const Body& body,
                                  const simulate::Scene& scene) {
  simulate::KernelEffects plan;
  plan.damping.assign(body.parts.size(), 0);
  for (const simulate::ActiveEffect& effect : segment.effects()) effect->configure_kernel(plan);
  if (segment.damps() && !segment.kicks())
    throw InputError(scene.name,
                     "[damping] is so long here that Flexel takes it in stages, which LAMMPS does not have: "
                     "shorten its time until the plan of flexel-simulate --explain has no stages");
  return plan.damping;
}

bool moves(const simulate::Motion& motion) {
  return motion.angle != 0 || motion.translation != Vec3::Zero();
}

void add_supports(const simulate::TimeSegment& segment, const Body& body, const simulate::Scene& scene,
                  Particles& particles) {
  const simulate::Constraints& constraints = segment.constraints();
  particles.support.assign(body.element_count(), 0);
  if (constraints.mask.empty()) return;
  particles.motions = constraints.motions;
  particles.courses = constraints.courses;
  for (const simulate::Motion& motion : particles.motions)
    if (motion.link || (motion.angle != 0 && motion.arc_from))
      throw InputError(scene.name, "arc_from of a [[move]] has no counterpart in LAMMPS: leave it out");
  particles.led_from = body.rest;
  std::map<std::pair<std::uint8_t, std::array<std::uint32_t, 3>>, std::uint32_t> known;
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    const std::uint8_t mask = constraints.mask[e];
    if (mask == 0) continue;
    std::array<std::uint32_t, 3> motion = constraints.motion[e];
    bool led = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(mask >> axis & 1)) motion[axis] = 0;
      led = led || ((mask >> axis & 1) && moves(particles.motions[motion[axis]]));
    }
    if (!led) motion = {};
    const auto [found, fresh] =
        known.try_emplace({mask, motion}, static_cast<std::uint32_t>(known.size() + 1));
    if (fresh) particles.supports.push_back({mask, constraints.motion[e]});
    particles.support[e] = found->second;
    if (!constraints.start.empty()) particles.led_from[e] += constraints.start[e];
  }
  if (particles.supports.size() > kMostSupports)
    throw InputError(
        scene.name, fmt::format("{} kinds of [[fix]] and [[move]] on elements: LAMMPS has room for {} groups",
                                particles.supports.size(), kMostSupports));
}

void add_forces(const simulate::Scene& scene, const simulate::Problem& problem, const simulate::State& state,
                Particles& particles) {
  particles.gravity = scene.get<simulate::Gravity>().acceleration.value_or(Vec3::Zero());
  for (const simulate::Load& load : scene.get<simulate::Loads>().loads) {
    simulate::Loads::Parameters whole;
    whole.loads = {load};
    whole.loads.front().course = {};
    std::vector<SteadyForce>& all = particles.forces;
    auto same = std::find_if(all.begin(), all.end(), [&](const SteadyForce& each) {
      return each.course.time == load.course.time && each.course.factor == load.course.factor;
    });
    if (same == all.end())
      same = all.insert(all.end(), {load.course, std::vector<Vec3>(state.displacement.size(), Vec3::Zero())});
    simulate::Loads::make(whole, problem)->add_forces(state, same->force);
  }
}

void refuse_massless(const Particles& particles, const Body& body, const simulate::Scene& scene) {
  for (std::size_t e = 0; e < particles.mass.size(); ++e)
    if (!(particles.mass[e] > 0))
      throw InputError(scene.name,
                       fmt::format("element {} of part \"{}\" has no mass, which LAMMPS does not take", e,
                                   body.parts[particles.part[e]].name));
}

void choose_steps(simulate::TimeSegment& segment, const simulate::Scene& scene, Particles& particles) {
  simulate::Clock clock;
  clock.until = *scene.run.time;
  segment.choose_step(clock);
  particles.step = clock.step;
  particles.steps = static_cast<std::uint64_t>(std::llround(*scene.run.time / clock.step));
  const auto wanted = static_cast<std::uint64_t>(std::max(scene.run.frames.value_or(kFrames), 1));
  particles.frames = std::min(particles.steps, wanted);
  particles.half_kick = scene.run.method == simulate::TimeMethod::verlet;
  particles.step_given = scene.run.step.has_value();
}

}  // namespace

bool Particles::damped() const {
  return std::any_of(springs.begin(), springs.end(), [](const Spring& spring) { return spring.damping > 0; });
}

bool Particles::leads(const SupportGroup& group) const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if ((group.mask >> axis & 1) && moves(motions[group.motion[axis]])) return true;
  return false;
}

Turn turn_of(const simulate::Motion& motion, const Vec3& from, std::size_t axis) {
  if (motion.angle == 0) return {};
  const Vec3 across = motion.axis.cross(from - motion.through);
  const auto i = static_cast<Eigen::Index>(axis);
  return {across[i], motion.axis.cross(across)[i]};
}

Particles particles_of(Body& body, const simulate::Scene& scene, Progress& progress) {
  refuse_run(scene);
  simulate::refuse_damaged_columns(body);
  refuse_models(scene, body);
  check_actions(scene, body, progress);
  simulate::SegmentStart start;
  start.settled = simulate::settled_displacement(body);
  start.fused = fused_points(body);
  const simulate::SimulateOptions options;
  simulate::TimeSegment segment(body, scene, options, progress, start, simulate::state_of(body));
  refuse_effects(segment, scene);
  const simulate::Problem problem = timed_problem(body, scene, start);
  const simulate::State& state = segment.state();
  Particles particles;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    particles.position.push_back(body.rest[e] + state.displacement[e]);
  particles.velocity = state.velocity;
  particles.mass = segment.stepper().mass();
  particles.part = element_parts(body);
  refuse_massless(particles, body, scene);
  particles.springs = springs_of(problem, damping_times(segment, body, scene));
  for (const Spring& spring : particles.springs)
    particles.longest =
        std::max(particles.longest, (particles.position[spring.b] - particles.position[spring.a]).norm());
  add_supports(segment, body, scene, particles);
  add_forces(scene, problem, state, particles);
  choose_steps(segment, scene, particles);
  return particles;
}

}  // namespace flexel::lammps
