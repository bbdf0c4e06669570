// What a manipulator shares with the world outside a run: poses that come in, and what it feels.
#pragma once
#include <memory>
#include <string>

#include "simulate/rigid/path.h"
#include "simulate/rigid/pose_line.h"

namespace flexel::simulate {

struct LiveTool {
  std::string name;
  bool from_stdin = false;  // its path comes in line by line
  ManipulatorPath path;     // of from_stdin: the keys that are still needed
  double taken = 0;         // s, of the run, when the last pose came in

  // What acted on it since the last frame, but what leads it: sums of force x time and of torque x time about
  // the path's `about` as it is then, over `seconds`.
  Vec3 impulse = Vec3::Zero(), turning = Vec3::Zero();  // N s, N m s
  double seconds = 0;

  // It is there at the line's time, evenly on the way from the key before, which has to be earlier:
  // InputError (place, ...).
  void add_key(const PoseLine& line, const std::string& origin);
  // At `now` s: it is there at the line's time or, where that has passed, after as long as the last pose is
  // ago, at least `least` s. What was to come after that is off.
  void lead_to(const PoseLine& line, double now, double least);
  // Keys that `now` s has passed go.
  void forget(double now);
};

}  // namespace flexel::simulate
