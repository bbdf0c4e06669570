// [[manipulator]], and `rigid` of [parts.NAME].
#include "simulate/effects/rigid.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "base/error.h"
#include "simulate/input/part_names.h"
#include "simulate/matter/masses.h"

namespace flexel::simulate {
namespace {

// Of each part: what [parts] says; its own entry, else that of the smallest assembly that holds it.
std::vector<Rigidity> rigidity_of_entries(const RigidParts::Parameters& parameters, const Body& body) {
  const std::vector<std::string> names = part_names(body);
  std::vector<Rigidity> result(names.size(), Rigidity::none);
  // by how many parts the entry is for that has decided; 0: the part's own
  std::vector<std::size_t> width(names.size(), std::numeric_limits<std::size_t>::max());
  const auto decide = [&](const std::string& name, const std::vector<std::uint32_t>& parts, Rigidity says) {
    for (const std::uint32_t p : parts) {
      const std::size_t its = entry_width(names, parts, name);
      if (its >= width[p]) continue;
      width[p] = its;
      result[p] = says;
    }
  };
  for (const std::string& name : parameters.parts) {
    const std::vector<std::uint32_t> parts = parts_called(names, body.surface.parts, name);
    if (parts.empty()) (void)require_parts(body, name, "[parts]");  // throws
    decide(name, parts, Rigidity::free);
  }
  for (const std::string& name : parameters.soft)  // may be of a part that joins later
    decide(name, parts_called(names, body.surface.parts, name), Rigidity::none);
  return result;
}

}  // namespace

void RigidParts::parse(TableReader& scene, Parameters& parameters) {
  if (const SceneValue* parts = scene.find("parts"))
    for (const auto& [part, value] : parts->members)
      for (const auto& [key, entry] : value.members) {
        if (key != "rigid") continue;
        if (entry.kind != SceneValue::Kind::boolean)
          scene.fail(entry.line, "\"rigid\" needs to be true or false");
        (entry.flag ? parameters.parts : parameters.soft).push_back(part);
      }
  for (const SceneValue* table : scene.tables("manipulator")) {
    TableReader reader(*table, scene.file(), "[[manipulator]]");
    Manipulator made;
    made.origin = reader.place();
    (void)reader.require("part", "\"tool\"");
    made.part = *reader.text("part");
    made.name = reader.text("name").value_or(made.part);
    made.path = parse_path(reader);
    (void)reader.find("glue");  // simulate/effects/contact.cpp
    if (reader.text("path") == "stdin")
      made.live = std::make_shared<LiveTool>(LiveTool{made.name, true, made.path});
    reader.finish();
    parameters.manipulators.push_back(made);
  }
}

std::vector<Rigidity> RigidParts::rigidity(const Parameters& parameters, const Body& body) {
  if (parameters.parts.empty() && parameters.manipulators.empty()) return {};
  std::vector<Rigidity> result = rigidity_of_entries(parameters, body);
  for (const Manipulator& each : parameters.manipulators) {
    Rigidity& part = result[require_part(body, each.part, each.origin)];
    if (part == Rigidity::led)
      throw InputError(each.origin, fmt::format("part \"{}\" has two [[manipulator]]", each.part));
    part = Rigidity::led;
  }
  return result;
}

std::optional<RigidParts> RigidParts::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.parts.empty() && parameters.manipulators.empty()) return std::nullopt;
  RigidParts made;
  made.body_ = &problem.body;
  made.mass_ = lumped_masses(problem);
  const std::vector<MassMoments> moments = rigid_moments(problem);
  // at equilibrium, which refuses the effect, nothing is rigid
  for (std::uint32_t p = 0; p < problem.rigidity.size(); ++p) {
    if (problem.rigidity[p] == Rigidity::none) continue;
    Moving moving;
    moving.body = rigid_body(problem.body, p, moments[p]);
    for (const Manipulator& each : parameters.manipulators)
      if (require_part(problem.body, each.part, each.origin) == p) moving.led = each;
    moving.velocity.resize(moving.body.arms.size());
    moving.support.resize(moving.body.arms.size(), Vec3::Zero());
    made.moving_.push_back(std::move(moving));
  }
  if (made.moving_.empty() && !problem.rigidity.empty()) return std::nullopt;  // each has `rigid = false`
  return made;
}

std::string RigidParts::why() const {
  const auto led = std::count_if(moving_.begin(), moving_.end(), [](const Moving& m) { return m.led; });
  return fmt::format("{} rigid part(s), {} [[manipulator]]", moving_.size(), led);
}

Pose RigidParts::Moving::pose_at(double time) const {
  return (led->live ? led->live->path : led->path).at(time, body.centre);
}

std::optional<std::size_t> RigidParts::number_of(std::uint32_t part) const {
  for (std::size_t m = 0; m < moving_.size(); ++m)
    if (moving_[m].body.part == part) return m;
  return std::nullopt;
}

std::vector<const RigidBody*> RigidParts::join(std::shared_ptr<JointSystem> joints) {
  joints_ = std::move(joints);
  std::vector<const RigidBody*> bodies;
  for (const Moving& moving : moving_) bodies.push_back(&moving.body);
  return bodies;
}

// As they are.
std::vector<JointedBody> RigidParts::as_jointed() const {
  std::vector<JointedBody> bodies;
  for (const Moving& moving : moving_)
    bodies.push_back(
        {&moving.body, moving.led.has_value(), moving.body.momentum, moving.body.spin, moving.body.pose});
  return bodies;
}

void RigidParts::start(State& state) {
  for (Moving& moving : moving_) {
    RigidBody& body = moving.body;
    take_up(body, *body_, mass_, state.displacement, state.velocity);
    if (!moving.led) continue;
    body.momentum = body.spin = Vec3::Zero();
    body.pose = moving.pose_at(*state.time);
  }
  std::vector<JointedBody> jointed = as_jointed();
  if (joints_) joints_->begin(jointed, true);
  for (std::size_t m = 0; m < moving_.size(); ++m) {
    RigidBody& body = moving_[m].body;
    if (!moving_[m].led) {
      body.momentum = jointed[m].momentum;
      body.spin = jointed[m].spin;
    }
    move_to(body, body.pose, 0, state.displacement, state.velocity);
  }
}

void RigidParts::begin(const State& state) {
  for (Moving& moving : moving_) {
    take_up(moving.body, *body_, mass_, state.displacement, state.velocity);
    std::copy(state.velocity.begin() + moving.body.begin, state.velocity.begin() + moving.body.end,
              moving.velocity.begin());
  }
  std::vector<JointedBody> jointed = as_jointed();
  if (joints_) joints_->begin(jointed, false);
}

// What leads it, from the impulse and the moment about its centre [N s, N m s] that everything else gave it on
// its way to `next`; `rotation`: as the forces found it.
void RigidParts::Moving::feel(const Pose& next, const Mat3& rotation, const Vec3& impulse,
                              const Vec3& turning, const StepDone& done) {
  const Vec3 momentum = body.mass / done.drift * (next.translation - body.pose.translation);
  const Vec3 turn = turn_of(next.rotation * body.pose.rotation.transpose());
  const Mat3 middle = turned_by(0.5 * turn) * body.pose.rotation;
  const Vec3 spin = middle * body.inertia * middle.transpose() * turn / done.drift;
  force = (momentum - body.momentum - impulse) / done.kick;
  const Vec3 arm = rotation * (led->path.about.value_or(body.centre) - body.centre);
  torque = (spin - body.spin - turning) / done.kick - arm.cross(force);
  body.momentum = momentum;
  body.spin = spin;
  if (!led->live) return;
  led->live->impulse += impulse;
  led->live->turning += turning - arm.cross(impulse);
  led->live->seconds += done.kick;
}

std::string RigidParts::refuses_implicit_steps() const {
  const auto free = [](const Moving& moving) { return !moving.led; };
  return std::any_of(moving_.begin(), moving_.end(), free) ? "free rigid parts (\"rigid\" of [parts])" : "";
}

void RigidParts::constrain_implicit_steps(Constraints& constraints) {
  for (Moving& moving : moving_) {
    moving.link = std::make_shared<RigidLink>();
    moving.link->middle = moving.body.centre;
    Motion motion;
    motion.link = moving.link;
    motion.from_rest = true;
    const auto number = static_cast<std::uint32_t>(constraints.motions.size());
    constraints.motions.push_back(motion);
    constraints.courses.push_back({});
    for (std::uint32_t e = moving.body.begin; e < moving.body.end; ++e) {
      constraints.mask[e] = 7;
      constraints.motion[e] = {number, number, number};
    }
  }
}

void RigidParts::lead_to(double time, std::vector<Vec3>& displacement) {
  for (Moving& moving : moving_) {
    const Pose pose = moving.pose_at(time);
    moving.link->translation = pose.translation;
    moving.link->turn = turn_of(pose.rotation);
    for (std::uint32_t e = moving.body.begin; e < moving.body.end; ++e)
      displacement[e] = moving.link->displacement(body_->rest[e]);
  }
}

// Forces are those at the end of the step.
void RigidParts::end_implicit_step(const State& state, const StepDone& done,
                                   const std::vector<Vec3>& supports) {
  for (Moving& moving : moving_) {
    RigidBody& body = moving.body;
    moving.before = {body.pose, body.momentum, body.spin};
    const Pose next = moving.pose_at(*state.time);
    Vec3 impulse = Vec3::Zero(), turning = Vec3::Zero();
    for (std::uint32_t e = body.begin; e < body.end; ++e) {
      const std::uint32_t n = e - body.begin;
      const Vec3 took = done.mass[e] * (state.velocity[e] - moving.velocity[n]) - done.kick * supports[e];
      impulse += took;
      turning += (next.rotation * body.arms[n]).cross(took);
      moving.support[n] = supports[e];
      moving.velocity[n] = state.velocity[e];
    }
    moving.feel(next, next.rotation, impulse, turning, done);
    body.pose = next;
  }
}

void RigidParts::finish_step(State& state, const StepDone& done) {
  std::vector<JointedBody> after = as_jointed();
  for (std::size_t m = 0; m < moving_.size(); ++m) {
    Moving& moving = moving_[m];
    const RigidBody& body = moving.body;
    moving.before = {body.pose, body.momentum, body.spin};
    for (std::uint32_t e = body.begin; e < body.end; ++e) {
      const Vec3 took = done.mass[e] * (state.velocity[e] - moving.velocity[e - body.begin]);
      after[m].momentum += took;
      after[m].spin += (body.pose.rotation * body.arms[e - body.begin]).cross(took);
      moving.support[e - body.begin] = state.velocity[e];  // as if free
    }
    if (moving.led) after[m].next = moving.pose_at(*state.time);
  }
  if (joints_) joints_->advance(after, done.kick, done.drift);
  for (std::size_t m = 0; m < moving_.size(); ++m) {
    Moving& moving = moving_[m];
    RigidBody& body = moving.body;
    const JointedBody& now = after[m];
    if (moving.led) {
      moving.feel(now.next, body.pose.rotation, now.momentum - body.momentum, now.spin - body.spin, done);
      move_to(body, now.next, done.drift, state.displacement, state.velocity);
    } else {
      body.momentum = now.momentum;
      body.spin = now.spin;
      move_to(body, joints_ ? now.next : drifted(body, body.momentum, body.spin, done.drift), done.drift,
              state.displacement, state.velocity);
    }
    for (std::uint32_t e = body.begin; e < body.end; ++e) {
      Vec3& support = moving.support[e - body.begin];
      support =
          moving.led ? Vec3(done.mass[e] / done.kick * (state.velocity[e] - support)) : Vec3(Vec3::Zero());
      moving.velocity[e - body.begin] = state.velocity[e];
    }
  }
}

std::vector<RigidMomenta> RigidParts::rigid_momenta(bool half_kick) const {
  std::vector<RigidMomenta> result;
  for (const Moving& moving : moving_) {
    if (moving.led) continue;
    const auto& [pose, momentum, spin] = moving.before;
    result.push_back(half_kick ? momenta_at(moving.body, pose, 2 * momentum - moving.body.momentum,
                                            2 * spin - moving.body.spin)
                               : momenta_at(moving.body, pose, momentum, spin));
  }
  return result;
}

void RigidParts::add_support_forces(std::vector<Vec3>& forces) {
  for (const Moving& moving : moving_)
    for (std::uint32_t e = moving.body.begin; e < moving.body.end; ++e)
      forces[e] += moving.support[e - moving.body.begin];
}

// 24 numbers and the velocities, a part. Implicit steps tell the forces of the last one before the next.
std::vector<double> RigidParts::memory() const {
  std::vector<double> memory;
  const auto add = [&](const auto& values) {
    memory.insert(memory.end(), values.data(), values.data() + values.size());
  };
  for (const Moving& moving : moving_) {
    add(moving.body.pose.translation);
    add(moving.body.pose.rotation);
    add(moving.body.momentum);
    add(moving.body.spin);
    add(moving.force);
    add(moving.torque);
    for (const Vec3& velocity : moving.velocity) add(velocity);
  }
  return memory;
}

void RigidParts::restore(const std::vector<double>& memory) {
  const double* from = memory.data();
  const auto take = [&](auto& values) {
    std::copy(from, from + values.size(), values.data());
    from += values.size();
  };
  std::size_t wanted = 0;
  for (const Moving& moving : moving_) wanted += 24 + 3 * moving.velocity.size();
  if (memory.size() != wanted) throw InputError("the checkpoint's rigid parts are not those of its scene");
  for (Moving& moving : moving_) {
    take(moving.body.pose.translation);
    take(moving.body.pose.rotation);
    take(moving.body.momentum);
    take(moving.body.spin);
    take(moving.force);
    take(moving.torque);
    for (Vec3& velocity : moving.velocity) take(velocity);
  }
}

void RigidParts::report(const State&, const std::vector<Vec3>&, SimulateResult& result) {
  for (const Moving& moving : moving_) {
    if (!moving.led) continue;
    const Pose& pose = moving.body.pose;
    const Vec3& centre = moving.body.centre;
    const Vec3 arm = pose.rotation * (moving.led->path.about.value_or(centre) - centre);
    const Vec3 about = centre + pose.translation + arm;
    result.reactions.push_back({moving.led->name, moving.force, moving.torque + about.cross(moving.force),
                                centre + pose.translation, true});
  }
}

std::vector<std::string> RigidParts::history_columns() const {
  std::vector<std::string> columns;
  for (const Moving& moving : moving_) {
    if (!moving.led) continue;
    for (const char* what : {"force", "torque"})
      for (const char axis : {'x', 'y', 'z'})
        columns.push_back(fmt::format("{} {} {} [{}]", moving.led->name, what, axis,
                                      std::string(what) == "force" ? "N" : "N m"));
  }
  return columns;
}

std::vector<double> RigidParts::history_values(const State&, const std::vector<Vec3>&) {
  std::vector<double> values;
  for (const Moving& moving : moving_) {
    if (!moving.led) continue;
    values.insert(values.end(), moving.force.begin(), moving.force.end());
    values.insert(values.end(), moving.torque.begin(), moving.torque.end());
  }
  return values;
}

}  // namespace flexel::simulate
