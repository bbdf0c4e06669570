// How a load or a move goes on in time: a factor, linear between given times.
#pragma once
#include <optional>
#include <vector>

#include "simulate/input/scene_table.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

struct TimeCurve {
  std::vector<double> time;    // s, ascending; empty: no course was given
  std::vector<double> factor;  // (times); constant before the first and after the last

  // The factor at `state`: of its time in a timed run, else its load share. Without a course: 1, or the
  // share.
  [[nodiscard]] double at(const State& state) const;
};

// The keys `time` and `factor` of a table: ["0 s", "1 s"] and [0, 1]. Throws InputError: one without the
// other, lengths that differ, times that do not ascend.
[[nodiscard]] TimeCurve parse_course(TableReader& reader);

}  // namespace flexel::simulate
