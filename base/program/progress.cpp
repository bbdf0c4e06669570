// Progress on stderr. The bar is one line that is rewritten in place (carriage return, erase to the end of
// the line); anything else that is printed clears it first, and the next update draws it again.
#include "base/program/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string_view>
#include <utility>

#include "base/human.h"
#include "base/printable.h"
#include "base/program/brief_output.h"
#include "base/program/silent_updates.h"

namespace flexel {
namespace {

ProgressListener* listener = nullptr;
SilentUpdate silent_update = nullptr;
const Progress* bar_of = nullptr;  // whose bar is on the last line of the terminal
bool brief_output = false, holds_warnings = false, keeps_warnings = false;
std::vector<std::string> held_warnings, kept_warnings;
std::string held_program;  // that gave the last of them

constexpr double kDrawInterval = 0.1;  // s
constexpr int kBarWidth = 24;          // characters

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void print_error(const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stderr);
}

void erase_bar() {
  if (std::exchange(bar_of, nullptr) != nullptr) print_error("\r\033[K");
}

Progress::Mode resolve(Progress::Mode mode) {
  if (mode != Progress::Mode::automatic) return mode;
  const char* terminal = std::getenv("TERM");
  const bool can_rewrite = terminal != nullptr && std::string_view(terminal) != "dumb";
  return isatty(STDERR_FILENO) != 0 && can_rewrite ? Progress::Mode::bar : Progress::Mode::lines;
}

std::size_t terminal_columns() {
  winsize size = {};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

void set_progress_listener(ProgressListener* to) noexcept {
  listener = to;
}

void set_silent_update(SilentUpdate hears) noexcept {
  silent_update = hears;
}

std::optional<double> seconds_left(double seconds, double share) {
  constexpr double kSoonest = 2, kLeastShare = 0.02;  // s; before that it is a guess
  if (seconds < kSoonest || !(share >= kLeastShare && share < 1)) return {};
  return seconds * (1 - share) / share;
}

BriefOutput::BriefOutput(bool brief) {
  brief_output = brief;
}

BriefOutput::~BriefOutput() {
  brief_output = false;
}

HeldWarnings::HeldWarnings() : exceptions_(std::uncaught_exceptions()) {
  holds_warnings = true;
}

HeldWarnings::~HeldWarnings() {
  holds_warnings = false;
  if (std::uncaught_exceptions() > exceptions_) {
    if (!held_warnings.empty()) erase_bar();
    for (const std::string& line : held_warnings)
      print_error(fmt::format("{}: warning: {}\n", held_program, printable(line)));
  }
  held_warnings.clear();
}

std::vector<std::string> HeldWarnings::take() {
  return std::exchange(held_warnings, {});
}

KeptWarnings::KeptWarnings()
    : outer_(std::exchange(kept_warnings, {})), outer_keeps_(std::exchange(keeps_warnings, true)) {}

KeptWarnings::~KeptWarnings() {
  keeps_warnings = outer_keeps_;
  kept_warnings = std::move(outer_);
}

std::vector<std::string> KeptWarnings::lines() const {
  return kept_warnings;
}

Progress::Progress(std::string program, Mode mode) : program_(std::move(program)), mode_(resolve(mode)) {}

Progress::~Progress() {
  // A stage that an exception ended was not finished.
  if (std::uncaught_exceptions() > 0)
    clear_own_bar();
  else
    finish();
}

void Progress::stage(const std::string& name) {
  if (mode_ == Mode::silent) return;
  finish();
  stage_ = name;
  stage_began_ = now();
  last_drawn_ = -1;
  last_share_ = 0;
  update(0);
}

void Progress::update(double share, const std::string& note) {
  if (mode_ == Mode::silent || mode_ == Mode::quiet) {
    if (silent_update != nullptr) silent_update(*this, share, note);
    return;
  }
  const bool listening = listener != nullptr;
  if ((mode_ != Mode::bar && !listening) || stage_.empty()) return;
  const double time = now(), done = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0.0;
  const bool gets_going = last_share_ == 0 && done > 0;  // told however short the stage is
  if (last_drawn_ >= 0 && !gets_going && time - last_drawn_ < kDrawInterval) return;
  last_drawn_ = time;
  last_share_ = done;
  const std::optional<double> left = seconds_left(time - stage_began_, done);
  if (listening) return listener->update(stage_, done, note, left);
  const auto filled = static_cast<std::size_t>(std::lround(done * kBarWidth));
  std::string line = fmt::format("{}: {} [{}{}] {:3.0f} %", program_, stage_, std::string(filled, '#'),
                                 std::string(kBarWidth - filled, '.'), std::floor(100 * done));
  if (left) line += fmt::format("  {} left", human_seconds(*left));
  if (!note.empty()) line += "  " + printable(note);
  const std::size_t columns = terminal_columns();
  if (line.size() >= columns) line.resize(columns - 1);  // a wrapped line could not be rewritten
  print_error("\r" + line + "\033[K");
  bar_of = this;
}

void Progress::say(const std::string& line) {
  if (mode_ == Mode::quiet || mode_ == Mode::silent || brief_output) return;
  if (listener != nullptr) return listener->say(line);
  erase_bar();  // of whichever Progress: this may be a run within a run, or around one
  print_error(fmt::format("{}: {}\n", program_, printable(line)));
}

void Progress::warn(const std::string& line) {
  if (mode_ == Mode::silent) return;
  const auto add_to = [&](std::vector<std::string>& lines) {
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
  };
  if (holds_warnings) {
    held_program = program_;
    add_to(held_warnings);
    return;
  }
  if (keeps_warnings) add_to(kept_warnings);
  if (listener != nullptr) return listener->warn(line);
  erase_bar();
  print_error(fmt::format("{}: warning: {}\n", program_, printable(line)));
}

void Progress::finish() {
  clear_own_bar();
  if (mode_ == Mode::lines && listener == nullptr && !stage_.empty() && !brief_output) {
    const double seconds = now() - stage_began_;
    print_error(fmt::format("{}: {}: {:.{}f} s\n", program_, stage_, seconds, seconds < 1 ? 4 : 2));
  }
  stage_.clear();
}

void Progress::clear_own_bar() {
  if (bar_of == this) erase_bar();
}

}  // namespace flexel
