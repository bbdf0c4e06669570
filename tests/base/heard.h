// What a listener of Progress hears.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/program/progress.h"

namespace flexel::test {

// Hears every Progress of the process while it lives.
class Heard : public ProgressListener {
 public:
  Heard() { set_progress_listener(this); }
  ~Heard() override { set_progress_listener(nullptr); }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;
  void update(const std::string& stage, double share, const std::string& note,
              std::optional<double> left) noexcept override {
    stages.push_back(stage);
    shares.push_back(share);
    notes.push_back(note);
    had_left = had_left || left.has_value();
  }
  void say(const std::string& line) noexcept override { lines.push_back(line); }
  void warn(const std::string& line) noexcept override { lines.push_back(line); }
  std::vector<std::string> stages, notes, lines;
  std::vector<double> shares;
  bool had_left = false;
};

// Updates sooner than that are not shown.
inline void wait_for_update() {
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
}

}  // namespace flexel::test
