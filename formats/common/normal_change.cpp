// Normals turn as the area vectors of the polygons around them do.
#include "formats/common/normal_change.h"

namespace flexel {

std::optional<Eigen::Quaterniond> turn(const NormalChange& change) {
  constexpr double kNoTurn = 1e-12;  // rounding of a part that only moved along
  const double size = change.rest.norm() * change.deformed.norm();
  const bool turned_back = change.rest.dot(change.deformed) < 0;
  const bool turns = turned_back || change.rest.cross(change.deformed).norm() > kNoTurn * size;
  if (!change.moved || !turns || !(size > 0)) return std::nullopt;
  const Vec3 from = change.rest.normalized(), to = change.deformed.normalized();
  const double cosine = from.dot(to);
  if (cosine < -1 + 1e-12) return Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, from.unitOrthogonal()));
  // Its length apart, (cos, sin axis) of half the angle.
  Eigen::Quaterniond turn(1 + cosine, 0, 0, 0);
  turn.vec() = from.cross(to);
  return turn.normalized();
}

std::vector<NormalChange> vertex_normal_changes(const DeformedSurface& deformed) {
  const Surface& surface = deformed.surface;
  std::vector<NormalChange> changes(surface.vertices.size());
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const auto polygon = surface.polygon(p);
    bool moved = false;
    for (const std::uint32_t v : polygon) moved = moved || deformed.displacement[v] != Vec3::Zero();
    const Vec3 rest =
        area_vector(polygon.size(), [&](std::size_t i) { return surface.vertices[polygon[i]]; });
    const Vec3 now =
        moved ? area_vector(polygon.size(),
                            [&](std::size_t i) {
                              return Vec3(surface.vertices[polygon[i]] + deformed.displacement[polygon[i]]);
                            })
              : rest;
    for (const std::uint32_t v : polygon) {
      changes[v].rest += rest;
      changes[v].deformed += now;
      changes[v].moved = changes[v].moved || moved;
    }
  }
  return changes;
}

}  // namespace flexel
