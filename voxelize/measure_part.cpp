// Each part is healed as for a lattice, then measured.
#include "voxelize/measure_part.h"

#include "base/program/share_scope.h"
#include "voxelize/classify/overlap.h"
#include "voxelize/heal/heal.h"
#include "voxelize/heal/outward.h"
#include "voxelize/walls.h"

namespace flexel::voxelize {

std::vector<MeasuredPart> heal_and_measure(Surface& surface, int rays) {
  std::vector<HealedPart> healed;
  for (PartMesh& mesh : exact_part_meshes(surface)) healed.push_back(heal(std::move(mesh), {}, ""));
  face_outward(healed, surface);
  std::vector<MeasuredPart> result(healed.size());
  const int lines = wall_lines(rays, healed.size());
  constexpr double kHealed = 0.5;  // of the time
  for (std::size_t p = 0; p < healed.size(); ++p) {
    tell_share(kHealed + (1 - kHealed) * static_cast<double>(p) / static_cast<double>(healed.size()));
    const PartMesh& mesh = healed[p].mesh;
    result[p].healing = healed[p].done;
    if (mesh.corners.empty() || !mesh.balanced()) continue;
    result[p].volume = enclosed_volume(mesh);
    constexpr double kLinesDiffer = .01;  // lines alone may be off by that around thin walls
    const double joined = mesh.shell_count > 1 ? union_volume(mesh) : *result[p].volume;
    if (std::abs(joined - *result[p].volume) > kLinesDiffer * joined) result[p].volume = joined;
    const std::vector<WallSample> samples = wall_samples(mesh, lines);
    if (samples.empty()) continue;
    const WallSample& least = samples[thinnest_sample(samples)];
    result[p].thinnest = ThinWall{least.thickness, least.where, static_cast<std::uint32_t>(p)};
  }
  return result;
}

}  // namespace flexel::voxelize
