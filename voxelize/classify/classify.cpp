// Slabs of voxels are independent: each clips the triangles that intersect it, sorts the records by voxel and
// sweeps every row along x. The sweep updates the winding number at the row's lattice points from the
// records; voxels between two that the surface cuts are all full or all empty. clip.cpp computes the fill,
// pieces.cpp the pieces.
#include "voxelize/classify/classify.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "voxelize/classify/moments.h"
#include "voxelize/classify/overlap.h"
#include "voxelize/classify/pieces.h"

namespace flexel::voxelize {
namespace {

// Triangles that reach into each slab.
struct Bins {
  int k_begin = 0;
  std::vector<std::uint32_t> begin;  // (slabs + 1)
  std::vector<std::uint32_t> triangles;
};

// Of the slabs in `box`, where one is given.
Bins bin_triangles(const PartMesh& mesh, const std::optional<VoxelBox>& box) {
  const std::size_t n = mesh.corners.size();
  std::vector<std::array<int, 2>> range(n);
  parallel_for_each(n, [&](std::size_t t) {
    const Corners& c = mesh.corners[t];
    const auto [low, high] =
        std::minmax({mesh.vertices[c[0]].z(), mesh.vertices[c[1]].z(), mesh.vertices[c[2]].z()});
    range[t] = {floor_int(low), floor_int(high)};
  });
  if (box)
    for (auto& [low, high] : range) {  // where nothing is left, high is less than low
      low = std::max(low, box->lower[2]);
      high = std::min(high, box->upper[2] - 1);
    }
  int k_begin = 0, k_last = -1;
  for (const auto& [low, high] : range) {
    if (high < low) continue;
    if (k_last < k_begin) {
      k_begin = low;
      k_last = high;
    }
    k_begin = std::min(k_begin, low);
    k_last = std::max(k_last, high);
  }
  Bins bins;
  bins.k_begin = k_begin;
  bins.begin.assign(static_cast<std::size_t>(k_last - k_begin + 3), 0);
  for (const auto& [low, high] : range)
    for (int k = low; k <= high; ++k) ++bins.begin[k - k_begin + 2];
  for (std::size_t s = 1; s < bins.begin.size(); ++s) bins.begin[s] += bins.begin[s - 1];
  bins.triangles.resize(bins.begin.back());
  for (std::uint32_t t = 0; t < n; ++t)
    for (int k = range[t][0]; k <= range[t][1]; ++k) bins.triangles[bins.begin[k - k_begin + 1]++] = t;
  bins.begin.pop_back();
  return bins;
}

// Winding numbers at the corners of a voxel from that at its lowest one, through the seven edges that records
// may cross.
std::array<int, 8> corner_windings(int lowest, std::span<const Record> records) {
  std::array<int, kVoxelEdges> change{};
  for (const Record& record : records)
    for (int edge = 0; record.windings != 0 && edge < kVoxelEdges; ++edge)
      change[edge] += winding_change(record, edge);
  std::array<int, 8> w{};
  w[0] = lowest;
  w[1] = w[0] + change[kAlongX];
  w[2] = w[0] + change[kAlongYAtXLow];
  w[3] = w[1] + change[kAlongYAtXHigh];
  w[4] = w[0] + change[kAlongZ00];
  w[5] = w[1] + change[kAlongZ10];
  w[6] = w[2] + change[kAlongZ01];
  w[7] = w[3] + change[kAlongZ11];
  return w;
}

// Range of voxels.
struct Box2 {
  int i_begin = 0, i_last = 0, j_begin = 0, j_last = 0;
};

// Fills one slab.
class SlabBuilder {
 public:
  // `window`: of each slab, where there is a box.
  SlabBuilder(const PartMesh& mesh, const ClassifyOptions& options, SlabWindow window)
      : mesh_(mesh), options_(options), window_(std::move(window)) {}

  void build(int k, std::span<const std::uint32_t> triangles, Slab& slab) {
    clip(k, triangles);
    if (options_.box) return sweep_window(k, slab);
    if (records_.empty()) return;
    slab.j_begin = records_.front().j;
    for (auto row = records_.begin(); row != records_.end();) {
      const auto row_end =
          std::find_if(row, records_.end(), [&](const Record& record) { return record.j != row->j; });
      while (slab.j_begin + static_cast<int>(slab.row_begin.size()) <= row->j)
        slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
      const int winding = sweep_row({row, row_end}, 0, k, slab);
      if (winding != 0) throw std::logic_error("a row of voxels does not end outside the part");
      row = row_end;
    }
    slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
  }

 private:
  // Records of the slab, by (j, i, triangle).
  void clip(int k, std::span<const std::uint32_t> triangles) {
    unsorted_.clear();
    std::fill(window_.left.begin(), window_.left.end(), 0);
    for (const std::uint32_t t : triangles) {
      const Corners& c = mesh_.corners[t];
      const TrianglePoints points = {&mesh_.vertices[c[0]], &mesh_.vertices[c[1]], &mesh_.vertices[c[2]]};
      if (options_.box)
        clip_to_window(points, t, k, window_, unsorted_);
      else
        clip_to_slab(points, t, k, unsorted_);
    }
    sort_by_voxel();
  }

  // Every row of the window: one that no triangle passes through may lie inside the part.
  void sweep_window(int k, Slab& slab) {
    slab.j_begin = window_.j_begin;
    auto row = records_.begin();
    for (std::size_t n = 0; n < window_.left.size(); ++n) {
      slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
      const int j = window_.j_begin + static_cast<int>(n);
      const auto row_end =
          std::find_if(row, records_.end(), [&](const Record& record) { return record.j != j; });
      const std::span<const Record> records(row, row_end);
      if (!records.empty() && window_.left[n] > 0) add_full(window_.i_begin, records.front().i, slab);
      const int winding = sweep_row(records, window_.left[n], k, slab);
      if (winding > 0)
        add_full(records.empty() ? window_.i_begin : records.back().i + 1, window_.i_end, slab);
      row = row_end;
    }
    slab.row_begin.push_back(static_cast<std::uint32_t>(slab.pieces.size()));
  }

  void add_full(int i_begin, int i_end, Slab& slab) const {
    for (int i = i_begin; i < i_end; ++i)
      slab.pieces.push_back({.fill = 1,
                             .i = i,
                             .corners = 0xff,
                             .flags = options_.with_centres ? kContainsCentre : PieceFlag{}});
  }

  // Triangles come in ascending order, and both counting sorts keep the order of what they find equal.
  void sort_by_voxel() {
    constexpr std::size_t kWide = 1 << 16;
    if (unsorted_.empty()) {
      records_.clear();
      return;
    }
    records_.resize(unsorted_.size());
    Box2 box{unsorted_[0].i, unsorted_[0].i, unsorted_[0].j, unsorted_[0].j};
    for (const Record& record : unsorted_) {
      box.i_begin = std::min(box.i_begin, record.i);
      box.i_last = std::max(box.i_last, record.i);
      box.j_begin = std::min(box.j_begin, record.j);
      box.j_last = std::max(box.j_last, record.j);
    }
    const auto columns = static_cast<std::size_t>(box.i_last - box.i_begin) + 1,
               rows = static_cast<std::size_t>(box.j_last - box.j_begin) + 1;
    if (std::max(columns, rows) > std::max(kWide, unsorted_.size())) {  // few records far apart
      records_ = unsorted_;
      std::stable_sort(records_.begin(), records_.end(),
                       [](const Record& a, const Record& b) { return a.j != b.j ? a.j < b.j : a.i < b.i; });
      return;
    }
    counting_sort(unsorted_, records_, columns, [&](const Record& r) { return r.i - box.i_begin; });
    unsorted_.swap(records_);
    counting_sort(unsorted_, records_, rows, [&](const Record& r) { return r.j - box.j_begin; });
  }

  template <class Key>
  void counting_sort(const std::vector<Record>& from, std::vector<Record>& to, std::size_t keys,
                     const Key& key) {
    next_.assign(keys + 1, 0);
    for (const Record& record : from) ++next_[static_cast<std::size_t>(key(record)) + 1];
    for (std::size_t n = 1; n <= keys; ++n) next_[n] += next_[n - 1];
    for (const Record& record : from) to[next_[static_cast<std::size_t>(key(record))]++] = record;
  }

  // `winding`: at the lattice point before the first record; returned is that after the last.
  int sweep_row(std::span<const Record> row, int winding, int k, Slab& slab) {
    for (std::size_t n = 0; n < row.size();) {
      std::size_t end = n + 1;
      while (end < row.size() && row[end].i == row[n].i) ++end;
      const std::span<const Record> records = row.subspan(n, end - n);
      const VoxelRecords voxel{&mesh_, records, row[n].i, row[n].j, k, corner_windings(winding, records)};
      add_voxel(voxel, slab);
      winding = voxel.winding[1];
      if (winding > 0 && end < row.size()) add_full(row[n].i + 1, row[end].i, slab);
      n = end;
    }
    return winding;
  }

  void add_voxel(const VoxelRecords& voxel, Slab& slab) {
    VoxelPieces found = finder_.find(voxel, options_.with_centres);
    const auto first = static_cast<std::uint32_t>(slab.pieces.size());
    for (std::uint32_t p = 0; p < found.count; ++p) {
      Piece piece{.i = voxel.i, .flags = static_cast<std::uint8_t>(found.count > 1 ? kOneOfSeveral : 0)};
      for (int a = 0; a < 8; ++a)
        piece.corners = static_cast<std::uint8_t>(piece.corners | (found.of_corner[a] == p) << a);
      if (found.of_corner[0] == p || (found.count == 1 && voxel.winding[0] < 0))
        piece.fill = voxel.winding[0];
      if (found.of_centre == p) piece.flags |= kContainsCentre;
      slab.pieces.push_back(piece);
    }
    add_records(voxel, found, first, slab);
    std::optional<LineFill> by_lines;
    if (found.count == 1 && (found.overlapping || found.undecided || impossible(slab.pieces[first].fill))) {
      by_lines = fill_by_lines(voxel);
      found.overlapping = by_lines->overlap;
      if (by_lines->overlap || impossible(slab.pieces[first].fill))
        slab.pieces[first].fill = by_lines->fill;
      else
        by_lines.reset();
    }
    // A shell that passes through itself may give one of several pieces less than nothing, or too much.
    for (std::uint32_t p = 0; p < found.count; ++p)
      slab.pieces[first + p].fill = std::clamp(slab.pieces[first + p].fill, 0., 1.);
    if (options_.with_moments) {
      if (by_lines)
        append_moments(by_lines->moments, first, slab);
      else
        moments_.find(voxel, found, first, slab);
    }
    if (options_.counted && !options_.counted->holds(voxel.i, voxel.j, voxel.k)) return;
    slab.split_voxels += found.count > 1;
    slab.undecided_voxels += found.undecided && !found.overlapping;
    slab.overlapping_voxels += found.overlapping;
  }

  // A surface that passes through itself encloses some of the voxel twice or the wrong way round.
  static bool impossible(double fill) { return fill < -1e-9 || fill > 1 + 1e-9; }

  static void add_records(const VoxelRecords& voxel, const VoxelPieces& found, std::uint32_t first,
                          Slab& slab) {
    const std::size_t split_begin = slab.split_traces.size(), trace_begin = slab.traces.size();
    for (std::size_t r = 0; r < voxel.records.size(); ++r) {
      const Record& record = voxel.records[r];
      const std::uint32_t p = first + (found.count > 1 ? found.of_record[r] : 0);
      const auto faces = static_cast<std::uint8_t>(record.sides >> kFirstPlaneBit);
      slab.pieces[p].fill += record.volume;
      slab.pieces[p].faces |= faces;
      if (const std::uint32_t polygon = voxel.mesh->polygon[record.triangle]; polygon != kNoPolygon)
        slab.traces.push_back({polygon, p});
      if (found.count > 1) slab.split_traces.push_back({p, record.triangle, faces});
    }
    if (found.count <= 1) return;
    std::sort(slab.split_traces.begin() + split_begin, slab.split_traces.end(),
              [](const SplitTrace& a, const SplitTrace& b) {
                return a.piece != b.piece ? a.piece < b.piece : a.triangle < b.triangle;
              });
    std::stable_sort(slab.traces.begin() + trace_begin, slab.traces.end(),
                     [](const Trace& a, const Trace& b) { return a.piece < b.piece; });
  }

  const PartMesh& mesh_;
  const ClassifyOptions& options_;
  SlabWindow window_;
  PieceFinder finder_;
  MomentFinder moments_;
  std::vector<Record> unsorted_, records_;
  std::vector<std::uint32_t> next_;
};

// The rows and columns of the box that the mesh reaches.
SlabWindow window_of(const PartMesh& mesh, const std::optional<VoxelBox>& box) {
  SlabWindow window;
  if (!box || mesh.vertices.empty()) return window;
  Vec3 low = mesh.vertices[0], high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  window.i_begin = std::max(box->lower[0], floor_int(low.x()));
  window.i_end = std::max(window.i_begin, std::min(box->upper[0], floor_int(high.x()) + 1));
  window.j_begin = std::max(box->lower[1], floor_int(low.y()));
  const int j_end = std::min(box->upper[1], floor_int(high.y()) + 1);
  window.left.assign(static_cast<std::size_t>(std::max(0, j_end - window.j_begin)), 0);
  return window;
}

}  // namespace

Voxels classify_closed(const PartMesh& mesh, const ClassifyOptions& options) {
  const Bins bins = bin_triangles(mesh, options.box);
  const SlabWindow window = window_of(mesh, options.box);
  Voxels voxels;
  voxels.k_begin = bins.k_begin;
  voxels.slabs.resize(bins.begin.size() - 1);
  ShareCounter done(voxels.slabs.size());
  parallel_chunks(voxels.slabs.size(), 2, [&](std::size_t begin, std::size_t end) {
    SlabBuilder builder(mesh, options, window);
    for (std::size_t s = begin; s < end; ++s)
      builder.build(bins.k_begin + static_cast<int>(s),
                    {bins.triangles.data() + bins.begin[s], bins.begin[s + 1] - bins.begin[s]},
                    voxels.slabs[s]);
    done.add(end - begin);
  });
  number_pieces(voxels);
  return voxels;
}

}  // namespace flexel::voxelize
