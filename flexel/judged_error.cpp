// Safety factors of Roache (1994); the largest of what two ways tell.
#include "flexel/judged_error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace flexel {
namespace {

constexpr double kConfirmed = 1.25, kUnconfirmed = 3;
constexpr double kLeastOrder = 1, kMostOrder = 2;
constexpr double kMostConfirmed = 2.1;  // a higher order is chance (simulate/estimate.h)
constexpr double kSmall = 1e-3;         // of the largest displacement: a probe that hardly moves

std::optional<Bar> bar_of(const SolvedRun& run, ErrorBar::Of of, std::size_t probe) {
  for (const ErrorBar& each : run.simulated.error_bars.bars)
    if (each.of == of && each.probe == probe) return each.bar;
  return std::nullopt;
}

// The ratio of the spacings of run i and the next, finer one.
double ratio_after(const std::vector<SolvedRun>& runs, std::size_t i) {
  return spacing_of(runs[i]) / spacing_of(runs[i + 1]);
}

// Of one quantity; `coarser` is that of the run before the coarse one, where there is one. A bar of the run
// itself speaks of its own lattice made coarser, the runs of lattices laid anew: neither is believed to be
// nearer than the other says.
Judged judge(const Quantity& fine, const Quantity& coarse, const Quantity* coarser,
             const std::array<double, 2>& ratio) {
  const double step = std::abs(fine.value - coarse.value);
  Judged found{kUnconfirmed * step / (ratio[0] - 1), kLeastOrder, fine.name};
  const auto confirmed = [](const std::optional<double>& order) { return order && *order <= kMostConfirmed; };
  if (fine.bar && confirmed(fine.bar->order)) {
    found.order = std::clamp(*fine.bar->order, kLeastOrder, kMostOrder);
    found.error = kConfirmed * step / (std::pow(ratio[0], found.order) - 1);
  }
  if (coarser != nullptr)
    if (const Bar three = richardson({{fine.value, coarse.value, coarser->value}, ratio}); three.order) {
      found.error = three.half_width;
      found.order = std::clamp(*three.order, kLeastOrder, kMostOrder);
    }
  if (fine.bar) found.error = std::max(found.error, fine.bar->half_width);
  found.error /= std::abs(fine.value);
  return found;
}

}  // namespace

std::vector<Quantity> Quantities::of(const SolvedRun& run, const SolvedRun& last) const {
  std::vector<Quantity> found;
  std::size_t most = 0;
  for (std::size_t v = 0; v < last.mapped.size(); ++v)
    if (last.mapped[v].squaredNorm() > last.mapped[most].squaredNorm()) most = v;
  const double largest = last.mapped.empty() ? 0 : last.mapped[most].norm();
  const auto along = [](const Vec3& moved, const Vec3& direction) {
    return direction.norm() > 0 ? moved.dot(direction.normalized()) : moved.norm();
  };
  for (std::size_t p = 0; p < last.simulated.probes.size(); ++p) {
    const Vec3& direction = last.simulated.probes[p].displacement;
    if (direction.norm() < kSmall * largest) continue;
    found.push_back({"probe " + last.simulated.probes[p].name,
                     along(run.simulated.probes[p].displacement, direction),
                     bar_of(run, ErrorBar::Of::probe, p)});
  }
  if (found.empty() && !last.mapped.empty())
    found.push_back({"largest displacement", along(run.mapped[most], last.mapped[most]),
                     bar_of(run, ErrorBar::Of::largest_displacement, 0)});
  if (driven_ && last.simulated.elastic_energy > 0)
    found.push_back(
        {"elastic energy", run.simulated.elastic_energy, bar_of(run, ErrorBar::Of::elastic_energy, 0)});
  return found;
}

double spacing_of(const SolvedRun& run) {
  double sum = 0;
  for (const Part& part : run.voxels.body.parts) sum += std::log(part.lattice.spacing.prod()) / 3;
  return std::exp(sum / static_cast<double>(run.voxels.body.parts.size()));
}

std::optional<Judged> judge(const std::vector<SolvedRun>& runs, const Quantities& quantities) {
  const std::size_t n = runs.size();
  if (n < 2 || !(ratio_after(runs, n - 2) > 1)) return std::nullopt;
  const SolvedRun& last = runs.back();
  const bool three = n > 2 && ratio_after(runs, n - 3) > 1;
  const std::array<double, 2> ratio = {ratio_after(runs, n - 2), three ? ratio_after(runs, n - 3) : 0};
  const std::vector<Quantity> fine = quantities.of(last, last), coarse = quantities.of(runs[n - 2], last);
  const std::vector<Quantity> coarser = three ? quantities.of(runs[n - 3], last) : std::vector<Quantity>{};
  std::optional<Judged> worst;
  for (std::size_t q = 0; q < fine.size(); ++q) {
    if (!(std::abs(fine[q].value) > 0)) continue;
    const Judged each = judge(fine[q], coarse[q], three ? &coarser[q] : nullptr, ratio);
    if (!worst || each.error > worst->error) worst = each;
  }
  return worst;
}

}  // namespace flexel
