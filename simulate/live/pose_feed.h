// Poses from stdin: lines to the tools that they lead.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "simulate/rigid/live_tool.h"

namespace flexel::simulate {

class PoseFeed {
 public:
  // The tools that are led from stdin. Throws InputError: stdin is a terminal; two tools and a name that a
  // line cannot have.
  explicit PoseFeed(std::vector<std::shared_ptr<LiveTool>> tools);

  // Takes up what has come in, as of `now` s of the run; does not wait. `least` as of LiveTool::lead_to.
  void take(double now, double least);
  // Waits at most a tenth of a second for lines, and takes them up as keys of the paths. For runs that wait
  // for their poses.
  void wait();
  // Whether every path reaches `until` s, or no line will come any more.
  [[nodiscard]] bool reaches(double until) const;
  void forget(double now);

  [[nodiscard]] bool closed() const { return closed_; }         // at the end of stdin
  [[nodiscard]] bool ended() const { return ended_; }           // by a line "end"
  [[nodiscard]] std::uint64_t line() const { return line_; }    // that was taken up last, from 1
  [[nodiscard]] std::uint64_t poses() const { return poses_; }  // so far

 private:
  void read();
  template <class Take>
  void take_lines(const Take& take);
  LiveTool& tool_of(const PoseLine& pose, const std::string& place) const;

  std::vector<std::shared_ptr<LiveTool>> tools_;
  std::string buffer_;
  bool closed_ = false, ended_ = false;
  std::uint64_t line_ = 0, poses_ = 0;
};

}  // namespace flexel::simulate
