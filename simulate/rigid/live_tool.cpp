// Keys of a path that grows at its end and is forgotten at its beginning.
#include "simulate/rigid/live_tool.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"

namespace flexel::simulate {
namespace {

// A device that says nothing for longer than this has stopped; what it says next is taken up no slower.
constexpr double kLongest = 0.1;  // s

}  // namespace

void LiveTool::add_key(const PoseLine& line, const std::string& origin) {
  if (!path.time.empty() && !(line.time > path.time.back()))
    throw InputError(origin, fmt::format("the times of \"{}\" need to ascend: {:.6g} s after {:.6g} s", name,
                                         line.time, path.time.back()));
  path.turn.push_back(line.whole_turns || path.turn.empty() ? line.turn
                                                            : nearest_turn(line.turn, path.turn.back()));
  path.time.push_back(line.time);
  path.displacement.push_back(line.displacement);
}

void LiveTool::lead_to(const PoseLine& line, double now, double least) {
  PoseLine next = line;
  if (!(next.time > now)) next.time = now + std::max(least, std::min(now - taken, kLongest));
  taken = now;
  const ManipulatorPath::Key here = path.key(now);
  while (!path.time.empty() && path.time.back() >= next.time) {
    path.time.pop_back();
    path.displacement.pop_back();
    path.turn.pop_back();
  }
  if (path.time.empty() || path.time.back() < now) {
    path.turn.push_back(path.turn.empty() ? here.turn : nearest_turn(here.turn, path.turn.back()));
    path.time.push_back(now);
    path.displacement.push_back(here.displacement);
  }
  add_key(next, name);
  forget(now);
}

void LiveTool::forget(double now) {
  const auto passed = std::upper_bound(path.time.begin(), path.time.end(), now) - path.time.begin() - 1;
  if (passed <= 0) return;
  path.time.erase(path.time.begin(), path.time.begin() + passed);
  path.displacement.erase(path.displacement.begin(), path.displacement.begin() + passed);
  path.turn.erase(path.turn.begin(), path.turn.begin() + passed);
}

}  // namespace flexel::simulate
