// Most of it are the 3 x 3 blocks of the stiffness matrix and its coarser levels. An element meets those that share a
// cell with it: with n elements, c cells, e edges and f faces that is n + 2 e + 4 f + 8 c blocks, and, as n - e + f - c is
// about 0 and f about 2 c + n, 9 n + 18 c of them.
#include "simulate/memory.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/resources.h"
#include "base/units.h"
#include "simulate/effects/contact.h"
#include "simulate/time/dynamic_relaxation.h"

namespace flexel::simulate {
namespace {

constexpr double kSure = 1.3;                                   // what the estimate may be off by
constexpr double kProgram = 27e6, kTimedProgram = 15e6;         // bytes
constexpr double kBlock = 100, kBlockOfSprings = 165;           // bytes
constexpr double kElementOfPaper = 4100, kMovingElement = 520;  // bytes
constexpr double kQuadraticNode = 2900, kElementOfMode = 450;   // bytes

}  // namespace

std::optional<double> memory_needed(const Body& body, const Scene& scene) {
  const std::vector<Model> models = models_of_parts(scene, body);
  if (models.empty() ||
      std::any_of(models.begin(), models.end(), [&](Model m) { return m != models.front(); }))
    return std::nullopt;
  const auto elements = static_cast<double>(body.element_count()),
             cells = static_cast<double>(body.cell_count());
  const double blocks = 9 * elements + 18 * cells;
  const Model model = models.front();
  const double modes = scene.run.modes.value_or(0);
  if (model == Model::quadratic) {
    if (modes > 0 || scene.run.buckling) return std::nullopt;
    return kTimedProgram + kQuadraticNode * 4 * (elements + cells);
  }
  if (settles(scene)) return std::nullopt;
  if (scene.run.time) {
    if (scene.run.method == TimeMethod::implicit_euler || scene.get<Contact>().on) return std::nullopt;
    return kTimedProgram + kMovingElement * elements;
  }
  if (model == Model::paper) return kProgram + kElementOfPaper * elements;
  return kProgram + (model == Model::springs ? kBlockOfSprings : kBlock) * blocks +
         kElementOfMode * modes * elements;
}

void refuse_beyond_memory(const Body& body, const Scene& scene) {
  const std::optional<double> needed = memory_needed(body, scene);
  if (!needed || *needed <= kSure * memory_to_use()) return;
  throw InputError(
      scene.name,
      fmt::format(
          "this run needs about {} for {} elements, more than the limit of {}: voxelize with a larger "
          "--size, or raise --max-memory",
          human_bytes(*needed), human_count(body.element_count()), human_bytes(memory_to_use())));
}

}  // namespace flexel::simulate
