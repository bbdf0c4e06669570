// Shortens the output of a run to what a user needs (without --verbose).
#pragma once
#include <string>
#include <vector>

namespace flexel {

// While one lives, Progress::say() prints nothing and stages leave no line; warnings and the bar stay.
// Process-wide, as ThreadLimit is; not nested.
class BriefOutput {
 public:
  explicit BriefOutput(bool brief);
  ~BriefOutput();
  BriefOutput(const BriefOutput&) = delete;
  BriefOutput& operator=(const BriefOutput&) = delete;
};

// While one lives, Progress::warn() prints nothing but keeps each different line: those of a run that is only
// tried. An exception that leaves its scope prints them. Process-wide; not nested.
class HeldWarnings {
 public:
  HeldWarnings();
  ~HeldWarnings();
  HeldWarnings(const HeldWarnings&) = delete;
  HeldWarnings& operator=(const HeldWarnings&) = delete;
  // The lines held so far, which are then forgotten.
  [[nodiscard]] std::vector<std::string> take();

 private:
  int exceptions_;
};

// While one lives, each different line that Progress::warn() prints is kept too, for whoever shows it again. Process-wide; of
// one within another (a run that a callback of Python's starts) each line is kept by the inner one alone.
class KeptWarnings {
 public:
  KeptWarnings();
  ~KeptWarnings();
  KeptWarnings(const KeptWarnings&) = delete;
  KeptWarnings& operator=(const KeptWarnings&) = delete;
  [[nodiscard]] std::vector<std::string> lines() const;

 private:
  std::vector<std::string> outer_;
  bool outer_keeps_;
};

}  // namespace flexel
