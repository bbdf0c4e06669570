// A line that leads a tool: the format of poses that come in while a run goes on (docs/guide/live.md).
#pragma once
#include <optional>
#include <string>

#include "base/math/vec.h"

namespace flexel::simulate {

struct PoseLine {
  std::string tool;                  // "": the only one there is
  double time = 0;                   // s, of the run
  Vec3 displacement = Vec3::Zero();  // m, from rest
  Vec3 turn = Vec3::Zero();          // rad, rotation vector, from rest
  bool whole_turns = true;           // as a quaternion, which has none, it is the same after each
  bool end = false;                  // "end": the run is over
};

// `[NAME] TIME X Y Z`, `... RX RY RZ` (a rotation vector) or `... QW QX QY QZ` (a quaternion of any length
// but 0); seconds, metres, radians; blanks or commas between them. Nothing for an empty line and for what
// begins with #. Throws InputError(place, ...).
[[nodiscard]] std::optional<PoseLine> parse_pose_line(const std::string& line, const std::string& place);

// The rotation vector of the same rotation that is nearest to `reference`.
[[nodiscard]] Vec3 nearest_turn(const Vec3& turn, const Vec3& reference);

}  // namespace flexel::simulate
