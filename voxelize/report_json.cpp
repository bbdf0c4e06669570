// The report as JSON.

#include "base/files/json.h"
#include "voxelize/report.h"

namespace flexel::voxelize {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

Json json_of(const Healing& done) {
  constexpr const char* kBy[] = {"surface", "vote", "flood"};
  return {{"open_edges", done.open_edges},
          {"degenerate_facets", done.degenerate_facets},
          {"duplicate_facets", done.duplicate_facets},
          {"fins", done.fins},
          {"loose_facets", done.loose_facets},
          {"welded_edges", done.welded_edges},
          {"holes", done.holes},
          {"hole_triangles", done.hole_triangles},
          {"widest_hole", done.widest_hole},
          {"flipped_facets", done.flipped_facets},
          {"inverted_shells", done.inverted_shells},
          {"left_open", done.left_open},
          {"wrapped", done.wrapped},
          {"inside_by", kBy[static_cast<int>(done.by)]}};
}

}  // namespace

std::string summary_json(const VoxelizeResult& result) {
  Json parts = Json::array();
  for (std::size_t p = 0; p < result.parts.size(); ++p) {
    const VoxelizedPart& part = result.parts[p];
    parts.push_back({{"name", result.body.parts[p].name},
                     {"closed", part.closed},
                     {"elements", part.elements},
                     {"cells", part.cells},
                     {"spacing", json_of(part.spacing)},
                     {"surface_volume", part.surface_volume},
                     {"lattice_volume", part.lattice_volume},
                     {"dropped_volume", part.dropped_volume},
                     {"thinnest_wall", part.thinnest ? Json{{"thickness", part.thinnest->thickness},
                                                            {"where", json_of(part.thinnest->where)}}
                                                     : Json()},
                     {"thin_walls", part.thin_walls},
                     {"lost_walls", part.lost_walls},
                     {"wall_samples", part.wall_samples},
                     {"spread_cells", part.spread_cells},
                     {"healing", json_of(part.healing)}});
  }
  Json overlaps = Json::array(), gaps = Json::array();
  for (const PartPair& pair : result.pairs) {
    const Json names = {result.body.parts[pair.parts[0]].name, result.body.parts[pair.parts[1]].name};
    if (pair.overlap > 0)
      overlaps.push_back({{"parts", names}, {"volume", pair.overlap}});
    else
      gaps.push_back({{"parts", names}, {"width", pair.gap}});
  }
  return json_text({{"parts", parts}, {"overlaps", overlaps}, {"gaps", gaps}}, 2) + "\n";
}

}  // namespace flexel::voxelize
