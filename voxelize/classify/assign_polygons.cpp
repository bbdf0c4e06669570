// Triangles are clipped to voxels as for closed surfaces.
#include "voxelize/classify/assign_polygons.h"

#include <algorithm>
#include <cmath>

#include "base/stop.h"
#include "voxelize/classify/clip.h"
#include "voxelize/classify/samples.h"

namespace flexel::voxelize {
namespace {

// The piece of voxel (i, j) in the slab whose samples come nearest to `point` (in the voxel, 0 to 1); none:
// no samples.
constexpr std::uint32_t kNoPiece = 0xffffffffu;
std::uint32_t nearest_piece(const Slab& slab, int i, int j, const std::array<double, 3>& point) {
  if (j < slab.j_begin || j >= slab.j_begin + slab.rows()) return kNoPiece;
  std::uint32_t best = kNoPiece;
  double least = 1e300;
  const std::uint32_t begin = slab.row_begin[j - slab.j_begin], end = slab.row_begin[j - slab.j_begin + 1];
  const auto first = std::lower_bound(slab.pieces.begin() + begin, slab.pieces.begin() + end, i,
                                      [](const Piece& piece, int value) { return piece.i < value; });
  for (auto p = static_cast<std::uint32_t>(first - slab.pieces.begin()); p < end && slab.pieces[p].i == i;
       ++p) {
    if (slab.samples.empty()) {
      if (best == kNoPiece || slab.pieces[p].fill > slab.pieces[best].fill) best = p;
      continue;
    }
    for (int bit = 0; bit < 64; ++bit) {
      if (!(slab.samples[p] >> bit & 1)) continue;
      const Vec3 sample((bit & 3) + .5, (bit >> 2 & 3) + .5, (bit >> 4) + .5);
      const double distance = (sample / kSamples - Vec3(point[0], point[1], point[2])).squaredNorm();
      if (distance < least) {
        least = distance;
        best = p;
      }
    }
  }
  return best;
}

// The fullest piece of the 27 voxels around (i, j, k), by slab and number.
bool fullest_around(const Voxels& voxels, int i, int j, int k, std::size_t& slab_number,
                    std::uint32_t& found) {
  double most = 0;
  for (int s = std::max(k - 1, voxels.k_begin); s <= k + 1; ++s) {
    const Slab* slab = voxels.slab(s);
    if (slab == nullptr) continue;
    for (int row = std::max(j - 1, slab->j_begin); row <= std::min(j + 1, slab->j_begin + slab->rows() - 1);
         ++row)
      for (std::uint32_t p = slab->row_begin[row - slab->j_begin];
           p < slab->row_begin[row - slab->j_begin + 1]; ++p)
        if (std::abs(slab->pieces[p].i - i) <= 1 && slab->pieces[p].fill > most) {
          most = slab->pieces[p].fill;
          slab_number = static_cast<std::size_t>(s - voxels.k_begin);
          found = p;
        }
  }
  return most > 0;
}

void trace_triangle(const PartMesh& mesh, std::uint32_t t, Voxels& voxels, std::vector<Record>& records) {
  const Corners& c = mesh.corners[t];
  const TrianglePoints points = {&mesh.vertices[c[0]], &mesh.vertices[c[1]], &mesh.vertices[c[2]]};
  const auto [low, high] = std::minmax({points[0]->z(), points[1]->z(), points[2]->z()});
  for (int k = floor_int(low); k <= floor_int(high); ++k) {
    check_stop();
    records.clear();
    clip_to_slab(points, t, k, records);
    for (const Record& record : records) {
      const Polygon polygon = clip_to_voxel(points, record.i, record.j, k);
      std::array<double, 3> middle{};
      for (int v = 0; v < polygon.count; ++v)
        for (int a = 0; a < 3; ++a)
          middle[a] += (polygon.corner[v][a] - (a == 0 ? record.i : a == 1 ? record.j : k)) / polygon.count;
      auto slab = static_cast<std::size_t>(k - voxels.k_begin);
      std::uint32_t piece = voxels.slab(k) == nullptr
                                ? kNoPiece
                                : nearest_piece(voxels.slabs[slab], record.i, record.j, middle);
      if (piece != kNoPiece || fullest_around(voxels, record.i, record.j, k, slab, piece))
        voxels.slabs[slab].traces.push_back({mesh.polygon[t], piece});
    }
  }
}

}  // namespace

void trace_polygons(const PartMesh& mesh, const std::vector<std::uint32_t>& polygons, Voxels& voxels) {
  std::vector<Record> records;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t)
    if (mesh.polygon[t] != kNoPolygon &&
        std::binary_search(polygons.begin(), polygons.end(), mesh.polygon[t]))
      trace_triangle(mesh, t, voxels, records);
  for (Slab& slab : voxels.slabs)
    std::stable_sort(slab.traces.begin(), slab.traces.end(),
                     [](const Trace& a, const Trace& b) { return a.piece < b.piece; });
}

void trace_missing(const PartMesh& mesh, Voxels& voxels) {
  std::uint32_t polygons = 0;
  for (const std::uint32_t p : mesh.polygon)
    if (p != kNoPolygon) polygons = std::max(polygons, p + 1);
  std::vector<std::uint8_t> traced(polygons, 0);
  for (const Slab& slab : voxels.slabs)
    for (const Trace& trace : slab.traces)
      if (trace.polygon < polygons) traced[trace.polygon] = 1;
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t p : mesh.polygon)
    if (p != kNoPolygon && !traced[p]) missing.push_back(p);
  std::sort(missing.begin(), missing.end());
  trace_polygons(mesh, missing, voxels);
}

}  // namespace flexel::voxelize
