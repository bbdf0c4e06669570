// The rows of all effects.
#include "simulate/scene/effects.h"

#include <fmt/format.h>

#include "base/error.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/drag.h"
#include "simulate/effects/fracture.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/effects/loads.h"
#include "simulate/effects/plasticity.h"
#include "simulate/effects/rigid.h"
#include "simulate/effects/supports.h"
#include "simulate/indent/indenters.h"
#include "simulate/joints/joints.h"
#include "simulate/paper/connection_friction.h"
#include "simulate/thermal/thermal.h"

namespace flexel::simulate {
namespace {

using K = KeyKind;
using D = Dimension;

template <class E>
void parse_one(TableReader& scene, EffectParameters& parameters) {
  E::parse(scene, parameters.get<E>());
}

template <class E>
void make_one(const EffectParameters& parameters, const Problem& problem, std::vector<ActiveEffect>& to) {
  if (auto made = E::make(parameters.get<E>(), problem)) to.push_back(activate(std::move(*made)));
}

// Forces along the normals store energy, the others lose it: two effects of the same contacts.
template <>
void make_one<Contact>(const EffectParameters& parameters, const Problem& problem,
                       std::vector<ActiveEffect>& to) {
  std::optional<Contact> made = Contact::make(parameters.get<Contact>(), problem);
  if (!made) return;
  std::optional<ContactLosses> losses = made->losses();
  to.push_back(activate(std::move(*made)));
  if (losses) to.push_back(activate(std::move(*losses)));
}

template <class E>
E* made_before(const std::vector<ActiveEffect>& effects) {
  for (const ActiveEffect& effect : effects)
    if (E* found = dynamic_cast<E*>(&effect.untimed())) return found;
  return nullptr;
}

template <>
void make_one<Joints>(const EffectParameters& parameters, const Problem& problem,
                      std::vector<ActiveEffect>& to) {
  if (auto made = Joints::make(parameters.get<Joints>(), problem, made_before<RigidParts>(to),
                               made_before<Bonds>(to)))
    to.push_back(activate(std::move(*made)));
}

// `can_leave_out`: see EffectRow.
template <class E>
EffectRow row(const char* help, ActsIn acts, const char* models, std::vector<std::string> can_leave_out,
              std::vector<SceneKey> keys) {
  return {E::name, help, acts, models, std::move(can_leave_out), std::move(keys), parse_one<E>, make_one<E>};
}

std::vector<SceneKey> gravity_keys() {
  return {{"[gravity]", "acceleration", K::vector, D::acceleration, "", "uniform, on every part"},
          {"[gravity]", "source", K::list, {}, "", "masses that attract, each a table; in timed runs"},
          {"[gravity]", "mutual", K::flag, {}, "false", "every element attracts every other; in timed runs"},
          {"[gravity]", "constant", K::quantity, D::gravitational_constant, "6.6743e-11 m3/kg/s2",
           "G of source and mutual"},
          {"source of [gravity]", "at", K::vector, D::length, "required; or part",
           "where it is; it does not move"},
          {"source of [gravity]", "part", K::text, {}, "", "a part, which moves: its centre of mass draws"},
          {"source of [gravity]", "mass", K::quantity, D::mass, "required; the part's", "its mass"}};
}

std::vector<SceneKey> load_keys() {
  const std::string t = "[[load]]";
  return {{t, "where", K::selection, {}, "required", "what it acts on"},
          {t, "name", K::text, {}, "the selection", "for the summary"},
          {t, "force", K::vector, D::force, "", "in total, spread evenly"},
          {t, "at", K::vector, D::length, "the middle", "a remote point where the force acts"},
          {t, "torque", K::vector, D::torque, "", "a couple about this axis"},
          {t, "pressure", K::quantity, D::pressure, "", "along the surface's normals, inwards"},
          {t, "bearing", K::vector, D::force, "", "of a pin in a hole"},
          {t, "follower", K::flag, {}, "false", "it turns with what it acts on"},
          {t, "link", K::text, {}, "\"averaging\"", "or \"rigid\": how force and torque reach the selection"},
          {t, "time", K::list, D::time, "", "times of a load curve; in timed runs"},
          {t, "factor", K::list, {}, "", "the load's factor at each of them"}};
}

std::vector<SceneKey> support_keys() {
  const std::string f = "[[fix]]", m = "[[move]]", r = "rotation of [[move]]";
  return {
      {f, "where", K::selection, {}, "required", "what is held"},
      {f, "name", K::text, {}, "the selection", "for the summary"},
      {f, "axes", K::text, {}, "\"xyz\"", "the world axes that are held"},
      {m, "where", K::selection, {}, "required", "what is led"},
      {m, "name", K::text, {}, "the selection", "for the summary"},
      {m, "displacement", K::vector, D::length, "", "\"free\" leaves an axis to itself"},
      {m, "rotation", K::table, {}, "", "comes before the displacement"},
      {m, "time", K::list, D::time, "", "times of a load curve; in timed runs"},
      {m, "factor", K::list, {}, "", "the motion's factor at each of them"},
      {r, "axis", K::direction, {}, "required", "right-handed"},
      {r, "through", K::vector, D::length, "required", "a point of the axis"},
      {r, "angle", K::quantity, D::angle, "required", "more than a turn is what it says"},
      {r, "arc_from", K::vector, D::length, "", "the way from here to through becomes an arc of the angle"}};
}

std::vector<SceneKey> indenter_keys() {
  const std::string t = "[[indenter]]", b = "ball of [[indenter]]", p = "plate of [[indenter]]",
                    r = "rotation of [[indenter]]";
  return {{t, "name", K::text, {}, "\"indenter\"", "for the summary"},
          {t, "ball", K::table, {}, "required; or plate", "a rigid ball, which begins outside the parts"},
          {t, "plate", K::table, {}, "required; or ball", "the flat end of a round, rigid rod, likewise"},
          {t, "displacement", K::vector, D::length, "0", "that it is led by"},
          {t, "rotation", K::table, {}, "", "comes before the displacement"},
          {b, "centre", K::vector, D::length, "required", "where it begins"},
          {b, "radius", K::quantity, D::length, "required", "at least a cell"},
          {p, "centre", K::vector, D::length, "required", "of its face, where it begins"},
          {p, "normal", K::direction, {}, "required", "that the face looks along"},
          {p, "radius", K::quantity, D::length, "required", "at least a cell"},
          {p, "rounding", K::quantity, D::length, "radius / 4", "radius of its edge"},
          {r, "axis", K::direction, {}, "required", "right-handed"},
          {r, "through", K::vector, D::length, "required", "a point of the axis"},
          {r, "angle", K::quantity, D::angle, "required", "more than a turn is what it says"}};
}

std::vector<SceneKey> bond_keys() {
  return {
      {"", "bond", K::flag, {}, "true; false with contact", "parts that touch hold together; or [[bond]]"},
      {"[[bond]]", "parts", K::list, {}, "required", "the names of two parts"},
      {"[[bond]]", "gap", K::quantity, D::length, "0", "between faces that hold together all the same"}};
}

std::vector<SceneKey> damping_keys() {
  return {{"[damping]", "time", K::quantity, D::time, "required; or period", "the time tau of the dashpots"},
          {"[damping]", "period", K::quantity, D::time, "", "of a swing that decays with the ratio"},
          {"[damping]", "ratio", K::number, {}, "the material's", "share of the critical, at the period"},
          {"[damping]", "part", K::text, {}, "every part", "a part's name"}};
}

std::vector<SceneKey> internal_friction_keys() {
  return {{"[internal_friction]", "coefficient", K::number, {}, "required", "mu along connections"},
          {"[internal_friction]", "part", K::text, {}, "every part", "a part's name"}};
}

std::vector<SceneKey> velocity_keys() {
  const std::string v = "[[velocity]]", s = "spin of [[velocity]]";
  return {{v, "where", K::selection, {}, "required", "what moves"},
          {v, "velocity", K::vector, D::velocity, "", "of all of it"},
          {v, "spin", K::table, {}, "", "and its rotation"},
          {s, "axis", K::direction, {}, "required", "right-handed"},
          {s, "through", K::vector, D::length, "required", "a point of the axis"},
          {s, "angle_per_second", K::quantity, D::angle, "required", "how fast"}};
}

std::vector<SceneKey> plasticity_keys() {
  const std::string t = "[plasticity]";
  return {{t, "yield", K::quantity, D::pressure, "the material's", "stress at which it flows"},
          {t, "hardening", K::quantity, D::pressure, "the material's", "stress per plastic strain"},
          {t, "part", K::text, {}, "every part", "a part's name"}};
}

std::vector<SceneKey> fracture_keys() {
  const std::string t = "[fracture]";
  return {{t, "strength", K::quantity, D::pressure, "the material's", "stress at which it breaks"},
          {t, "elongation", K::number, {}, "the material's", "plastic strain at which it breaks"},
          {t, "part", K::text, {}, "every part", "a part's name"}};
}

std::vector<SceneKey> drag_keys() {
  return {{"[drag]", "density", K::quantity, D::density, "required", "of the medium"},
          {"[drag]", "coefficient", K::number, {}, "1", "C of 1/2 rho C v^2"}};
}

std::vector<SceneKey> rigid_keys() {
  const std::string t = "[[manipulator]]";
  return {
      {"[parts.NAME]", "rigid", K::flag, {}, "false", "the part moves as a whole"},
      {t, "part", K::text, {}, "required", "the part that is led, as a rigid one"},
      {t, "name", K::text, {}, "the part's", "for the summary"},
      {t, "path", K::text, {}, "", "a CSV file of poses, or \"stdin\""},
      {t, "about", K::vector, D::length, "its centre of mass", "the point that poses and torques refer to"},
      {t, "time", K::list, D::time, "", "times of the poses"},
      {t, "displacement", K::list, D::length, "", "a vector at each time"},
      {t, "rotation", K::list, {}, "", "{ axis, angle } at each time"}};
}

std::vector<SceneKey> joint_keys() {
  const std::string t = "[[joint]]";
  return {
      {t, "kind", K::text, {}, "required", "\"hinge\", \"slider\", \"ball\" or \"motor\""},
      {t, "parts", K::list, {}, "required", "a rigid part, and another or the world"},
      {t, "at", K::vector, D::length, "required", "a point of both at rest"},
      {t, "axis", K::direction, {}, "required; not of balls", "that it turns about or slides along"},
      {t, "name", K::text, {}, "the parts'", "for the history"},
      {t, "angle_per_second", K::quantity, D::angle, "", "of a motor: of the first part against the other"},
      {t, "torque", K::quantity, D::torque, "",
       "of a motor: its couple, or the most it takes for its speed"}};
}

std::vector<SceneKey> thermal_keys() {
  const std::string t = "[thermal]", s = "[shrinkage]", m = "[materials.NAME]";
  const std::string fixed = "[[temperature]]", heat = "[[heat]]", air = "[[convection]]";
  return {{t, "change", K::quantity, D::temperature_difference, "0", "of the temperature, \"80 K\""},
          {t, "gradient", K::vector, D::temperature_gradient, "0",
           "of the temperature, \"500 K/m\" along x, y, z"},
          {t, "about", K::vector, D::length, "the origin", "where the gradient gives nothing"},
          {t, "column", K::text, {}, "", "temperatures [K] of the body's elements or cells"},
          {t, "reference", K::quantity, D::temperature, "",
           "of column and conduction: where the part has its shape, \"20 degC\""},
          {t, "part", K::text, {}, "every part", "a part's name"},
          {s, "axis", K::direction, {}, "[0, 0, 1]", "that layers are stacked along"},
          {s, "layer", K::quantity, D::length, "required", "height of a layer"},
          {s, "along", K::quantity, D::share, "required", "inherent strain along the axis"},
          {s, "across", K::quantity, D::share, "required", "inherent strain across it"},
          {s, "height", K::list, D::length, "", "above the part's lowest point"},
          {s, "factor", K::list, {}, "1", "of both strains at each height"},
          {s, "part", K::text, {}, "every part", "a part's name"},
          {fixed, "where", K::selection, {}, "required", "a face that has the temperature"},
          {fixed, "name", K::text, {}, "the selection", "for the summary"},
          {fixed, "value", K::quantity, D::temperature, "required", "\"100 degC\""},
          {heat, "where", K::selection, {}, "required", "a face that heat comes in by"},
          {heat, "name", K::text, {}, "the selection", "for the summary"},
          {heat, "flux", K::quantity, D::heat_flux, "", "\"1000 W/m2\""},
          {heat, "power", K::quantity, D::power, "", "\"5 W\", in total"},
          {air, "where", K::selection, {}, "required", "a face that a fluid touches"},
          {air, "name", K::text, {}, "the selection", "for the summary"},
          {air, "coefficient", K::quantity, D::heat_transfer, "required", "\"10 W/(m2 K)\""},
          {air, "ambient", K::quantity, D::temperature, "required", "temperature of the fluid, \"20 degC\""},
          {m, "expansion", K::quantity, D::expansion, "the library's", "\"12e-6 /K\""},
          {m, "conductivity", K::quantity, D::conductivity, "the library's", "\"50 W/(m K)\""}};
}

std::vector<SceneKey> contact_keys() {
  const std::string c = "[contact]", p = "[[plane]]";
  return {
      {"", "contact", K::flag, {}, "false; true with [[plane]]", "parts push each other; or [contact]"},
      {c, "parts", K::list, {}, "\"all\"", "names of parts that touch"},
      {c, "self", K::flag, {}, "true", "parts touch themselves too"},
      {c, "stiffness", K::number, {}, "1", "of the springs between surfaces, relative to the cells"},
      {c, "friction", K::number, {}, "0", "coefficient, where the materials give none; or \"material\""},
      {c, "stick", K::quantity, D::pressure, "0", "traction to pull apart what touched"},
      {c, "damping", K::quantity, D::time, "0", "of the relative motion"},
      {c, "overlap", K::text, {}, "\"refuse\"", "or \"part\": what begins inside something else"},
      {c, "overlap_time", K::quantity, D::time, "", "in which overlaps are let out"},
      {p, "name", K::text, {}, "plane N", "for messages"},
      {p, "point", K::vector, D::length, "required", "on the plane"},
      {p, "normal", K::direction, {}, "required", "to the free side"},
      {p, "friction", K::number, {}, "that of [contact]", "coefficient"},
      {p, "stick", K::quantity, D::pressure, "that of the part", "traction to pull apart what touched"},
      {"[materials.NAME]", "stick", K::quantity, D::pressure, "that of [contact]", "traction to pull apart"},
      {"[[manipulator]]", "glue", K::flag, {}, "false", "what touches it stays"}};
}

}  // namespace

// The order is that of the sums.
const std::vector<EffectRow>& effect_rows() {
  constexpr const char *kAll = "cells, springs, paper", *kEvery = "cells, quadratic, springs, paper";
  constexpr const char* kConnections = "paper";
  constexpr ActsIn kEverywhere = ActsIn::all, kNotAtRest = ActsIn::time,
                   kWithContact = ActsIn::relaxation_and_time;
  static const std::vector<EffectRow> rows = {
      row<Gravity>("weight and attraction", kEverywhere, kEvery, {"gravity"}, gravity_keys()),
      row<Loads>("forces, torques and pressures", kEverywhere, kEvery, {"load"}, load_keys()),
      row<Supports>("places that are held or led", kEverywhere, kEvery, {"move"}, support_keys()),
      row<Indenters>("balls and plates that push", ActsIn::equilibrium, "cells, springs", {"indenter"},
                     indenter_keys()),
      row<Thermal>("heat and shrinkage", ActsIn::equilibrium, "cells, quadratic", {"thermal", "shrinkage"},
                   thermal_keys()),
      row<Bonds>("parts that touch hold together", kEverywhere, kEvery, {}, bond_keys()),
      row<Damping>("internal damping", kWithContact, kAll, {"damping"}, damping_keys()),
      row<ConnectionFriction>("sliding friction within a part", kNotAtRest, kConnections,
                              {"internal_friction"}, internal_friction_keys()),
      row<InitialVelocity>("what matter moves with at the start", kNotAtRest, kAll, {"velocity"},
                           velocity_keys()),
      row<Plasticity>("deformation that stays", kNotAtRest, kAll, {"plasticity"}, plasticity_keys()),
      row<Fracture>("matter that breaks", kNotAtRest, kAll, {"fracture"}, fracture_keys()),
      row<Drag>("a medium that resists what moves", kNotAtRest, kAll, {"drag"}, drag_keys()),
      row<RigidParts>("rigid parts and manipulators", kWithContact,
                      "cells, springs, paper; quadratic at equilibrium", {}, rigid_keys()),
      row<Joints>("hinges, sliders, ball joints and motors of rigid parts", kNotAtRest, kAll, {"joint"},
                  joint_keys()),
      row<Contact>("parts push each other, slide and stick", kWithContact, kAll, {"contact"}, contact_keys()),
  };
  return rows;
}

void parse_effects(TableReader& scene, EffectParameters& parameters) {
  for (const EffectRow& row : effect_rows()) row.parse(scene, parameters);
}

std::vector<ActiveEffect> active_effects(const EffectParameters& parameters, const Problem& problem) {
  std::vector<ActiveEffect> effects;
  for (const EffectRow& row : effect_rows()) {
    const std::size_t first = effects.size();
    double seconds = 0;
    {
      const ScopeTimer timer(seconds);
      row.make(parameters, problem, effects);
    }
    if (effects.size() > first) effects[first].seconds = seconds;
    for (std::size_t i = first; i < effects.size(); ++i)
      if (effects[i].acts == ActsIn::all) effects[i].acts = row.acts;
  }
  return effects;
}

void refuse_timed(const std::vector<ActiveEffect>& effects, ActsIn run, const std::string& scene) {
  for (const ActiveEffect& effect : effects)
    if (effect.acts > run)
      throw InputError(scene, fmt::format("{} ({}) acts in timed runs only: give [run] time = \"1 s\", or "
                                          "leave it out",
                                          effect.name, effect.why));
}

}  // namespace flexel::simulate
