// Safety factors of Roache (1994); of two estimates the larger.
#include "flexel/accuracy/run_error.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/lattice/fields.h"

namespace flexel::commands {
namespace {

constexpr double kConfirmed = 1.25, kUnconfirmed = 3;
constexpr double kLeastOrder = 1, kMostOrder = 2;
constexpr double kMostConfirmed = 2.1;  // a higher order is chance (simulate/result/estimate.h)
constexpr double kSmall = 1e-3;         // of the largest displacement: a probe that hardly moves

std::optional<simulate::Bar> bar_of(const SolvedRun& run, simulate::ErrorBar::Of of, std::size_t probe) {
  for (const simulate::ErrorBar& each : run.simulated.error_bars.bars)
    if (each.of == of && each.probe == probe) return each.bar;
  return std::nullopt;
}

// The ratio of the spacings of run i and the next, finer one.
double ratio_after(const std::vector<SolvedRun>& runs, std::size_t i) {
  return spacing_of(runs[i]) / spacing_of(runs[i + 1]);
}

// The error of one quantity; `coarser`: of the run before the coarse one, null where there is none. There are
// two estimates: the run's error bar, from its own lattice coarsened, and the comparison of runs, whose
// lattices are aligned anew. The larger counts.
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
    if (const simulate::Bar three = simulate::richardson({{fine.value, coarse.value, coarser->value}, ratio});
        three.order) {
      found.error = three.half_width;
      found.order = std::clamp(*three.order, kLeastOrder, kMostOrder);
    }
  if (fine.bar) found.error = std::max(found.error, fine.bar->half_width);
  found.error /= std::abs(fine.value);
  return found;
}

// Of one quantity by the run's own error bar.
std::optional<Judged> judge_alone(const Quantity& fine) {
  if (!fine.bar) return std::nullopt;
  return Judged{fine.bar->half_width / std::abs(fine.value),
                std::clamp(fine.bar->order.value_or(kLeastOrder), kLeastOrder, kMostOrder), fine.name};
}

// The point of the part's surface that moves most in the last run: a vertex, or a point of a polygon that
// moves more than any vertex does.
class MostMoved {
 public:
  explicit MostMoved(const SolvedRun& last) : surface_(largest_displacement_of_surface(last.voxels.body)) {
    constexpr double kMore = 1e-3;  // than mapping and cells may differ
    for (std::size_t v = 0; v < last.mapped.size(); ++v)
      if (last.mapped[v].squaredNorm() > last.mapped[vertex_].squaredNorm()) vertex_ = v;
    between_ = surface_.value() > (1 + kMore) * (last.mapped.empty() ? 0 : last.mapped[vertex_].norm());
  }
  // m, of that point in a run on the same surface.
  [[nodiscard]] Vec3 in(const SolvedRun& run) const {
    if (between_)
      return displacement_on_surface(run.voxels.body, surface_.polygon, surface_.at).value_or(Vec3::Zero());
    return run.mapped.empty() ? Vec3::Zero() : run.mapped[vertex_];
  }

 private:
  LargestDisplacement surface_;
  std::size_t vertex_ = 0;
  bool between_ = false;
};

// Of each quantity that is not zero, with its index.
std::vector<std::pair<Quantity, Judged>> judge_each(const std::vector<SolvedRun>& runs,
                                                    const Quantities& quantities) {
  const std::size_t n = runs.size();
  const SolvedRun& last = runs.back();
  const auto compares = [&](std::size_t i) { return ratio_after(runs, i) > 1 && resolves_walls(runs[i]); };
  const bool two = n > 1 && compares(n - 2), three = two && n > 2 && compares(n - 3);
  const std::vector<Quantity> fine = quantities.of(last, last);
  const auto before = [&](bool there, std::size_t back) {
    return there ? quantities.of(runs[n - back], last) : std::vector<Quantity>{};
  };
  const std::vector<Quantity> coarse = before(two, 2), coarser = before(three, 3);
  const std::array<double, 2> ratio = {two ? ratio_after(runs, n - 2) : 0,
                                       three ? ratio_after(runs, n - 3) : 0};
  std::vector<std::pair<Quantity, Judged>> found;
  for (std::size_t q = 0; q < fine.size(); ++q) {
    if (!(std::abs(fine[q].value) > 0)) continue;
    if (two)
      found.emplace_back(fine[q], judge(fine[q], coarse[q], three ? &coarser[q] : nullptr, ratio));
    else if (const std::optional<Judged> alone = judge_alone(fine[q]))
      found.emplace_back(fine[q], *alone);
  }
  return found;
}

}  // namespace

std::vector<Quantity> Quantities::of(const SolvedRun& run, const SolvedRun& last) const {
  std::vector<Quantity> found;
  const double largest = last.simulated.largest_displacement;
  const auto along = [](const Vec3& moved, const Vec3& direction) {
    return direction.norm() > 0 ? moved.dot(direction.normalized()) : moved.norm();
  };
  for (std::size_t p = 0; p < last.simulated.probes.size(); ++p) {
    const Vec3& direction = last.simulated.probes[p].displacement;
    if (!(direction.norm() > 0) || direction.norm() < kSmall * largest) continue;
    found.push_back({"probe " + last.simulated.probes[p].name,
                     along(run.simulated.probes[p].displacement, direction),
                     bar_of(run, simulate::ErrorBar::Of::probe, p), simulate::ErrorBar::Of::probe, p});
  }
  if (found.empty()) {
    const MostMoved most(last);
    if (const Vec3 direction = most.in(last); direction.norm() > 0)
      found.push_back({"largest displacement", along(most.in(run), direction),
                       bar_of(run, simulate::ErrorBar::Of::largest_displacement, 0)});
  }
  if (driven_ && last.simulated.elastic_energy > 0)
    found.push_back({"elastic energy", run.simulated.elastic_energy,
                     bar_of(run, simulate::ErrorBar::Of::elastic_energy, 0),
                     simulate::ErrorBar::Of::elastic_energy});
  return found;
}

double spacing_of(const SolvedRun& run) {
  double sum = 0;
  for (const Part& part : run.voxels.body.parts) sum += std::log(part.lattice.spacing.prod()) / 3;
  return std::exp(sum / static_cast<double>(run.voxels.body.parts.size()));
}

double wall_thickness(const voxelize::VoxelizeResult& voxels) {
  constexpr double kShare = 0.2;
  std::vector<const voxelize::VoxelizedPart*> parts;
  double all = 0, thinner = 0;
  for (const voxelize::VoxelizedPart& part : voxels.parts) {
    parts.push_back(&part);
    all += part.lattice_volume;
  }
  std::sort(parts.begin(), parts.end(),
            [](const voxelize::VoxelizedPart* a, const voxelize::VoxelizedPart* b) {
              return a->fifth_wall < b->fifth_wall;
            });
  for (const voxelize::VoxelizedPart* part : parts)
    if ((thinner += part->lattice_volume) > kShare * all) return part->fifth_wall;
  return 1e300;
}

bool resolves_walls(const SolvedRun& run) {
  return run.wall >= spacing_of(run) * (1 - 1e-6);
}

std::optional<Judged> judge(const std::vector<SolvedRun>& runs, const Quantities& quantities) {
  std::optional<Judged> worst;
  for (const auto& [quantity, each] : judge_each(runs, quantities))
    if (!worst || each.error > worst->error) worst = each;
  return worst;
}

void widen_bars(std::vector<SolvedRun>& runs, const Quantities& quantities) {
  std::vector<simulate::ErrorBar>& bars = runs.back().simulated.error_bars.bars;
  for (const auto& [quantity, judged] : judge_each(runs, quantities)) {
    const double width = judged.error * std::abs(quantity.value);
    bool known = false;
    for (simulate::ErrorBar& each : bars) {
      if (each.of != quantity.kind || each.probe != quantity.probe) continue;
      each.bar.half_width = std::max(each.bar.half_width, width);
      known = true;
    }
    if (known) continue;  // else its error bars gave nothing
    simulate::ErrorBar bar;
    bar.of = quantity.kind;
    bar.probe = quantity.probe;
    if (bar.of == simulate::ErrorBar::Of::probe)
      bar.probe_name = runs.back().simulated.probes[bar.probe].name;
    bar.value = bar.bar.extrapolated = quantity.value;
    bar.bar.half_width = width;
    bars.push_back(bar);
  }
}

}  // namespace flexel::commands
