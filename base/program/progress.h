// What a program says while it works. Everything goes to stderr: stdout belongs to the result.
#pragma once
#include <fmt/format.h>

#include <string>

namespace flexel {

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
  void clear_bar();
  std::string program_;
  Mode mode_;
  std::string stage_;
  bool bar_drawn_ = false;
  double stage_began_ = 0;
  double last_drawn_ = -1;
};

}  // namespace flexel
