// The crossings of axis-parallel lines through all samples are computed once; each sample looks up three
// lines.
#include "voxelize/classify/axis_parity.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"
#include "voxelize/classify/assign_polygons.h"
#include "voxelize/mesh/line_crossings.h"

namespace flexel::voxelize {
namespace {

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

}  // namespace

struct AxisVote::Lines {
  std::array<SampleLines, 3> along;
};

AxisVote::AxisVote(const PartMesh& mesh, const Range& range)
    : range_(range),
      lines_(std::make_unique<Lines>(Lines{
          {sample_lines(mesh, range_, 0), sample_lines(mesh, range_, 1), sample_lines(mesh, range_, 2)}})) {}
AxisVote::~AxisVote() = default;

VoxelSamples AxisVote::samples(int i, int j, int k) const {
  VoxelSamples result;
  for (int bit = 0; bit < 64; ++bit) {
    const std::array<int, 3> s = {kSamples * i + (bit & 3), kSamples * j + (bit >> 2 & 3),
                                  kSamples * k + (bit >> 4)};
    int sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const std::size_t line =
          static_cast<std::size_t>(s[u]) + static_cast<std::size_t>(range_.count[u]) * kSamples * s[v];
      sum += lines_->along[axis].vote(line, range_.begin[axis] + (s[axis] + .5) / kSamples);
    }
    if (sum > 0) result.inside |= std::uint64_t{1} << bit;
    result.differ |= std::abs(sum) != 3;
  }
  return result;
}

Voxels classify_open(const PartMesh& mesh) {
  const Range range = voxel_range(mesh);
  const AxisVote vote(mesh, range);
  Voxels voxels = voxels_from_samples(range, [&](int i, int j, int k) { return vote.samples(i, j, k); });
  trace_missing(mesh, voxels);
  return voxels;
}

}  // namespace flexel::voxelize
