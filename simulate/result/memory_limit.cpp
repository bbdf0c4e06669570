// What model quadratic holds by the counts of its cells, and the refusal of what is beyond a limit.
#include "simulate/result/memory_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/resources.h"
#include "base/units.h"
#include "formats/lattice/cell_moments.h"

namespace flexel::simulate {
namespace {

constexpr double kSure = 1.3;             // what the estimate may be off by
constexpr double kProgramAndBody = 15e6;  // bytes
// Of model `quadratic`, bytes: whole cells share one matrix until they turn with their matter; cells that the surface
// cuts have one each, and a factor of it, and so have those that are held. Of whole cells that have turned by over .02 rad
// all are in memory at once while a preconditioner is made.
constexpr double kQuadraticNode = 1250, kCutCell = 24e3, kHeldCell = 79e3, kTurnedCell = 28e3;

}  // namespace

MemoryNeeded quadratic_memory(const Body& body, std::size_t held) {
  const auto elements = static_cast<double>(body.element_count()),
             cells = static_cast<double>(body.cell_count());
  const auto cut = static_cast<double>(
      std::count_if(body.fill.begin(), body.fill.end(), [](double fill) { return fill < kWholeFill; }));
  const double nodes = 4 * (elements + cells);
  MemoryNeeded needed;
  needed.bytes =
      kProgramAndBody + kQuadraticNode * nodes + kCutCell * cut + kHeldCell * static_cast<double>(held);
  needed.with_large_deflections = needed.bytes + kTurnedCell * (cells - cut);
  return needed;
}

double moving_memory(double elements) {
  constexpr double kSmallProgram = 15e6, kMovingElement = 520;  // bytes
  return kSmallProgram + kMovingElement * elements;
}

void refuse_beyond_memory(double bytes, const std::string& what, const std::string& scene) {
  const bool limited = std::isfinite(memory_limit());
  const double most = limited ? memory_limit() : available_memory();
  if (bytes <= kSure * most) return;
  throw InputError(
      scene, fmt::format("this run needs about {} ({}), more than {} {}: voxelize with a larger --size{}",
                         human_bytes(bytes), what, limited ? "the limit of" : "the free memory of",
                         human_bytes(most), limited ? ", or raise --max-memory" : ""));
}

}  // namespace flexel::simulate
