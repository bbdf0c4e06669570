// What --fix, --push and --move ask for, as people write it on a command line.
#pragma once
#include <optional>
#include <string>

#include "formats/vec.h"
#include "simulate/scene.h"

namespace flexel {

// "WHERE: AMOUNT", parsed; AMOUNT is "0 0 -50 N" (three components and a unit; commas will do) or "50 N"
// (along the inward normal).
struct Action {
  std::string where;
  std::optional<Vec3> vector;      // N or m
  std::optional<double> along;     // N or m, along the inward normal
  std::optional<double> pressure;  // Pa
};

// `text` of --push: a force, in total, or a pressure. Throws InputError that shows how to write it.
[[nodiscard]] Action parse_push(const std::string& text);
// `text` of --move: a displacement.
[[nodiscard]] Action parse_move(const std::string& text);

// Unit vector against the mean outward normal of the selected polygons; of a side ("zmax") against its axis,
// however its polygons look. Throws InputError when they have none (elements selected by a region, faces
// whose normals cancel): a direction has to be given.
[[nodiscard]] Vec3 inward_normal(const Selection& selection, const Body& body);

// Adds the action to the scene. `body` gives the normals.
void add_push(Scene& scene, const Action& action, const Body& body);
void add_move(Scene& scene, const Action& action, const Body& body);

}  // namespace flexel
