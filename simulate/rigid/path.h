// The path of a manipulator: where it is at given times, evenly in between, at rest before and after.
#pragma once
#include <string>
#include <vector>

#include "simulate/input/scene_table.h"
#include "simulate/rigid/rigid_body.h"

namespace flexel::simulate {

struct ManipulatorPath {
  std::vector<double> time;        // s, ascending; empty: it stays where it is
  std::vector<Vec3> displacement;  // (times) m, of the point `about`, from rest
  std::vector<Vec3> turn;          // (times) rad, rotation vector about that point, from rest
  std::optional<Vec3> about;       // m, at rest; nothing: the centre of mass

  // Pose at `time` s of a part whose centre of mass rests at `centre`. Rotations turn evenly about one axis
  // from key to key.
  [[nodiscard]] Pose at(double time, const Vec3& centre) const;
  // Displacement [m] and rotation vector [rad] at `time` s.
  struct Key {
    Vec3 displacement = Vec3::Zero(), turn = Vec3::Zero();
  };
  [[nodiscard]] Key key(double time) const;
};

// The keys `path` (a file; not "stdin") or `time`, `displacement`, `rotation`, and `about` of
// [[manipulator]].
[[nodiscard]] ManipulatorPath parse_path(TableReader& reader);

// A table of a path, comma-separated: columns time, x, y, z, and where it turns rx, ry, rz (a rotation
// vector); each header with its unit: "time [s]", "x [mm]", "rx [deg]". Throws InputError("name:line", ...).
[[nodiscard]] ManipulatorPath read_path(const std::string& text, const std::string& name);

}  // namespace flexel::simulate
