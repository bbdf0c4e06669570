// Deformed body + its surface -> displacement of every vertex, and a report on how far it can be trusted.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/body.h"
#include "formats/progress.h"
#include "mapping/crack_report.h"

namespace flexel {

// How the elements around a vertex carry it (docs/mapping.md compares them).
enum class MapMethod {
  gram_schmidt,  // the paper's: the orthonormal base of four elements
  affine,        // the edges of the same four elements
  blended,       // the frames of all elements around, blended with two continuous derivatives
  smooth,        // moving least squares, quadratic
};

// What holds a vertex. Later kinds are what is left when no four close elements span space.
enum class FrameKind : std::uint8_t { full, plane, line, rigid };

// "gram-schmidt", "affine", "blended" or "smooth"; InputError for any other word, with the nearest.
[[nodiscard]] MapMethod map_method(const std::string& name);
[[nodiscard]] std::string name_of(MapMethod method);

// What becomes of vertices that lie too far outside the lattice.
enum class FarVertices {
  follow,  // their frames, extrapolated: a distance blows up what the elements say
  rigid,   // the rotation of the frame of their origin, without its stretch
  refuse,
};
// "follow", "rigid" or "refuse"; InputError for any other word, with the nearest.
[[nodiscard]] FarVertices far_vertices(const std::string& name);

struct MapOptions {
  MapMethod method = MapMethod::blended;
  FarVertices far = FarVertices::follow;
  double far_distance = 3;          // in spacings, beyond half a voxel's diagonal from the nearest element
  bool check_voronoi = false;       // compares the Voronoi neighbours of every origin
  bool check_intersection = false;  // counts new self-intersections of the surface
};
// "voronoi" or "self-intersection", several with commas; InputError for any other word, with the nearest.
void add_checks(MapOptions& options, const std::string& names);

// Elements of one part, each connected with the one before it or with the origin through other elements.
struct Frame {
  std::array<std::uint32_t, 4> elements{};  // origin, primary axis, two secondary; the origin again where the
                                            // kind has fewer
  FrameKind kind = FrameKind::rigid;
  std::uint8_t rings = 0;  // how many times the search along connections was widened
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
  std::optional<std::size_t> new_self_intersections;  // where it was asked for
  [[nodiscard]] const Frame& frame_of(std::size_t vertex) const { return frames[frame[vertex]]; }
};

enum MapFlag : std::uint8_t {
  kVoronoiCellLeft = 1,  // advisory: another element is now nearer than the origin
  kFrameInverted = 2,    // failure: the base changed its handedness
  kFrameDegenerate = 4,  // failure: the deformed base spans no volume
  kNotFinite = 8,        // failure
  kVoronoiChanged = 16,  // advisory: the origin has other Voronoi neighbours (where it was checked)
};

// Maps the deformed state of `body` onto the surface that travels in it (mapping/bind.h says how vertices are
// bound). Throws InputError: the body carries no surface, a part has no elements; Interrupted.
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress);
// The same with seats that are known (mapping/crack.h).
struct Seats;
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, const Seats& seats,
                                    Progress& progress);

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
  double largest_displacement = 0;   // m, of vertices and of the points that were looked at
  std::size_t coarse_triangles = 0;  // that miss more than kCoarseShare of it (mapping/chord.h)
  [[nodiscard]] double share() const { return largest_displacement > 0 ? largest / largest_displacement : 0; }
};

struct MapReport {
  std::size_t vertices = 0;
  std::size_t unreferenced = 0;  // of them, used by no polygon; they carry no flags
  std::size_t distinct_frames = 0;
  std::array<std::size_t, 4> kinds{};  // by FrameKind
  std::size_t widened = 0;             // vertices whose search was widened
  std::size_t far = 0;                 // carried rigidly
  std::size_t voronoi_cell_left = 0, inverted = 0, degenerate = 0, not_finite = 0;
  std::optional<std::size_t> voronoi_changed, new_self_intersections;  // where they were checked
  double rest_residual = 0;                                            // m
  double distance_outside = 0;                                         // in spacings
  double largest_displacement = 0;                                     // m
  double largest_strain = 0;                                           // |principal stretch - 1| at a vertex
  SurfaceQuality quality;
  std::optional<ChordError> chord;  // nothing of a surface that was cut along cracks
  double lattice_volume_before = 0, lattice_volume_after = 0;  // m^3 of matter in whole cells; 0: no cells
  CrackReport crack;
  // The places of the vertices can be trusted.
  [[nodiscard]] bool placed() const {
    return inverted == 0 && degenerate == 0 && not_finite == 0 && new_self_intersections.value_or(0) == 0;
  }
  // And so can the triangles between them.
  [[nodiscard]] bool valid() const { return placed() && (!chord || chord->coarse_triangles == 0); }
};

// `cut`: the surface in the body is not its own but was cut along cracks (mapping/crack.h).
[[nodiscard]] MapReport report(const Body& body, const MapResult& result, bool cut = false);
// For people: first a sentence that says whether the mapping can be used and why, then the figures worth a
// look.
[[nodiscard]] std::vector<std::string> report_lines(const MapReport& report);
// Every key and unit is in docs/mapping.md.
[[nodiscard]] std::string report_json(const MapReport& report, const MapOptions& options);
// The same as a table of two columns, for reading.
[[nodiscard]] std::string report_table(const MapReport& report, const MapOptions& options);

}  // namespace flexel
