// A run within a run, as the display of the whole shows it.
#pragma once
#include <string>

#include "base/program/progress.h"

namespace flexel {

// What is told to inner() is not printed, but its updates move the stage of `whole` from one share to another, never
// back: a stage of inner() that begins anew waits. Lives no longer than `whole`; not thread-safe, as Progress.
class ProgressStretch {
 public:
  ProgressStretch(Progress& whole, double from, double to);
  // Warnings of inner() are printed, as those of this program.
  ProgressStretch(Progress& whole, double from, double to, const std::string& warns_as);
  ~ProgressStretch();
  ProgressStretch(const ProgressStretch&) = delete;
  ProgressStretch& operator=(const ProgressStretch&) = delete;
  [[nodiscard]] Progress& inner() { return inner_; }

 private:
  ProgressStretch(Progress& whole, double from, double to, const std::string& program, Progress::Mode mode);
  static void pass_on(const Progress& inner, double share, const std::string& note);
  static ProgressStretch* last_;
  Progress& whole_;
  double from_, to_, furthest_ = 0;
  Progress inner_;
  ProgressStretch* before_;
};

}  // namespace flexel
