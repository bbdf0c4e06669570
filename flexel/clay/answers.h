// How a part answered to the last motions of its tools: what predicts its answer to the next.
#pragma once
#include <vector>

#include "flexel/clay/tool_pose.h"

namespace flexel::clay {

using Way = std::vector<ToolPose>;  // (tools) of one motion

// m^2; turns count as what they move at `arm` m from their axis.
[[nodiscard]] double dot(const Way& a, const Way& b, double arm);
[[nodiscard]] Way way_between(const Way& from, const Way& to);

class Answers {
 public:
  // `arm` [m]: how large a tool is.
  explicit Answers(double arm) : arm_(arm) {}

  [[nodiscard]] bool empty() const { return known_.empty(); }
  // The elements went from `before` to `after` [m] while the tools went `way`. A way that is lost in rounding teaches nothing.
  void learn(Way way, const std::vector<Vec3>& before, const std::vector<Vec3>& after);
  // Adds to `displacement` (elements) [m] what the elements are expected to answer to `way`, to first order.
  void add(Way way, std::vector<Vec3>& displacement) const;

 private:
  struct Known {
    Way way;
    std::vector<Vec3> answer;  // (elements) m
  };
  double arm_;
  std::vector<Known> known_;  // the newest first, each way perpendicular to the others
};

}  // namespace flexel::clay
