// The records of a voxel are grouped into fragments: triangles that share a mesh edge inside the voxel. A
// fragment is a connected sheet with its rim on the voxel's faces, so k fragments cut the voxel into k + 1
// regions that form a tree, and each fragment has one solid region on its inner side. One fragment: one
// piece. More: from an inner point M spokes go to a point on each fragment and to each corner. The voxel is
// convex, so spokes stay in it; along a spoke crossings with the surface alternate between entering and
// leaving, and the fragments on either side of a solid stretch bound the same piece. The spokes through M
// visit every edge of the tree, so this finds all of them. A spoke that does not alternate met a tie (or
// shells that intersect): another M is tried. A voxel is an overlap where winding numbers other than 0 and 1
// occur or triangles of different shells intersect.
//
// Spoke against triangle: signs of the volumes spanned by the spoke and each edge, computed the same way for
// both triangles of an edge, so that a spoke never slips between two neighbours (Plucker coordinates; Platis
// and Theoharis, 2003).
#include "voxelize/classify/pieces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/math/distance.h"

namespace flexel::voxelize {
namespace {

constexpr double kTouching = 1e-7;  // in cells: surfaces this close touch, and matter continues across
constexpr double kBelowLattice =
    1e-7;  // corners lie this far below lattice planes, where flush faces lie (see clip.cpp)

struct Crossing {
  double at;   // along the spoke, 0 to 1
  int change;  // of winding number going along: +1 entering
  std::uint32_t fragment;
  bool operator<(const Crossing& other) const { return at < other.at; }
};

TrianglePoints points_of(const PartMesh& mesh, std::uint32_t triangle) {
  const Corners& c = mesh.corners[triangle];
  return {&mesh.vertices[c[0]], &mesh.vertices[c[1]], &mesh.vertices[c[2]]};
}

// Sign of det(to - from, b - from, c - from) with the edge (b, c) taken in a fixed order; a tie counts as
// positive in that order.
int edge_side(const Vec3& from, const Vec3& to, const Vec3& b, const Vec3& c, bool swapped) {
  const Vec3 p = (swapped ? c : b) - from, q = (swapped ? b : c) - from;
  const int sign = (to - from).dot(p.cross(q)) < 0 ? -1 : 1;
  return swapped ? -sign : sign;
}

// +1 where the segment enters through the triangle (against its normal), -1 where it leaves, 0 where it
// misses. `at` is set.
int cross_triangle(const Vec3& from, const Vec3& to, const PartMesh& mesh, std::uint32_t triangle,
                   double& at) {
  const Corners& c = mesh.corners[triangle];
  const auto& v = mesh.vertices;
  const int s0 = edge_side(from, to, v[c[0]], v[c[1]], c[0] > c[1]);
  if (edge_side(from, to, v[c[1]], v[c[2]], c[1] > c[2]) != s0) return 0;
  if (edge_side(from, to, v[c[2]], v[c[0]], c[2] > c[0]) != s0) return 0;
  const Vec3 normal = (v[c[1]] - v[c[0]]).cross(v[c[2]] - v[c[0]]);
  const double start = normal.dot(from - v[c[0]]), end = normal.dot(to - v[c[0]]);
  if ((start < 0) == (end < 0)) return 0;
  at = start / (start - end);
  return start < 0 ? -1 : 1;
}

// Point on a record's clipped polygon and the polygon's area.
struct Foot {
  Vec3 point = Vec3::Zero();
  double area = 0;
  std::uint32_t record = 0;
};

Foot foot_of(const VoxelRecords& voxel, std::uint32_t record) {
  const Polygon polygon =
      clip_to_voxel(points_of(*voxel.mesh, voxel.records[record].triangle), voxel.i, voxel.j, voxel.k);
  Foot foot{.record = record};
  const auto at = [&](int v) {
    return Vec3(polygon.corner[v][0], polygon.corner[v][1], polygon.corner[v][2]);
  };
  Vec3 twice_area = Vec3::Zero();
  for (int v = 0; v < polygon.count; ++v) {
    foot.point += at(v) / polygon.count;
    if (v > 0 && v + 1 < polygon.count) twice_area += (at(v) - at(0)).cross(at(v + 1) - at(0));
  }
  foot.area = twice_area.norm() / 2;
  return foot;
}

// Crossings from `from` to `to`, in order; the record `skip` is left out.
void cross_all(const VoxelRecords& voxel, const std::vector<std::uint32_t>& fragment, const Vec3& from,
               const Vec3& to, std::uint32_t skip, std::vector<Crossing>& crossings) {
  for (std::uint32_t r = 0; r < voxel.records.size(); ++r) {
    double at = 0;
    if (r == skip) continue;
    if (const int change = cross_triangle(from, to, *voxel.mesh, voxel.records[r].triangle, at))
      crossings.push_back({at, change, fragment[r]});
  }
  std::sort(crossings.begin(), crossings.end());
}

// Whether crossings enter and leave in turn. Two at one place may be taken in either order.
bool alternates(std::vector<Crossing>& crossings, double touching) {
  for (std::size_t c = 1; c < crossings.size(); ++c) {
    if (crossings[c].change != crossings[c - 1].change) continue;
    if (c + 1 == crossings.size() || crossings[c + 1].change == crossings[c].change) return false;
    if (crossings[c + 1].at - crossings[c].at > touching) return false;
    std::swap(crossings[c].fragment, crossings[c + 1].fragment);
    std::swap(crossings[c].change, crossings[c + 1].change);
  }
  return true;
}

// The star of spokes around one inner point M.
class Star {
 public:
  Star(const VoxelRecords& voxel, const std::vector<std::uint32_t>& fragment, const Vec3& centre)
      : voxel_(voxel), fragment_(fragment), centre_(centre) {}

  // From a point on a fragment to M. False: a tie.
  bool add_foot(const Foot& foot, DisjointSets& sets) {
    const Corners& c = voxel_.mesh->corners[voxel_.records[foot.record].triangle];
    const auto& v = voxel_.mesh->vertices;
    const Vec3 normal = (v[c[1]] - v[c[0]]).cross(v[c[2]] - v[c[0]]);
    const double slope = normal.dot(centre_ - foot.point);
    if (std::abs(slope) <= 1e-9 * normal.norm()) return false;
    crossings_.assign(1, {0, slope < 0 ? 1 : -1, fragment_[foot.record]});
    cross_all(voxel_, fragment_, foot.point, centre_, foot.record, crossings_);
    return add(sets, (centre_ - foot.point).norm());
  }

  // From a point whose winding number is known to M; returns the fragment that bounds its piece there, -1 in
  // the void, -2 for M's own region. False: a tie.
  bool add_point(const Vec3& point, bool solid, DisjointSets& sets, std::int64_t& bound) {
    crossings_.clear();
    cross_all(voxel_, fragment_, point, centre_, VoxelPieces::kVoid, crossings_);
    if (!crossings_.empty() && (crossings_.front().change < 0) != solid) return false;
    if (crossings_.empty() && !agree(solid)) return false;
    bound = !solid ? -1 : crossings_.empty() ? -2 : static_cast<std::int64_t>(crossings_.front().fragment);
    return crossings_.empty() || add(sets, (centre_ - point).norm());
  }

  [[nodiscard]] std::uint32_t centre_fragment() const { return centre_fragment_; }

 private:
  bool agree(bool solid) {
    if (known_ && solid_ != solid) return false;
    known_ = true;
    solid_ = solid;
    return true;
  }

  bool add(DisjointSets& sets, double length) {
    const double touching = kTouching / length;
    if (!alternates(crossings_, touching) || !agree(crossings_.back().change > 0)) return false;
    for (std::size_t c = 1; c < crossings_.size(); ++c)
      if (crossings_[c].change < 0 || crossings_[c].at - crossings_[c - 1].at <= touching)
        sets.unite(crossings_[c - 1].fragment, crossings_[c].fragment);
    if (solid_) {
      if (centre_fragment_ == VoxelPieces::kVoid) centre_fragment_ = crossings_.back().fragment;
      sets.unite(centre_fragment_, crossings_.back().fragment);
    }
    return true;
  }

  const VoxelRecords& voxel_;
  const std::vector<std::uint32_t>& fragment_;
  Vec3 centre_;
  std::vector<Crossing> crossings_;
  bool known_ = false, solid_ = false;
  std::uint32_t centre_fragment_ = VoxelPieces::kVoid;  // a fragment around M's region, once known
};

// Inner points to try for M, in the unit voxel: irregular, so that no symmetric surface ties with all.
constexpr std::array<std::array<double, 3>, 8> kCentres = {{{.5113, .4871, .5237},
                                                            {.3719, .6131, .4327},
                                                            {.6473, .4409, .3851},
                                                            {.2903, .3307, .6691},
                                                            {.7219, .6823, .6113},
                                                            {.4139, .2411, .3163},
                                                            {.5923, .7607, .2713},
                                                            {.1709, .5521, .7873}}};

Vec3 corner_point(const VoxelRecords& voxel, int a) {
  return Vec3(voxel.i + (a & 1), voxel.j + (a >> 1 & 1), voxel.k + (a >> 2)) - Vec3::Constant(kBelowLattice);
}

// Joins records that have an edge in common.
void join_at_edges(std::vector<std::array<std::uint32_t, 2>>& edge_records, DisjointSets& sets) {
  constexpr std::size_t kFew = 40;  // up to here comparing all with all is faster than sorting
  if (edge_records.size() <= kFew) {
    for (std::size_t e = 1; e < edge_records.size(); ++e)
      for (std::size_t f = 0; f < e; ++f)
        if (edge_records[f][0] == edge_records[e][0]) {
          sets.unite(edge_records[f][1], edge_records[e][1]);
          break;
        }
    return;
  }
  std::sort(edge_records.begin(), edge_records.end());
  for (std::size_t e = 1; e < edge_records.size(); ++e)
    if (edge_records[e][0] == edge_records[e - 1][0]) sets.unite(edge_records[e][1], edge_records[e - 1][1]);
}

// Groups the records into fragments, numbered by first record. Returns how many.
std::uint32_t group_fragments(const VoxelRecords& voxel, PieceFinder& finder) {
  const auto n = static_cast<std::uint32_t>(voxel.records.size());
  finder.fragment.assign(n, 0);
  if (n == 1) return 1;
  finder.edge_records.clear();
  for (std::uint32_t r = 0; r < n; ++r)
    for (int e = 0; e < 3; ++e)
      if (voxel.records[r].sides >> e & 1)
        finder.edge_records.push_back({voxel.mesh->edges[voxel.records[r].triangle][e], r});
  finder.sets.reset(n);
  join_at_edges(finder.edge_records, finder.sets);
  std::uint32_t count = 0;
  for (std::uint32_t r = 0; r < n; ++r) {
    const std::uint32_t root = finder.sets.root(r);
    finder.fragment[r] = root == r ? count++ : finder.fragment[root];
  }
  return count;
}

// The segment passes through the inside of the triangle, by more than rounding: triangles that only touch, or
// lie in one plane, do not intersect.
bool pierces(const Vec3& from, const Vec3& to, const PartMesh& mesh, std::uint32_t triangle) {
  const TrianglePoints p = points_of(mesh, triangle);
  const Vec3 u = *p[1] - *p[0], v = *p[2] - *p[0], normal = u.cross(v);
  const double squared_norm = normal.squaredNorm(), margin = kTouching * std::sqrt(squared_norm);
  const double start = normal.dot(from - *p[0]), end = normal.dot(to - *p[0]);
  if (std::min(start, end) > -margin || std::max(start, end) < margin) return false;
  const Vec3 at = from + start / (start - end) * (to - from) - *p[0];
  const double s = normal.dot(at.cross(v)) / squared_norm, t = normal.dot(u.cross(at)) / squared_norm;
  return s > kTouching && t > kTouching && s + t < 1 - kTouching;
}

// Two triangles pass through each other: an edge of one pierces the other.
bool intersect(const PartMesh& mesh, std::uint32_t a, std::uint32_t b) {
  for (int turn = 0; turn < 2; ++turn, std::swap(a, b))
    for (int e = 0; e < 3; ++e)
      if (pierces(mesh.vertices[mesh.corners[a][e]], mesh.vertices[mesh.corners[a][(e + 1) % 3]], mesh, b))
        return true;
  return false;
}

// Whether the bounding boxes of two triangles overlap.
bool boxes_overlap(const PartMesh& mesh, std::uint32_t a, std::uint32_t b) {
  const TrianglePoints p = points_of(mesh, a), q = points_of(mesh, b);
  return (p[0]->cwiseMin(*p[1]).cwiseMin(*p[2]).array() <= q[0]->cwiseMax(*q[1]).cwiseMax(*q[2]).array())
             .all() &&
         (q[0]->cwiseMin(*q[1]).cwiseMin(*q[2]).array() <= p[0]->cwiseMax(*p[1]).cwiseMax(*p[2]).array())
             .all();
}

// Triangles of different shells pass through each other in the voxel.
bool shells_intersect(const VoxelRecords& voxel) {
  constexpr std::size_t kTooMany =
      4096;  // a voxel that coarse is taken as overlapping: pairs would take too long
  const PartMesh& mesh = *voxel.mesh;
  const std::uint32_t first = mesh.shell[voxel.records[0].triangle];
  const bool several = std::any_of(voxel.records.begin(), voxel.records.end(), [&](const Record& record) {
    return mesh.shell[record.triangle] != first;
  });
  if (!several || voxel.records.size() > kTooMany) return several;
  for (std::size_t r = 1; r < voxel.records.size(); ++r)
    for (std::size_t s = 0; s < r; ++s) {
      const std::uint32_t a = voxel.records[r].triangle, b = voxel.records[s].triangle;
      if (mesh.shell[a] != mesh.shell[b] && boxes_overlap(mesh, a, b) && intersect(mesh, a, b)) return true;
    }
  return false;
}

bool overlaps(const VoxelRecords& voxel) {
  for (const int w : voxel.winding)
    if (w != 0 && w != 1) return true;
  return voxel.mesh->shell_count > 1 && shells_intersect(voxel);
}

// Fragments that have an area, each with the point on its largest polygon.
std::vector<Foot> feet_of(const VoxelRecords& voxel, const std::vector<std::uint32_t>& fragment,
                          std::uint32_t count) {
  constexpr double kNoArea = 1e-10;  // a fragment that only touches the voxel
  std::vector<Foot> feet(count);
  for (std::uint32_t r = 0; r < voxel.records.size(); ++r) {
    const Foot foot = foot_of(voxel, r);
    if (foot.area > feet[fragment[r]].area) feet[fragment[r]] = foot;
  }
  std::erase_if(feet, [](const Foot& foot) { return foot.area < kNoArea; });
  return feet;
}

// The record that the voxel's centre lies on, or kVoid. Such a centre is inside, whichever side the matter is on: so
// mirrored parts get mirrored elements.
std::uint32_t record_at_centre(const VoxelRecords& voxel) {
  constexpr double kOn = 1e-9;  // voxels
  const Vec3 middle(voxel.i + .5, voxel.j + .5, voxel.k + .5);
  for (std::uint32_t r = 0; r < voxel.records.size(); ++r) {
    const TrianglePoints p = points_of(*voxel.mesh, voxel.records[r].triangle);
    if (distance_to_triangle(middle, *p[0], *p[1], *p[2]) <= kOn) return r;
  }
  return VoxelPieces::kVoid;
}

// Joins fragments by a star around `centre`. Returns false on a tie; `bounds` gets what bounds each corner
// and the voxel's centre.
bool join_by_star(const VoxelRecords& voxel, const std::vector<std::uint32_t>& fragment,
                  const std::vector<Foot>& feet, const Vec3& centre, bool with_centre, DisjointSets& sets,
                  std::array<std::int64_t, 9>& bounds) {
  Star star(voxel, fragment, centre);
  for (const Foot& foot : feet)
    if (!star.add_foot(foot, sets)) return false;
  for (int a = 0; a < 8; ++a)
    if (!star.add_point(corner_point(voxel, a), voxel.winding[a] > 0, sets, bounds[a])) return false;
  bounds[8] = -1;
  if (const std::uint32_t on = with_centre ? record_at_centre(voxel) : VoxelPieces::kVoid;
      on != VoxelPieces::kVoid) {
    bounds[8] = fragment[on];
  } else if (with_centre) {
    const Vec3 middle(voxel.i + .5, voxel.j + .5, voxel.k + .5);
    if (!star.add_point(middle, winding_at(voxel, middle) > 0, sets, bounds[8])) return false;
  }
  for (std::int64_t& bound : bounds)
    if (bound == -2) {
      if (star.centre_fragment() == VoxelPieces::kVoid) return false;
      bound = star.centre_fragment();
    }
  return true;
}

VoxelPieces one_piece(const VoxelRecords& voxel, bool with_centre) {
  VoxelPieces pieces;
  for (int a = 0; a < 8; ++a) pieces.of_corner[a] = voxel.winding[a] > 0 ? 0 : VoxelPieces::kVoid;
  if (with_centre && (record_at_centre(voxel) != VoxelPieces::kVoid ||
                      winding_at(voxel, Vec3(voxel.i + .5, voxel.j + .5, voxel.k + .5)) > 0))
    pieces.of_centre = 0;
  return pieces;
}

// Numbers the pieces by first record.
void number_by_record(const std::vector<std::uint32_t>& fragment, std::uint32_t fragments, DisjointSets& sets,
                      const std::array<std::int64_t, 9>& bounds, VoxelPieces& pieces) {
  std::vector<std::uint32_t> number(fragments, VoxelPieces::kVoid);
  pieces.count = 0;
  for (std::uint32_t f = 0; f < fragments; ++f) {
    const std::uint32_t root = sets.root(f);
    number[f] = root == f ? pieces.count++ : number[root];
  }
  for (const std::uint32_t f : fragment) pieces.of_record.push_back(number[f]);
  const auto of = [&](std::int64_t bound) {
    return bound < 0 ? VoxelPieces::kVoid : number[static_cast<std::size_t>(bound)];
  };
  for (int a = 0; a < 8; ++a) pieces.of_corner[a] = of(bounds[a]);
  pieces.of_centre = of(bounds[8]);
}

// The corner that the surface passes farthest from, of the first that are clear of it: which side a corner on the surface
// is on depends on the way there.
int clear_corner(const VoxelRecords& voxel) {
  constexpr double kClear = 1e-4;  // cells
  int best = 0;
  double farthest = -1;
  for (int a = 0; a < 8 && farthest < kClear; ++a) {
    double distance = 1;
    for (const Record& record : voxel.records) {
      const TrianglePoints p = points_of(*voxel.mesh, record.triangle);
      distance = std::min(distance, distance_to_triangle(corner_point(voxel, a), *p[0], *p[1], *p[2]));
    }
    if (distance > farthest) {
      farthest = distance;
      best = a;
    }
  }
  return best;
}

}  // namespace

// The way from the corner to the point bends at an irregular place: a straight one from the corner to the
// voxel's centre would run through a box's own corner, where the signs of the edges tie.
int winding_at(const VoxelRecords& voxel, const Vec3& point) {
  const Vec3 bend = Vec3(voxel.i, voxel.j, voxel.k) + Vec3(kCentres[0][0], kCentres[0][1], kCentres[0][2]);
  const int corner = clear_corner(voxel);
  int winding = voxel.winding[corner];
  for (const Record& record : voxel.records) {
    double at = 0;
    winding += cross_triangle(corner_point(voxel, corner), bend, *voxel.mesh, record.triangle, at);
    winding += cross_triangle(bend, point, *voxel.mesh, record.triangle, at);
  }
  return winding;
}

VoxelPieces PieceFinder::find(const VoxelRecords& voxel, bool with_centre) {
  const std::uint32_t fragments = group_fragments(voxel, *this);
  VoxelPieces pieces = one_piece(voxel, with_centre);
  pieces.overlapping = overlaps(voxel);
  if (fragments == 1 || pieces.overlapping) return pieces;
  const std::vector<Foot> feet = feet_of(voxel, fragment, fragments);
  const Vec3 origin(voxel.i, voxel.j, voxel.k);
  for (const auto& centre : kCentres) {
    sets.reset(fragments);
    std::array<std::int64_t, 9> bounds{};
    if (!join_by_star(voxel, fragment, feet, origin + Vec3(centre[0], centre[1], centre[2]), with_centre,
                      sets, bounds))
      continue;
    number_by_record(fragment, fragments, sets, bounds, pieces);
    if (pieces.count == 1) pieces.of_record.clear();
    return pieces;
  }
  pieces.undecided = true;
  return pieces;
}

}  // namespace flexel::voxelize
