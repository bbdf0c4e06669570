// Columns are made from the frames and the displacements; nothing is kept for them while mapping.
#include "mapping/report/attributes.h"

#include <Eigen/LU>
#include <cmath>

#include "base/files/output_file.h"
#include "base/parallel.h"
#include "formats/lattice/column_names.h"
#include "formats/vtu/vtu.h"
#include "mapping/anchors/frame.h"
#include "mapping/report/quality.h"

namespace flexel::mapping {
namespace {

template <class Value>
Column column(std::size_t n, const Value& value) {
  Column result;
  result.values.resize(n);
  parallel_for_each(n, [&](std::size_t v) { result.values[v] = value(v); });
  return result;
}

}  // namespace

Columns vertex_attributes(const Surface& surface, const Body& body, const MapResult& result) {
  const std::size_t n = result.frame.size();
  const std::vector<Mat3> gradients = deformation_gradients(result.frames, body.rest, body.position);
  const auto flag = [&](MapFlag bit) {
    return column(n, [&](std::size_t v) { return (result.flags[v] & bit) != 0 ? 1.0 : 0.0; });
  };
  Columns columns;
  Column& displacement = columns["displacement"];
  displacement.components = 3;
  for (const Vec3& u : result.displacement)
    displacement.values.insert(displacement.values.end(), {u.x(), u.y(), u.z()});
  columns["stretch"] = column(n, [&](std::size_t v) {
    const double value = stretch(gradients[result.frame[v]]);
    return std::isfinite(value) ? value : -1.0;
  });
  columns["frame_kind"] =
      column(n, [&](std::size_t v) { return static_cast<double>(result.frame_of(v).kind); });
  columns["distance_outside"] = column(
      n, [&](std::size_t v) { return distance_outside(body, result.frame_of(v), surface.vertices[v]); });
  columns["rest_residual"] = column(n, [&](std::size_t v) {
    const Frame& frame = result.frame_of(v);
    const Mat3 base = rest_base(frame, body.rest, false);
    const Vec3 away = surface.vertices[v] - body.rest[frame.elements[0]];
    return (base * (base.inverse() * away) - away).norm();
  });
  columns["inverted"] = flag(kFrameInverted);
  columns["degenerate"] = flag(kFrameDegenerate);
  columns["voronoi_cell_left"] = flag(kVoronoiCellLeft);
  if (result.voronoi_checked) columns["voronoi_changed"] = flag(kVoronoiChanged);
  if (has_surface_stress(body))
    for (const char* name : {kVonMisesColumn, kPrincipalColumn, kYieldColumn})
      if (const auto stress = surface.vertex_columns.find(name); stress != surface.vertex_columns.end())
        columns.insert(*stress);
  return columns;
}

void write_surface_vtu(const Surface& surface, const std::vector<Vec3>& displacement,
                       const Columns& attributes, double unit, const std::string& path) {
  using vtu::Section;
  constexpr std::uint8_t kPolygon = 7;
  const std::size_t polygons = surface.polygon_count();
  std::vector<vtu::Array> arrays;
  arrays.push_back(vtu::made_array<std::int64_t>(
      Section::cells, "connectivity", surface.polygon_vertices.size(),
      [&](std::size_t i) { return std::int64_t{surface.polygon_vertices[i]}; }));
  arrays.push_back(vtu::made_array<std::int64_t>(Section::cells, "offsets", polygons, [&](std::size_t p) {
    return std::int64_t{surface.polygon_offsets[p + 1]};
  }));
  arrays.push_back(
      vtu::made_array<std::uint8_t>(Section::cells, "types", polygons, [](std::size_t) { return kPolygon; }));
  arrays.push_back(vtu::made_array<std::uint32_t>(Section::cell_data, "part", polygons,
                                                  [&](std::size_t p) { return surface.polygon_part(p); }));
  arrays.push_back(vtu::made_array<Vec3>(
      Section::points, "Points", surface.vertices.size(),
      [&](std::size_t v) { return Vec3((surface.vertices[v] + displacement[v]) / unit); }));
  for (const auto& [name, values] : attributes) {
    vtu::Array array = vtu::array_of(Section::point_data, name, values.values);
    array.components = static_cast<std::size_t>(values.components);
    array.tuples = surface.vertices.size();
    arrays.push_back(array);
  }
  OutputFile out(path);
  vtu::write(out, surface.vertices.size(), polygons, arrays, false);
  out.commit();
}

}  // namespace flexel::mapping
