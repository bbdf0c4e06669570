// Results of a mapping: displacements of the vertices, and checks of their validity.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/math/vec.h"
#include "mapping/types/crack_report.h"
#include "mapping/types/options.h"

namespace flexel::mapping {

// Elements of one part, each connected with the one before it or with the origin through other elements.
struct Frame {
  std::array<std::uint32_t, 4> elements{};  // origin, primary axis, two secondary; the origin again where the
                                            // kind has fewer
  FrameKind kind = FrameKind::rigid;
  std::uint8_t rings = 0;  // how many times the search along connections was widened
};

// Pairs of triangles without a common corner that meet in the deformed surface and did not at rest. Parts that touch
// are pressed into each other a little; one part that meets itself, or another one deeply, has passed through.
struct SurfaceMeetings {
  std::size_t self = 0;     // of one part
  std::size_t between = 0;  // of two parts
  std::size_t through = 0;  // of these, deeper than a quarter of the smaller spacing
  double deepest = 0;       // m, between parts: the least way that parts such a pair along one of its normals
  [[nodiscard]] bool sound() const { return self == 0 && through == 0; }
};

struct MapResult {
  std::vector<Vec3> displacement;        // (vertices x 3) m
  std::vector<std::uint8_t> flags;       // (vertices) bits of MapFlag
  std::vector<Frame> frames;             // distinct; every vertex has one, whatever the method evaluates
  std::vector<std::uint32_t> frame;      // (vertices) index into frames
  std::vector<std::uint8_t> referenced;  // (vertices) 1: some polygon uses it
  double rest_residual = 0;              // m, largest distance of a vertex rebuilt at rest from itself
  double distance_outside = 0;  // in spacings, largest distance of a vertex from its nearest element, less
                                // half a voxel's diagonal
  std::size_t far = 0;          // vertices carried rigidly because they lie too far outside
  bool voronoi_checked = false;
  std::optional<SurfaceMeetings> new_meetings;  // where it was asked for
  [[nodiscard]] const Frame& frame_of(std::size_t vertex) const { return frames[frame[vertex]]; }
};

enum MapFlag : std::uint8_t {
  kVoronoiCellLeft = 1,  // advisory: another element is now nearer than the origin
  kFrameInverted = 2,    // failure: the base changed its handedness
  kFrameDegenerate = 4,  // failure: the deformed base spans no volume
  kNotFinite = 8,        // failure
  kVoronoiChanged = 16,  // advisory: the origin has other Voronoi neighbours (where it was checked)
};

// What the deformation did to the triangles; angles in degrees. Triangles without area at rest are left out.
struct SurfaceQuality {
  std::size_t triangles = 0;
  std::size_t flipped = 0;  // turned over against the frames that carry their corners
  std::size_t folded = 0;   // at an edge that was below 90 degrees and is now bent by over 150
  double smallest_angle_before = 0, smallest_angle_after = 0;
  double area_before = 0, area_after = 0;      // m^2
  double volume_before = 0, volume_after = 0;  // m^3 enclosed by all parts together
  double largest_normal_jump_added = 0;        // between neighbouring triangles
};

// How far points of the surface lie, deformed, from the flat triangles of their deformed corners.
struct ChordError {
  double largest = 0;                // m
  Vec3 at = Vec3::Zero();            // m, where that point is at rest
  double longest_edge = 0;           // m, at rest, of the triangle that it is on
  double largest_displacement = 0;   // m, of vertices and of the sampled points
  std::size_t coarse_triangles = 0;  // that miss too much (mapping/report/chord.h)
  [[nodiscard]] double share() const { return largest_displacement > 0 ? largest / largest_displacement : 0; }
};

// What would split triangles that are too coarse.
enum class SplitAdvice {
  length,       // --refine with a length
  new_binding,  // that too, and a binding for the surface that is split
  none,         // nothing: the file cannot be split
};

struct MapReport {
  std::size_t vertices = 0;
  std::size_t unreferenced = 0;  // of them, used by no polygon; they carry no flags
  std::size_t distinct_frames = 0;
  std::array<std::size_t, 4> kinds{};  // by FrameKind
  std::size_t widened = 0;             // vertices whose search was widened
  std::size_t far = 0;                 // carried rigidly
  std::size_t voronoi_cell_left = 0, inverted = 0, degenerate = 0, not_finite = 0;
  std::optional<std::size_t> voronoi_changed;   // where they were checked
  std::optional<SurfaceMeetings> new_meetings;  // likewise
  double rest_residual = 0;                     // m
  double distance_outside = 0;                  // in spacings
  double largest_displacement = 0;              // m
  double largest_strain = 0;                    // |principal stretch - 1| at a vertex
  SurfaceQuality quality;
  std::optional<ChordError> chord;        // nothing of a surface that was cut along cracks
  std::optional<std::size_t> split_from;  // triangles, before they were split to show the deformation
  SplitAdvice split_advice = SplitAdvice::length;
  double lattice_volume_before = 0, lattice_volume_after = 0;  // m^3 of matter in whole cells; 0: no cells
  CrackReport crack;
  // The places of the vertices can be trusted.
  [[nodiscard]] bool placed() const {
    return inverted == 0 && degenerate == 0 && not_finite == 0 && (!new_meetings || new_meetings->sound());
  }
  // And so can the triangles between them.
  [[nodiscard]] bool valid() const { return placed() && (!chord || chord->coarse_triangles == 0); }
};

}  // namespace flexel::mapping
