// A run's link to the world outside: poses in, frames out, and real time kept (docs/guide/live.md).
//
// Frames leave at a steady rate by the clock on the wall. Between two of them the run steps on until it has
// reached the time of the next, and waits for it, or hurries: a run that is behind by more than half of the
// time between two frames writes a late one, of where it has come to, and lets the time go that it lacks.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "base/program/progress.h"
#include "simulate/live/frame_sinks.h"
#include "simulate/live/pose_feed.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

class LiveLink {
 public:
  // Whether the run has one: `path = "stdin"` in the scene, or --live.
  [[nodiscard]] static bool wanted(const Scene& scene, const SimulateOptions& options);

  // Gives the manipulators of `scene` what they share with it. `body` and `options` must outlive it.
  // `interrupt` may throw, and is called while the run waits. Throws InputError.
  LiveLink(Scene& scene, const Body& body, const SimulateOptions& options, Progress& progress,
           std::function<void()> interrupt);

  // Where the run does not keep real time: waits until every pose up to `until` s is known.
  void await(double until);
  // Before the first step, at `now` s: the clock starts.
  void start(const State& state);
  // After a step: takes up poses, writes frames, waits.
  void keep_pace(const State& state);
  // After the last one.
  [[nodiscard]] LiveSummary finish(const State& state);
  [[nodiscard]] bool ended() const { return feed_ && feed_->ended(); }

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double wall() const;  // s, since the clock started
  void wait_until(double wall);
  void write_frame(const State& state, bool late);
  [[nodiscard]] std::string header() const;

  const Body& body_;
  const SimulateOptions& options_;
  Progress& progress_;
  std::function<void()> interrupt_;
  std::vector<std::shared_ptr<LiveTool>> tools_;  // all manipulators, in the scene's order
  std::optional<PoseFeed> feed_;
  std::optional<FrameSinks> outlets_;
  Clock::time_point began_;
  Clock::time_point looked_;
  double anchor_ = 0;        // s: time of the run less that on the wall
  std::uint64_t tick_ = 0;   // the frame that is due next, at tick_ / rate on the wall
  double time_ = 0;          // s, of the run, as keep_pace() last had it
  double last_written_ = 0;  // s, on the wall
  std::vector<Vec3> felt_;   // (tools x 2) N, N m: of the last frame
  LiveSummary summary_;
};

}  // namespace flexel::simulate
