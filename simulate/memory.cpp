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
#include "simulate/effects/drag.h"
#include "simulate/indent/indenters.h"
#include "simulate/matter/surface_points.h"
#include "simulate/time/dynamic_relaxation.h"

namespace flexel::simulate {
namespace {

constexpr double kProgram = 27e6, kSmallProgram = 15e6;    // bytes
constexpr double kBlock = 100, kStoredBlock = 165;         // bytes
constexpr double kConnection = 350, kElementOfMode = 450;  // bytes
constexpr double kElementToBegin = 300;                    // bytes, before what moves or solves is made

// Bytes of a point of a surface (SurfacePoint) while an effect looks at all of them at once, and later. Contact looks at
// one part after another, indenters and drag at all.
constexpr double kContactPoint = 225, kBallPoint = 190, kContactPointLater = 20;
constexpr double kIndenterPoint = 236, kIndenterPointLater = 72;
constexpr double kDragPoint = 166;

double connections_of(const Body& body) {
  return std::accumulate(body.connections.begin(), body.connections.end(), 0.0,
                         [](double sum, std::uint32_t bits) { return sum + std::popcount(bits); });
}

// What surfaces take beside all else: while an effect is made, and as long as the run lasts.
struct SurfaceMemory {
  double made = 0, kept = 0;  // bytes
};

SurfaceMemory surface_memory(const Body& body, const Scene& scene) {
  const auto& contact = scene.get<Contact>();
  const bool touch = contact.on || !contact.planes.empty();
  const bool pushed = !scene.get<Indenters>().indenters.empty();
  const bool slowed = scene.get<Drag>().density.has_value() && scene.run.time;
  SurfaceMemory found;
  if (!touch && !pushed && !slowed) return found;
  double all = 0;
  const std::vector<std::size_t> counts = surface_point_counts(body);
  for (std::size_t p = 0; p < counts.size(); ++p) {
    const auto count = static_cast<double>(counts[p]);
    const bool balls = body.parts[p].placement == Placement::centre;
    if (touch) found.made = std::max(found.made, (balls ? kBallPoint : kContactPoint) * count);
    if (!balls) all += count;
  }
  if (touch) found.kept += kContactPointLater * all;
  if (pushed) {
    found.made = std::max(found.made, kIndenterPoint * all);
    found.kept += kIndenterPointLater * all;
  }
  if (slowed) found.made = std::max(found.made, kDragPoint * all);
  return found;
}

}  // namespace

std::optional<MemoryNeeded> memory_needed(const Body& body, const Scene& scene) {
  const std::vector<Model> models = models_of_parts(scene, body);
  if (models.empty()) return std::nullopt;
  const bool one = std::all_of(models.begin(), models.end(), [&](Model m) { return m == models.front(); });
  const auto has = [&](Model model) {
    return std::find(models.begin(), models.end(), model) != models.end();
  };
  const auto elements = static_cast<double>(body.element_count()),
             cells = static_cast<double>(body.cell_count());
  const double modes = scene.run.modes.value_or(0);
  if (has(Model::quadratic)) {
    if (!one || modes > 0 || scene.run.buckling) return std::nullopt;
    return quadratic_memory(body, 0);
  }
  const double blocks = 9 * elements + 18 * cells;
  const double matrix = kProgram + (has(Model::springs) ? kStoredBlock : kBlock) * blocks;
  const SurfaceMemory surface = surface_memory(body, scene);
  const double made = kSmallProgram + kElementToBegin * elements + surface.made;
  const auto of = [&](double bytes) {
    const double most = std::max(bytes + surface.kept, made);
    return MemoryNeeded{most, most};
  };
  if (scene.run.time && scene.run.method == TimeMethod::implicit_euler)
    return of(moving_memory(elements) + kStoredBlock * blocks);
  if (scene.run.time || settles(scene)) return of(moving_memory(elements));
  if (has(Model::paper)) {
    if (!one) return std::nullopt;
    return of(kSmallProgram + kConnection * connections_of(body));
  }
  return of(matrix + kElementOfMode * modes * elements);
}

void refuse_beyond_memory(const Body& body, const Scene& scene) {
  if (const std::optional<MemoryNeeded> needed = memory_needed(body, scene))
    refuse_beyond_memory(needed->bytes, human_count(body.element_count()) + " elements", scene.name);
}

}  // namespace flexel::simulate
