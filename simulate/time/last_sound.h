// The last state of a timed run that was sound: what a run that fails leaves.
#pragma once
#include <array>
#include <vector>

#include "base/parallel.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// In single precision: it is there to be looked at, and costs memory all along.
class LastSound {
 public:
  void keep(const State& state) {
    time_ = *state.time;
    values_.resize(state.displacement.size());
    parallel_for_each(values_.size(), [&](std::size_t e) {
      for (std::size_t j = 0; j < 3; ++j) {
        const auto axis = static_cast<Eigen::Index>(j);
        values_[e][j] = static_cast<float>(state.displacement[e][axis]);
        values_[e][3 + j] = static_cast<float>(state.velocity[e][axis]);
      }
    });
  }
  [[nodiscard]] double time() const { return time_; }  // s
  [[nodiscard]] bool empty() const { return values_.empty(); }
  [[nodiscard]] State state() const {
    State state;
    state.time = time_;
    for (const std::array<float, 6>& v : values_) {
      state.displacement.emplace_back(v[0], v[1], v[2]);
      state.velocity.emplace_back(v[3], v[4], v[5]);
    }
    return state;
  }

 private:
  double time_ = 0;                           // s
  std::vector<std::array<float, 6>> values_;  // (elements) m, m/s
};

}  // namespace flexel::simulate
