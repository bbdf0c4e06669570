// Parses the arguments of --push, --move, --torque and the like.
#pragma once
#include <optional>
#include <string>

#include "base/math/vec.h"
#include "simulate/scene/scene.h"

namespace flexel::commands {

// "WHERE: AMOUNT", parsed; AMOUNT is "0 0 -50 N" (three components and a unit; commas will do) or "50 N"
// (along the inward normal; of torques and twists: about the face's own axis). Forces, pressures and
// torques may end with "follower": they turn with the surface.
struct Action {
  std::string where;
  std::optional<Vec3> vector;      // N, m, N m or rad
  std::optional<double> along;     // likewise
  std::optional<double> pressure;  // Pa
  bool follower = false;
};

// `text` of --push: a force, in total, or a pressure. Throws InputError that shows how to write it.
[[nodiscard]] Action parse_push(const std::string& text);
// `text` of --move: a displacement.
[[nodiscard]] Action parse_move(const std::string& text);
// `text` of --torque: a couple; of --twist: a rotation; of --bearing: the force of a pin in a hole, three
// components.
[[nodiscard]] Action parse_torque(const std::string& text);
[[nodiscard]] Action parse_twist(const std::string& text);
[[nodiscard]] Action parse_bearing(const std::string& text);
// `text` of --gravity: an acceleration [m/s^2], three components or one number downwards (-z); the unit g is
// 9.80665 m/s^2.
[[nodiscard]] Vec3 parse_gravity(const std::string& text);
// `text` of --probe: "NAME: 10 5 3 mm" (a material point), "NAME: WHERE" or "WHERE".
[[nodiscard]] simulate::Probe parse_probe(const std::string& text);

// Unit vector against the mean outward normal of the selected polygons; of a side ("zmax") against its axis,
// however its polygons look. Throws InputError when they have none (elements selected by a region, faces
// whose normals cancel): a direction has to be given.
[[nodiscard]] Vec3 inward_normal(const simulate::Selection& selection, const Body& body);

// The axis that a torque or a twist of the selected polygons turns about: that of a round face (the largest
// component of its direction is positive), else the mean outward normal, through the middle; `given` is
// another direction. Throws InputError as inward_normal().
struct FaceAxis {
  Vec3 direction = Vec3::UnitZ();  // unit
  Vec3 through = Vec3::Zero();     // m
};
[[nodiscard]] FaceAxis face_axis(const simulate::Selection& selection, const Body& body,
                                 const std::optional<Vec3>& given = {});

// Adds the action to the scene. `body` gives the normals and axes; its surface, and names of parts, are
// enough.
void add_push(simulate::Scene& scene, const Action& action, const Body& body);
void add_move(simulate::Scene& scene, const Action& action, const Body& body);
void add_torque(simulate::Scene& scene, const Action& action, const Body& body);
void add_twist(simulate::Scene& scene, const Action& action, const Body& body);
void add_bearing(simulate::Scene& scene, const Action& action);

}  // namespace flexel::commands
