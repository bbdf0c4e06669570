// The clock, and the frames' bytes.
#include "simulate/live/live_link.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/json.h"
#include "simulate/effects/rigid.h"

namespace flexel::simulate {
namespace {

constexpr double kLook = 1e-4;         // s, on the wall, between two looks at stdin while the run steps
constexpr double kLongestWait = 0.05;  // s, after which an interrupt is looked for

static_assert(std::endian::native == std::endian::little, "frames are little-endian");

void add_numbers(std::string& line, const Vec3& a, const Vec3& b) {
  append_text(line, "[{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}]", a.x(), a.y(), a.z(), b.x(), b.y(), b.z());
}

}  // namespace

bool LiveLink::wanted(const Scene& scene, const SimulateOptions& options) {
  const auto& manipulators = scene.get<RigidParts>().manipulators;
  return !options.live.empty() ||
         std::any_of(manipulators.begin(), manipulators.end(), [](const auto& each) { return each.live; });
}

LiveLink::LiveLink(Scene& scene, const Body& body, const SimulateOptions& options, Progress& progress,
                   std::function<void()> interrupt)
    : body_(body), options_(options), progress_(progress), interrupt_(std::move(interrupt)) {
  std::vector<std::shared_ptr<LiveTool>> led;
  for (Manipulator& each : scene.get<RigidParts>().manipulators) {
    if (!each.live) each.live = std::make_shared<LiveTool>(LiveTool{each.name, false, each.path});
    tools_.push_back(each.live);
    if (each.live->from_stdin) led.push_back(each.live);
  }
  felt_.assign(2 * tools_.size(), Vec3::Zero());
  if (!led.empty() && !options.checkpoint.empty())
    throw InputError(scene.name,
                     "path = \"stdin\" and --checkpoint: the poses would be lost; leave --checkpoint out");
  if (!led.empty()) feed_.emplace(led);
  if (options.live.empty()) return;
  outlets_.emplace(options.live);
  if (outlets_->listener() >= 0) progress.say(fmt::format("frames at {}", outlets_->name()));
  (void)::prctl(PR_SET_TIMERSLACK, 1UL);  // waits end when they should, to a microsecond
}

double LiveLink::wall() const {
  return std::chrono::duration<double>(Clock::now() - began_).count();
}

void LiveLink::await(double until) {
  if (outlets_ || !feed_) return;
  while (!feed_->reaches(until)) {
    interrupt_();
    feed_->wait();
  }
  if (feed_->closed() && feed_->poses() == 0)
    throw InputError("stdin is empty: the program that should write poses failed or wrote nothing");
}

void LiveLink::start(const State& state) {
  began_ = looked_ = Clock::now();
  anchor_ = *state.time;
  if (outlets_) keep_pace(state);
}

// Readers and poses that come while the run waits are seen to at once.
void LiveLink::wait_until(double end) {
  for (double left = 0; (left = end - wall()) > 0 && !ended();) {
    interrupt_();
    std::array<pollfd, 2> wait = {
        {{feed_ && !feed_->closed() ? STDIN_FILENO : -1, POLLIN, 0}, {outlets_->listener(), POLLIN, 0}}};
    const auto nanoseconds = static_cast<long>(1e9 * std::min(left, kLongestWait));
    const timespec time = {0, nanoseconds};
    if (::ppoll(wait.data(), wait.size(), &time, nullptr) <= 0) continue;
    if (wait[1].revents) outlets_->let_in(header());
    if (wait[0].revents) feed_->take(time_, 1 / options_.live_rate);
  }
}

void LiveLink::keep_pace(const State& state) {
  if (!outlets_) {
    feed_->forget(*state.time);
    return;
  }
  const double interval = 1 / options_.live_rate;
  time_ = *state.time;
  for (;;) {
    const auto now = Clock::now();
    if (feed_ && std::chrono::duration<double>(now - looked_).count() > kLook) {
      looked_ = now;
      feed_->take(*state.time, interval);
    }
    const double due = static_cast<double>(tick_) * interval;  // on the wall
    const double behind = anchor_ + due - *state.time;
    const bool there = behind <= 1e-9 * (1 + *state.time);
    if (there) wait_until(due);
    if (wall() < due || ended()) return;
    const bool late = behind > 0.5 * interval;
    if (late) {
      anchor_ -= behind;
      summary_.behind += behind;
    }
    write_frame(state, late);
    const double written = wall();
    if (tick_ > 0) {
      const double error = std::abs(written - last_written_ - interval);
      summary_.jitter_squared += error * error;
      summary_.worst_jitter = std::max(summary_.worst_jitter, error);
    }
    last_written_ = written;
    ++tick_;
    // a step that took longer than the time between two frames
    while (static_cast<double>(tick_ + 1) * interval <= wall()) {
      ++tick_;
      ++summary_.missed;
    }
  }
}

std::string LiveLink::header() const {
  nlohmann::ordered_json json = {{"flexel-live", 1},
                                 {"rate", options_.live_rate},
                                 {"state_every", options_.live_state},
                                 {"elements", body_.element_count()}};
  json["parts"] = nlohmann::ordered_json::array();
  for (const Part& part : body_.parts)
    json["parts"].push_back({{"name", part.name}, {"begin", part.element_begin}, {"end", part.element_end}});
  json["tools"] = nlohmann::ordered_json::array();
  for (const auto& tool : tools_) json["tools"].push_back(tool->name);
  return json_text(json) + "\n";
}

void LiveLink::write_frame(const State& state, bool late) {
  outlets_->let_in(header());
  const std::uint64_t number = summary_.frames++;
  summary_.late += late;
  std::string frame = fmt::format(R"({{"frame":{},"time":{:.9g},"late":{},"line":{},"felt":[)", number,
                                  *state.time, late, feed_ ? feed_->line() : 0);
  std::string places;
  for (std::size_t t = 0; t < tools_.size(); ++t) {
    LiveTool& tool = *tools_[t];
    if (tool.seconds > 0) {
      felt_[2 * t] = tool.impulse / tool.seconds;
      felt_[2 * t + 1] = tool.turning / tool.seconds;
    }
    tool.impulse = tool.turning = Vec3::Zero();
    tool.seconds = 0;
    if (t > 0) {
      frame += ',';
      places += ',';
    }
    add_numbers(frame, felt_[2 * t], felt_[2 * t + 1]);
    const ManipulatorPath::Key key = tool.path.key(*state.time);
    add_numbers(places, key.displacement, key.turn);
  }
  const bool whole = options_.live_state > 0 && number % static_cast<std::uint64_t>(options_.live_state) == 0;
  const std::size_t count = whole ? 3 * state.displacement.size() : 0;
  append_text(frame, "],\"place\":[{}],\"bytes\":{}}}\n", places, count * sizeof(float));
  const std::size_t begin = frame.size();
  frame.resize(begin + count * sizeof(float));
  for (std::size_t e = 0; 3 * e < count; ++e) {
    const Eigen::Vector3f at = (body_.rest[e] + state.displacement[e]).cast<float>();
    std::copy_n(reinterpret_cast<const char*>(at.data()), 3 * sizeof(float),
                frame.data() + begin + 3 * e * sizeof(float));
  }
  outlets_->send(frame);
}

LiveSummary LiveLink::finish(const State& state) {
  if (outlets_) {
    write_frame(state, false);
    outlets_->flush();
    summary_.dropped = outlets_->dropped();
    summary_.readers = outlets_->readers();
    summary_.rate = options_.live_rate;
  }
  if (feed_) {
    summary_.poses = feed_->poses();
    summary_.poses_ended = feed_->closed();
  }
  return summary_;
}

}  // namespace flexel::simulate
