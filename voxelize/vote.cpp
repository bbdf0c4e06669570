// Lines along the three axes run through all samples; their crossings are found once. Each slab of voxels
// then adds up the votes for its samples, packs them 64 to a voxel and splits them into connected pieces by
// flooding bits. Polygons are traced to pieces by clipping, as for closed surfaces; one in a voxel without a
// sample inside goes to the fullest piece of the 26 voxels around.
#include "voxelize/vote.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "formats/parallel.h"
#include "voxelize/clip.h"
#include "voxelize/lines.h"

namespace flexel {
namespace {

constexpr int kSamples = 4;  // along each side of a voxel

// Whole voxels around the mesh.
struct Range {
  std::array<int, 3> begin{}, count{};
};

Range voxel_range(const PartMesh& mesh) {
  const Box box = bounding_box(mesh.vertices);
  Range range;
  for (int a = 0; a < 3; ++a) {
    range.begin[a] = floor_int(box.min[a]);
    range.count[a] = floor_int(box.max[a]) - range.begin[a] + 1;
  }
  return range;
}

// Crossings of the sample lines along one axis.
struct SampleLines {
  std::vector<double> at;            // sorted within a line
  std::vector<std::uint32_t> begin;  // (lines + 1)

  // +1 inside, -1 outside, 0 abstains.
  [[nodiscard]] int vote(std::size_t line, double sample) const {
    const auto first = at.begin() + begin[line], last = at.begin() + begin[line + 1];
    if ((last - first) % 2 != 0) return 0;
    return (std::lower_bound(first, last, sample) - first) % 2 != 0 ? 1 : -1;
  }
};

SampleLines sample_lines(const PartMesh& mesh, const Range& range, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  constexpr double kStep = 1. / kSamples;
  const LineGrid grid{axis,  range.begin[u] + kStep / 2, range.begin[v] + kStep / 2, kStep,
                      kStep, range.count[u] * kSamples,  range.count[v] * kSamples};
  SampleLines lines;
  lines.begin.assign(static_cast<std::size_t>(grid.u_count) * grid.v_count + 1, 0);
  for (const LineCrossing& crossing : cross_lines(mesh, mesh.vertices, grid)) {
    lines.at.push_back(crossing.at);
    ++lines.begin[crossing.line + 1];
  }
  std::partial_sum(lines.begin.begin(), lines.begin.end(), lines.begin.begin());
  return lines;
}

// The samples of a voxel that are connected with the lowest one set.
std::uint64_t lowest_component(std::uint64_t samples) {
  constexpr std::uint64_t kNotXLow = 0xeeeeeeeeeeeeeeeeu, kNotXHigh = 0x7777777777777777u;
  constexpr std::uint64_t kNotYLow = 0xfff0fff0fff0fff0u, kNotYHigh = 0x0fff0fff0fff0fffu;
  std::uint64_t component = samples & (~samples + 1), before = 0;
  while (component != before) {
    before = component;
    component |= (component << 1 & kNotXLow) | (component >> 1 & kNotXHigh) | (component << 4 & kNotYLow) |
                 (component >> 4 & kNotYHigh) | component << 16 | component >> 16;
    component &= samples;
  }
  return component;
}

Piece make_piece(std::uint64_t samples, int i, bool several) {
  Piece piece;
  piece.fill = std::popcount(samples) / 64.;
  piece.i = i;
  for (int a = 0; a < 8; ++a) {
    const int bit = 3 * (a & 1) + 12 * (a >> 1 & 1) + 48 * (a >> 2);
    piece.corners = static_cast<std::uint8_t>(piece.corners | (samples >> bit & 1) << a);
  }
  constexpr std::uint64_t kAroundCentre = 0x0000066006600000u;
  if (several) piece.flags |= kOneOfSeveral;
  if (std::popcount(samples & kAroundCentre) > 4) piece.flags |= kContainsCentre;
  return piece;
}

class SampledSlabs {
 public:
  explicit SampledSlabs(const PartMesh& mesh)
      : range_(voxel_range(mesh)),
        lines_{sample_lines(mesh, range_, 0), sample_lines(mesh, range_, 1), sample_lines(mesh, range_, 2)} {}

  [[nodiscard]] const Range& range() const { return range_; }

  void build(int layer, Slab& slab) const {
    slab.j_begin = range_.begin[1];
    slab.row_begin.push_back(0);
    for (int j = 0; j < range_.count[1]; ++j) {
      for (int i = 0; i < range_.count[0]; ++i) {
        std::uint64_t inside = voxel_samples(i, j, layer, slab.disagreements);
        const bool several = inside != 0 && lowest_component(inside) != inside;
        slab.split_voxels += several;
        while (inside != 0) {
          const std::uint64_t component = lowest_component(inside);
          slab.pieces.push_back(make_piece(component, range_.begin[0] + i, several));
          slab.samples.push_back(component);
          inside &= ~component;
        }
      }
      slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
    }
  }

 private:
  // Bits of the samples inside voxel (i, j, k), counted from the range's begin.
  std::uint64_t voxel_samples(int i, int j, int k, std::size_t& disagreements) const {
    std::uint64_t inside = 0;
    bool differ = false;
    for (int bit = 0; bit < 64; ++bit) {
      const std::array<int, 3> s = {kSamples * i + (bit & 3), kSamples * j + (bit >> 2 & 3),
                                    kSamples * k + (bit >> 4)};
      int sum = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const std::size_t line =
            static_cast<std::size_t>(s[u]) + static_cast<std::size_t>(range_.count[u]) * kSamples * s[v];
        sum += lines_[axis].vote(line, range_.begin[axis] + (s[axis] + .5) / kSamples);
      }
      if (sum > 0) inside |= std::uint64_t{1} << bit;
      differ |= std::abs(sum) != 3;
    }
    disagreements += differ;
    return inside;
  }

  Range range_;
  std::array<SampleLines, 3> lines_;
};

// The piece of voxel (i, j) in the slab whose samples come nearest to `point` (in the voxel, 0 to 1); none:
// no samples.
constexpr std::uint32_t kNoPiece = 0xffffffffu;
std::uint32_t nearest_piece(const Slab& slab, int i, int j, const std::array<double, 3>& point) {
  std::uint32_t best = kNoPiece;
  double least = 1e300;
  const std::uint32_t begin = slab.row_begin[j - slab.j_begin], end = slab.row_begin[j - slab.j_begin + 1];
  const auto first = std::lower_bound(slab.pieces.begin() + begin, slab.pieces.begin() + end, i,
                                      [](const Piece& piece, int value) { return piece.i < value; });
  for (auto p = static_cast<std::uint32_t>(first - slab.pieces.begin()); p < end && slab.pieces[p].i == i;
       ++p)
    for (int bit = 0; bit < 64; ++bit) {
      if (!(slab.samples[p] >> bit & 1)) continue;
      const Vec3 sample((bit & 3) + .5, (bit >> 2 & 3) + .5, (bit >> 4) + .5);
      const double distance = (sample / kSamples - Vec3(point[0], point[1], point[2])).squaredNorm();
      if (distance < least) {
        least = distance;
        best = p;
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
    records.clear();
    clip_to_slab(points, t, k, records);
    for (const Record& record : records) {
      const Polygon polygon = clip_to_voxel(points, record.i, record.j, k);
      std::array<double, 3> middle{};
      for (int v = 0; v < polygon.count; ++v)
        for (int a = 0; a < 3; ++a)
          middle[a] += (polygon.corner[v][a] - (a == 0 ? record.i : a == 1 ? record.j : k)) / polygon.count;
      auto slab = static_cast<std::size_t>(k - voxels.k_begin);
      std::uint32_t piece = nearest_piece(voxels.slabs[slab], record.i, record.j, middle);
      if (piece != kNoPiece || fullest_around(voxels, record.i, record.j, k, slab, piece))
        voxels.slabs[slab].traces.push_back({mesh.polygon[t], piece});
    }
  }
}

}  // namespace

Voxels classify_open(const PartMesh& mesh) {
  const SampledSlabs sampled(mesh);
  Voxels voxels;
  voxels.k_begin = sampled.range().begin[2];
  voxels.slabs.resize(static_cast<std::size_t>(sampled.range().count[2]));
  parallel_for_each(
      voxels.slabs.size(), [&](std::size_t s) { sampled.build(static_cast<int>(s), voxels.slabs[s]); }, 1);
  std::vector<Record> records;
  for (std::uint32_t t = 0; t < mesh.corners.size(); ++t) trace_triangle(mesh, t, voxels, records);
  for (Slab& slab : voxels.slabs)
    std::stable_sort(slab.traces.begin(), slab.traces.end(),
                     [](const Trace& a, const Trace& b) { return a.piece < b.piece; });
  number_pieces(voxels);
  return voxels;
}

}  // namespace flexel
