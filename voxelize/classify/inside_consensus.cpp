// The axis parity is used if the winding numbers confirm it, else the flood if they confirm that, else the
// axis parity if the flood confirms it (the orientation is then unusable). Where no two agree, because the
// samples of a coarse lattice miss thin matter, the three are compared once more on a finer lattice: what a
// surface encloses does not depend on the cells that were asked for. The fill counts samples by their
// distance to the surface: of a sample, a small cube, a plane at distance d from its centre leaves 1/2 - d,
// averaged over directions.
#include "voxelize/classify/inside_consensus.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "voxelize/classify/assign_polygons.h"
#include "voxelize/classify/axis_parity.h"
#include "voxelize/classify/sample_distances.h"
#include "voxelize/classify/winding.h"

namespace flexel::voxelize {
namespace {

constexpr std::size_t kJudged = 30000;        // samples judged by all three
constexpr std::size_t kJudgedVoxels = 15000;  // of a lattice fine enough for the comparison
constexpr int kFinest = 9;                    // times as fine

struct Counts {
  double vote = 0, flood = 0, winding = 0, vote_flood = 0, vote_winding = 0, flood_winding = 0, unsure = 0;
  Counts& operator+=(const Counts& other) {
    vote += other.vote;
    flood += other.flood;
    winding += other.winding;
    vote_flood += other.vote_flood;
    vote_winding += other.vote_winding;
    flood_winding += other.flood_winding;
    unsure += other.unsure;
    return *this;
  }
};

std::uint64_t mixed(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

struct Judges {
  Range range;
  AxisVote vote;
  SampleDistances distances;
  WindingNumber winding;
  explicit Judges(const PartMesh& mesh)
      : range(voxel_range(mesh)), vote(mesh, range), distances(mesh, range), winding(mesh, mesh.vertices) {}
};

// `count` samples of a voxel, chosen by a chance that is the same in every run.
Counts judge_voxel(const Judges& judges, std::size_t voxel, int count) {
  const auto nx = static_cast<std::size_t>(judges.range.count[0]),
             ny = static_cast<std::size_t>(judges.range.count[1]);
  const std::array<int, 3> at = {static_cast<int>(voxel % nx), static_cast<int>(voxel / nx % ny),
                                 static_cast<int>(voxel / nx / ny)};
  const VoxelSamples votes = judges.vote.samples(at[0], at[1], at[2]);
  std::array<float, 64> distance;
  judges.distances.voxel(at[0], at[1], at[2], distance);
  Counts sum;
  for (int n = 0; n < count; ++n) {
    const auto bit =
        count >= 64 ? static_cast<std::size_t>(n) : mixed(64 * voxel + static_cast<std::size_t>(n)) % 64;
    const std::size_t offset[3] = {bit & 3, bit >> 2 & 3, bit >> 4};
    Vec3 point;
    for (int a = 0; a < 3; ++a)
      point[a] = judges.range.begin[a] + at[a] + (static_cast<double>(offset[a]) + .5) / kSamples;
    const double w = judges.winding.at(point);
    const bool v = votes.inside >> bit & 1, f = distance[bit]<0, in = w> .5;
    sum.vote += v;
    sum.flood += f;
    sum.winding += in;
    const float far = std::abs(distance[bit]);
    if (far > .75f) {
      sum.vote_flood += v != f;
      sum.vote_winding += v != in;
      sum.flood_winding += f != in;
    }
    if (far > 1.5f) sum.unsure += std::abs(w - std::round(w)) > .3;
  }
  return sum;
}

Agreement agreement(const Judges& judges, std::size_t samples) {
  const std::size_t voxels = judges.range.voxels();
  const int each =
      static_cast<int>(std::clamp<std::size_t>(samples / std::max<std::size_t>(1, voxels), 1, 64));
  const Counts sum = parallel_sum<Counts>(
      voxels, [&](std::size_t voxel) { return judge_voxel(judges, voxel, each); }, 256);
  const auto share = [](double count, double a, double b) {
    return std::min(a, b) > 0 ? count / std::min(a, b) : 1;
  };
  return {sum.vote / each,
          sum.flood / each,
          sum.winding / each,
          share(sum.vote_flood, sum.vote, sum.flood),
          share(sum.vote_winding, sum.vote, sum.winding),
          share(sum.flood_winding, sum.flood, sum.winding),
          share(sum.unsure, sum.winding, std::max(sum.vote, sum.flood))};
}

bool agree(double volume, double other, double differing) {
  const double least = std::min(volume, other);
  return least > 0 && std::abs(volume - other) <= kVolumesDiffer * least && differing <= kSamplesDiffer;
}

Sampled::By decide(const Agreement& a, bool unanimous) {
  const bool winding_counts = a.unsure <= kMostUnsure;
  if (unanimous &&
      !(winding_counts && agree(a.vote, a.winding, a.vote_winding) && agree(a.vote, a.flood, a.vote_flood)))
    return Sampled::By::nobody;
  if (winding_counts && agree(a.vote, a.winding, a.vote_winding)) return Sampled::By::vote;
  if (winding_counts && agree(a.flood, a.winding, a.flood_winding)) return Sampled::By::flood;
  if (agree(a.vote, a.flood, a.vote_flood)) return Sampled::By::vote;
  return Sampled::By::nobody;
}

// The same surface on a lattice `times` as fine as the one that it lies on.
PartMesh refined(PartMesh mesh, int times) {
  for (Vec3& vertex : mesh.vertices) vertex *= times;
  return mesh;
}

// How much finer a lattice has to be to be judged by: an odd number, so that samples lie on samples.
int refinement(std::size_t voxels) {
  int times = 1;
  while (times < kFinest && voxels * static_cast<std::size_t>(times * times * times) < kJudgedVoxels)
    times += 2;
  return times;
}

// Who is right, and the flood that said so: that of a lattice `times` as fine.
struct Verdict {
  Sampled::By by = Sampled::By::nobody;
  const Judges* flood = nullptr;
  int times = 1;
  // Sample `bit` of voxel (i, j, k) is not reached by the flood.
  [[nodiscard]] bool encloses(const Range& range, const std::array<int, 3>& voxel, std::size_t bit) const {
    const std::size_t offset[3] = {bit & 3, bit >> 2 & 3, bit >> 4};
    std::array<int, 3> at{};
    for (int a = 0; a < 3; ++a)
      at[a] = times * (kSamples * (range.begin[a] + voxel[a]) + static_cast<int>(offset[a])) + times / 2 -
              kSamples * flood->range.begin[a];
    return flood->distances.at(at[0], at[1], at[2]) < 0;
  }
};

VoxelSamples decided(const Judges& judges, const Verdict& verdict, int i, int j, int k) {
  VoxelSamples samples = judges.vote.samples(i, j, k);
  std::array<float, 64> distance;
  judges.distances.voxel(i, j, k, distance);
  if (verdict.by == Sampled::By::flood) {
    samples.inside = 0;
    for (std::size_t bit = 0; bit < 64; ++bit)
      samples.inside |= std::uint64_t{verdict.encloses(judges.range, {i, j, k}, bit)} << bit;
  }
  samples.fill = 0;
  std::uint64_t touched = 0;
  for (std::size_t bit = 0; bit < 64; ++bit) {
    const double depth = (samples.inside >> bit & 1 ? 1 : -1) * std::abs(static_cast<double>(distance[bit]));
    const double share = std::clamp(.5 + depth, 0., 1.) / 64;
    samples.fill += share;
    if (share > 0) touched |= std::uint64_t{1} << bit;
  }
  if (samples.inside == 0)
    samples.inside = touched;  // matter reaches into the voxel, but to no centre of a sample
  return samples;
}

}  // namespace

Sampled classify_sampled(const PartMesh& mesh, bool unanimous) {
  const Judges judges(mesh);
  constexpr double kJudgesThere = .4, kDecided = .7;  // of the time
  tell_share(kJudgesThere);
  Sampled result;
  result.agreement = agreement(judges, kJudged);
  tell_share(kDecided);
  Verdict verdict{decide(result.agreement, unanimous), &judges, 1};
  std::optional<PartMesh> fine;
  std::optional<Judges> finer;
  if (const int times = refinement(judges.range.voxels()); verdict.by == Sampled::By::nobody && times > 1) {
    fine = refined(mesh, times);
    finer.emplace(*fine);
    result.agreement = agreement(*finer, kJudgedVoxels);
    verdict = {decide(result.agreement, unanimous), &*finer, times};
  }
  result.by = verdict.by;
  if (result.by == Sampled::By::nobody) return result;
  result.voxels = voxels_from_samples(judges.range,
                                      [&](int i, int j, int k) { return decided(judges, verdict, i, j, k); });
  trace_missing(mesh, result.voxels);
  return result;
}

}  // namespace flexel::voxelize
