// gmsh tells percents and the largest tetrahedron, but for its longest step, the second order, nothing.
#include "flexel/export/gmsh_log.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace flexel::mesh_export {
namespace {

// The line that a step begins with, and the share of the time before it: of a bored block of 170,000 tetrahedra
// that took 17 s, and smaller ones.
struct Step {
  const char* line;
  double begins;
};
constexpr std::array<Step, 7> kSteps = {{{"Meshing 1D", 0.01},
                                         {"Meshing 2D", 0.02},
                                         {"Meshing 3D", 0.05},
                                         {"Optimizing mesh", 0.38},
                                         {"Meshing order 2", 0.44},
                                         {"Optimizing mesh", 0.84},
                                         {"Writing", 0.93}}};

// Of the step, where the line says it: "[ 20%]", or the largest tetrahedron over the wanted size, which falls to 1.
double share_in(const std::string& line) {
  constexpr const char* kRadius = "worst tet radius ";
  if (const std::size_t at = line.find(kRadius); at != std::string::npos) {
    const double over = std::strtod(line.c_str() + at + std::char_traits<char>::length(kRadius), nullptr) - 1;
    return std::clamp(1 - std::sqrt(std::max(0.0, over)), 0.0, 1.0);
  }
  const std::size_t open = line.find('['), percent = line.find("%]");
  if (open == std::string::npos || percent == std::string::npos || percent < open) return -1;
  return std::clamp(std::strtod(line.c_str() + open + 1, nullptr) / 100, 0.0, 1.0);
}

}  // namespace

void GmshLog::take(const std::string& line, double seconds) {
  for (std::size_t s = next_; s < kSteps.size(); ++s)
    if (line.find(kSteps[s].line) != std::string::npos && line.find("Done") == std::string::npos) {
      next_ = s + 1;
      began_ = seconds;
      inside_ = -1;
      return;
    }
  // Of the second order gmsh tells the curves and faces, which take no time beside the solids.
  const bool told = next_ >= 1 && next_ <= 3;
  if (const double share = told ? share_in(line) : -1; share >= 0) inside_ = std::max(inside_, share);
}

void GmshLog::add(std::string_view text, double seconds) {
  for (const char c : text)
    if (c == '\n') {
      take(open_, seconds);
      open_.clear();
    } else {
      open_ += c;
    }
}

double GmshLog::share(double seconds) const {
  if (next_ == 0) return 0;
  const double from = kSteps[next_ - 1].begins, to = next_ < kSteps.size() ? kSteps[next_].begins : 1;
  if (inside_ >= 0) return from + inside_ * (to - from);
  return began_ > 0 ? std::clamp(from * seconds / began_, from, to) : from;
}

}  // namespace flexel::mesh_export
