// [[joint]].
#include "simulate/joints/joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/error.h"
#include "base/nearest_word.h"
#include "formats/lattice/fused_points.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/rigid.h"
#include "simulate/input/part_names.h"

namespace flexel::simulate {
namespace {

const std::vector<std::string>& kind_names() {  // in the order of JointKind
  static const std::vector<std::string> names = {"hinge", "slider", "ball", "motor"};
  return names;
}

JointKind parse_kind(TableReader& reader) {
  (void)reader.require("kind", "\"hinge\"");
  const std::string kind = *reader.text("kind");
  const auto found = std::find(kind_names().begin(), kind_names().end(), kind);
  if (found == kind_names().end())
    reader.fail(reader.find("kind")->line,
                fmt::format("\"kind\" = \"{}\"; choose {}{}", kind, fmt::join(kind_names(), ", "),
                            did_you_mean(kind, kind_names())));
  return static_cast<JointKind>(found - kind_names().begin());
}

std::array<std::string, 2> joined_parts(TableReader& reader) {
  const SceneValue& list =
      reader.require("parts", "[\"arm\", \"base\"], or [\"arm\"] for one held by the world");
  std::vector<std::string> names;
  for (const SceneValue& item : list.items)
    if (item.kind == SceneValue::Kind::string && !item.text.empty()) names.push_back(item.text);
  if (names.size() != list.items.size() || names.empty() || names.size() > 2)
    reader.fail(
        list.line,
        "\"parts\" needs one name or two: [\"arm\", \"base\"], or [\"arm\"] for one held by the world");
  names.resize(2);
  return {names[0], names[1]};
}

void parse_motor(TableReader& reader, Joint& joint) {
  for (const auto& [key, dimension, value] : {std::tuple{"angle_per_second", Dimension::angle, &joint.speed},
                                              {"torque", Dimension::torque, &joint.torque}}) {
    const SceneValue* given = reader.find(key);
    if (!given) continue;
    if (joint.kind != JointKind::motor)
      reader.fail(given->line, fmt::format("\"{}\" is of motors: kind = \"motor\"", key));
    *value = reader.to_quantity(*given, dimension, key);
  }
  if (joint.kind != JointKind::motor) return;
  if (!joint.speed && !joint.torque)
    reader.fail(
        "a motor needs \"angle_per_second\" (for example \"360 deg\"), \"torque\" (\"1 N m\") or both: the "
        "torque "
        "is the most that it takes for the speed then");
  if (joint.speed && joint.torque && !(*joint.torque > 0))
    reader.fail(
        "\"torque\" beside \"angle_per_second\" is the most that the motor takes: it needs to be above 0");
}

// The place of its [[joint]] entry in messages that name a part.
[[noreturn]] void refuse_soft(const Joint& joint, const std::string& part) {
  throw InputError(
      joint.origin,
      fmt::format("part \"{}\" of joint \"{}\" is not rigid: rigid = true in [parts.\"{}\"], or bond a rigid "
                  "part to it and join that",
                  part, joint.name, part));
}

}  // namespace

void Joints::parse(TableReader& scene, Parameters& parameters) {
  for (const SceneValue* table : scene.tables("joint")) {
    TableReader reader(*table, scene.file(), "[[joint]]");
    Joint joint;
    joint.origin = reader.place();
    joint.kind = parse_kind(reader);
    joint.parts = joined_parts(reader);
    if (joint.parts[0] == joint.parts[1])
      reader.fail(fmt::format("part \"{}\" cannot be joined with itself", joint.parts[0]));
    joint.name = reader.text("name").value_or(
        joint.parts[1].empty() ? joint.parts[0] : fmt::format("{} {}", joint.parts[0], joint.parts[1]));
    joint.at =
        reader.to_vector(reader.require("at", "[\"0 mm\", \"0 mm\", \"0 mm\"]"), Dimension::length, "at");
    const SceneValue* axis = reader.find("axis");
    if (axis && joint.kind == JointKind::ball)
      reader.fail(axis->line, "a ball joint has no axis: leave \"axis\" out");
    if (joint.kind != JointKind::ball) {
      (void)reader.require("axis", "[0, 0, 1]");
      joint.axis = *reader.direction("axis");
    }
    parse_motor(reader, joint);
    reader.finish();
    for (const Joint& other : parameters.joints)
      if (other.name == joint.name)
        reader.fail(
            fmt::format("joint \"{}\" is there twice: give one of them another \"name\"", joint.name));
    parameters.joints.push_back(std::move(joint));
  }
}

void Joints::refuse_fused(const Parameters& parameters, const Body& body) {
  if (parameters.joints.empty()) return;
  const std::vector<FusedPoint> fused = fused_points(body);
  for (const Joint& joint : parameters.joints) {
    if (joint.parts[1].empty()) continue;
    if (are_fused(body, fused, require_part(body, joint.parts[0], joint.origin),
                  require_part(body, joint.parts[1], joint.origin)))
      throw InputError(
          joint.origin,
          fmt::format("parts \"{}\" and \"{}\" are held together by an earlier run ([[event]] fuse, or "
                      "add where they touched), so joint \"{}\" could not move: leave it out",
                      joint.parts[0], joint.parts[1], joint.name));
  }
}

std::optional<Joints> Joints::make(const Parameters& parameters, const Problem& problem, RigidParts* rigid,
                                   const Bonds* bonds) {
  if (parameters.joints.empty()) return std::nullopt;
  Joints made;
  std::vector<JointSystem::Place> places;
  for (const Joint& joint : parameters.joints) {
    JointSystem::Place place{joint, {}};
    bool any_free = false;
    std::array<std::uint32_t, 2> parts{};
    for (std::size_t s = 0; s < 2 && !joint.parts[s].empty(); ++s) {
      parts[s] = require_part(problem.body, joint.parts[s], joint.origin);
      const std::optional<std::size_t> number = rigid ? rigid->number_of(parts[s]) : std::nullopt;
      // at equilibrium nothing is rigid, and all of this is refused
      if (!number && problem.duration) refuse_soft(joint, joint.parts[s]);
      if (!number) continue;
      place.sides[s] = {*number, rigid->body(*number).centre};
      any_free = any_free || !rigid->is_led(*number);
    }
    if (!joint.parts[1].empty() && parts[0] == parts[1])
      throw InputError(joint.origin, fmt::format("part \"{}\" cannot be joined with itself", joint.parts[0]));
    if (!any_free && problem.duration)
      throw InputError(joint.origin,
                       fmt::format("joint \"{}\" has no part that is free to move: a [[manipulator]] leads "
                                   "what it joins",
                                   joint.name));
    if (bonds && !joint.parts[1].empty() && bonds->holds(parts[0], parts[1], problem.body))
      throw InputError(joint.origin,
                       fmt::format("parts \"{}\" and \"{}\" touch and are bonded, so joint \"{}\" could not "
                                   "move: bond = false",
                                   joint.parts[0], joint.parts[1], joint.name));
    places.push_back(std::move(place));
  }
  made.system_ = std::make_shared<JointSystem>(std::move(places), bounding_box(problem.body.rest).diagonal(),
                                               problem.duration.value_or(0));
  if (rigid && problem.duration) made.bodies_ = rigid->join(made.system_);
  return made;
}

std::string Joints::why() const {
  return fmt::format("{} [[joint]]", system_->places().size());
}

double Joints::added_frequency(const State&, const std::vector<double>&) {
  return system_->frequency(bodies_);
}

std::vector<EffectPower> Joints::powers(bool after) const {
  const JointSystem::Power& power = after ? system_->after() : system_->before();
  const auto drives = [](const JointSystem::Place& place) { return place.joint.kind == JointKind::motor; };
  std::vector<EffectPower> powers{{"supports", EnergyAccount::work, power.supports}};
  if (std::any_of(system_->places().begin(), system_->places().end(), drives))
    powers.push_back({"motors", EnergyAccount::work, power.motors});
  return powers;
}

void Joints::restore(const std::vector<double>& memory) {
  if (!system_->restore(memory)) throw InputError("the checkpoint's joints are not those of its scene");
}

std::vector<double> Joints::transfer_state() const {
  std::vector<double> travelled = system_->memory();  // begins with them
  travelled.resize(system_->places().size());
  return travelled;
}

void Joints::restore_from(const std::vector<double>& travelled) {
  constexpr double kWhole = 2 * std::numbers::pi;
  std::vector<double> memory = system_->memory();
  for (std::size_t p = 0; p < system_->places().size() && p < travelled.size(); ++p)
    if (system_->places()[p].joint.kind != JointKind::slider)
      memory[p] += kWhole * std::round((travelled[p] - memory[p]) / kWhole);
  restore(memory);
}

std::vector<std::string> Joints::history_columns() const {
  std::vector<std::string> columns;
  for (const JointSystem::Place& place : system_->places()) {
    for (const char axis : {'x', 'y', 'z'})
      columns.push_back(fmt::format("{} joint force {} [N]", place.joint.name, axis));
    for (const char axis : {'x', 'y', 'z'})
      columns.push_back(fmt::format("{} joint torque {} [N m]", place.joint.name, axis));
    if (place.joint.kind == JointKind::slider)
      columns.push_back(place.joint.name + " travel [m]");
    else if (place.joint.kind != JointKind::ball)
      columns.push_back(place.joint.name + " angle [rad]");
    if (place.joint.kind == JointKind::motor) columns.push_back(place.joint.name + " drive [N m]");
  }
  return columns;
}

std::vector<double> Joints::history_values(const State&, const std::vector<Vec3>&) {
  std::vector<double> values;
  for (std::size_t p = 0; p < system_->places().size(); ++p) {
    const JointSystem::Reaction& told = system_->reactions()[p];
    const JointKind kind = system_->places()[p].joint.kind;
    values.insert(values.end(), told.force.begin(), told.force.end());
    values.insert(values.end(), told.torque.begin(), told.torque.end());
    if (kind != JointKind::ball) values.push_back(told.travel);
    if (kind == JointKind::motor) values.push_back(told.drive);
  }
  return values;
}

}  // namespace flexel::simulate
