// What a program says while it works. Everything goes to stderr: stdout belongs to the result.
#pragma once
#include <fmt/format.h>

#include <optional>
#include <string>

namespace flexel {

// Hears what every Progress of the process says, in place of stderr: for a program that Flexel is a library of. Called on
// the thread of the run.
class ProgressListener {
 public:
  ProgressListener() = default;
  virtual ~ProgressListener() = default;
  ProgressListener(const ProgressListener&) = delete;
  ProgressListener& operator=(const ProgressListener&) = delete;
  // As Progress::update(); `left`: s, as seconds_left() has it.
  virtual void update(const std::string& stage, double share, const std::string& note,
                      std::optional<double> left) noexcept = 0;
  virtual void say(const std::string& line) noexcept = 0;
  virtual void warn(const std::string& line) noexcept = 0;
};
// Null: stderr again.
void set_progress_listener(ProgressListener* listener) noexcept;

// Of a stage that took `seconds` for `share` of its work, were the rest as fast; nothing before it can be told.
[[nodiscard]] std::optional<double> seconds_left(double seconds, double share);

// One display for a whole run, whichever stages run in it: a bar on a terminal, a line per finished stage in
// a log, nothing but warnings when quiet, nothing at all when silent (a run within a run). Not thread-safe:
// call from the thread that owns the run.
class Progress {
 public:
  enum class Mode { automatic, bar, lines, quiet, silent };
  explicit Progress(std::string program, Mode mode = Mode::automatic);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // A stage begins ("voxelize"); the one before it ends.
  void stage(const std::string& name);
  // Share of the stage that is done, in [0, 1], and a short note ("newton 3, residual 1e-4"). Drawn at most
  // 10 times a second.
  void update(double share, const std::string& note = "");
  // A line for the user, above the bar: "flexel-voxelize: 51,234 elements ...". Printed in every mode but
  // quiet.
  void say(const std::string& line);
  // The same, as "flexel-voxelize: warning: ...". Printed in every mode.
  void warn(const std::string& line);
  // Ends the current stage; clears the bar.
  void finish();

 private:
  void clear_own_bar();
  std::string program_;
  Mode mode_;
  std::string stage_;
  double stage_began_ = 0;
  double last_drawn_ = -1;
  double last_share_ = 0;
};

}  // namespace flexel
