// Frequencies with five digits: what the iteration leaves over is far below.
#include "simulate/mode_lines.h"

#include <fmt/format.h>

#include "base/human.h"
#include "base/units.h"

namespace flexel::simulate {

std::vector<std::string> mode_lines(const ModesSummary& summary, double mass) {
  std::vector<std::string> lines;
  Vec3 sum = Vec3::Zero();
  std::string head = fmt::format("{}      {}", summary.buckling ? "shapes" : "modes ", summary.modes.size());
  if (summary.rigid > 0) head += fmt::format(", and {} rigid motions at 0 Hz", summary.rigid);
  if (summary.prestressed) head += ", about the equilibrium that the body is in";
  lines.push_back(head);
  for (std::size_t m = 0; m < summary.modes.size(); ++m) {
    const Mode& mode = summary.modes[m];
    if (summary.buckling) {
      lines.push_back(fmt::format("{:>3}  {:>12.5g} times the loads", m + 1, mode.load_factor));
      continue;
    }
    sum += mode.effective_mass;
    const Vec3 share = mass > 0 ? Vec3(100 / mass * mode.effective_mass) : Vec3(Vec3::Zero());
    lines.push_back(fmt::format("{:>3}  {:>12.5g} Hz   effective mass {:5.1f} % x  {:5.1f} % y  {:5.1f} % z",
                                m + 1, mode.frequency, share.x(), share.y(), share.z()));
  }
  if (!summary.buckling && mass > 0)
    lines.push_back(fmt::format("     in all {:>15} effective mass {:5.1f} % x  {:5.1f} % y  {:5.1f} % z", "",
                                100 * sum.x() / mass, 100 * sum.y() / mass, 100 * sum.z() / mass));
  lines.push_back(fmt::format("written   each shape goes {} at most: its size means nothing",
                              human_length(summary.shape)));
  return lines;
}

}  // namespace flexel::simulate
