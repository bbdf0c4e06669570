// Selections: which part of a body a fix, load, move or probe acts on (docs/reference/scene.md, "Selections").
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/lattice/body.h"

namespace flexel::simulate {

struct Selection {
  enum class Kind { name, box, sphere, half_space, any_of, complement };
  Kind kind = Kind::name;
  std::string name;  // "bracket/12", "bracket/#12", "flange", "=flange", "xmin", "bracket/xmin", "bracket"
  Vec3 min = Vec3::Zero();  // m, box, rest, world frame
  Vec3 max = Vec3::Zero();
  Vec3 point = Vec3::Zero();       // m, centre of the sphere; a point of the half-space's plane
  Vec3 normal = Vec3::Zero();      // unit; the half-space lies on the side it points to
  double radius = 0;               // m
  std::vector<Selection> members;  // any_of: their union; complement: what is left out; sphere: its path
  std::string origin;              // "beam.toml:12" or "--fix", for messages
};

// A box, a sphere or a half-space that holds no element.
class EmptySelectionError : public InputError {
 public:
  using InputError::InputError;
};

[[nodiscard]] Selection select_by_name(std::string name, std::string origin = "");

// What a selection means on a body: polygons of the surface (faces, groups, sides) or elements (box, sphere,
// half-space, part), both ascending.
struct Selected {
  std::vector<std::uint32_t> polygons;
  std::vector<std::uint32_t> elements;
};

// Throws InputError(selection.origin, ...) when a name is unknown (with the nearest), means two things,
// or when nothing is selected; each with what to write. `at` (elements) [m]: where boxes, spheres and
// half-spaces look for elements; nothing: where they rest.
[[nodiscard]] Selected resolve(const Selection& selection, const Body& body,
                               const std::vector<Vec3>* at = nullptr);

// The selection in words, for summaries: `"bracket/12"`, `box`, `2 selections`.
[[nodiscard]] std::string describe(const Selection& selection);

// The outward unit axis of a side ("zmax", "part/zmax", "#zmax"); nothing where the selection is anything
// else.
[[nodiscard]] std::optional<Vec3> side_axis(const Selection& selection, const Body& body);

}  // namespace flexel::simulate
