// Most of it are the 3 x 3 blocks of the stiffness matrix and its coarser levels. An element meets those that share a
// cell with it: with n elements, c cells, e edges and f faces that is n + 2 e + 4 f + 8 c blocks, and, as n - e + f - c is
// about 0 and f about 2 c + n, 9 n + 18 c of them.
#include "simulate/memory.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>

#include "base/units.h"
#include "simulate/effects/contact.h"
#include "simulate/time/dynamic_relaxation.h"

namespace flexel::simulate {
namespace {

constexpr double kProgram = 27e6, kSmallProgram = 15e6;    // bytes
constexpr double kBlock = 100, kBlockOfSprings = 165;      // bytes
constexpr double kConnection = 350, kElementOfMode = 450;  // bytes

double connections_of(const Body& body) {
  return std::accumulate(body.connections.begin(), body.connections.end(), 0.0,
                         [](double sum, std::uint32_t bits) { return sum + std::popcount(bits); });
}

}  // namespace

std::optional<MemoryNeeded> memory_needed(const Body& body, const Scene& scene) {
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
    return quadratic_memory(body, 0);
  }
  if (settles(scene)) return std::nullopt;
  const auto of = [](double bytes) { return MemoryNeeded{bytes, bytes}; };
  if (scene.run.time) {
    if (scene.run.method == TimeMethod::implicit_euler || scene.get<Contact>().on) return std::nullopt;
    return of(moving_memory(elements));
  }
  if (model == Model::paper) return of(kSmallProgram + kConnection * connections_of(body));
  return of(kProgram + (model == Model::springs ? kBlockOfSprings : kBlock) * blocks +
            kElementOfMode * modes * elements);
}

void refuse_beyond_memory(const Body& body, const Scene& scene) {
  if (const std::optional<MemoryNeeded> needed = memory_needed(body, scene))
    refuse_beyond_memory(needed->bytes, human_count(body.element_count()) + " elements", scene.name);
}

}  // namespace flexel::simulate
