// Deformed body + its surface -> displacement of every vertex, and a report on how far it can be trusted.
#pragma once
#include <array>
#include <cstdint>
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

struct MapOptions {
  MapMethod method = MapMethod::blended;
};

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
  [[nodiscard]] const Frame& frame_of(std::size_t vertex) const { return frames[frame[vertex]]; }
};

enum MapFlag : std::uint8_t {
  kVoronoiCellLeft = 1,  // advisory: another element is now nearer than the origin
  kFrameInverted = 2,    // failure: the base changed its handedness
  kFrameDegenerate = 4,  // failure: the deformed base spans no volume
  kNotFinite = 8,        // failure
};

// Maps the deformed state of `body` onto the surface that travels in it (mapping/bind.h says how vertices are
// bound). Throws InputError: the body carries no surface, a part has no elements; Interrupted.
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress);
// The same with seats that are known (mapping/crack.h).
struct Seats;
[[nodiscard]] MapResult map_surface(const Body& body, const MapOptions& options, const Seats& seats,
                                    Progress& progress);

struct MapReport {
  std::size_t vertices = 0;
  std::size_t unreferenced = 0;  // of them, used by no polygon; they carry no flags
  std::size_t distinct_frames = 0;
  std::array<std::size_t, 4> kinds{};  // by FrameKind
  std::size_t widened = 0;             // vertices whose search was widened
  std::size_t voronoi_cell_left = 0, inverted = 0, degenerate = 0, not_finite = 0;
  double rest_residual = 0;                    // m
  double distance_outside = 0;                 // in spacings
  double largest_displacement = 0;             // m
  double volume_before = 0, volume_after = 0;  // m^3 enclosed by the surface
  CrackReport crack;
  [[nodiscard]] bool valid() const { return inverted == 0 && degenerate == 0 && not_finite == 0; }
};

[[nodiscard]] MapReport report(const Body& body, const MapResult& result);
// For people: first a sentence that says whether the mapping can be used and why, then the figures worth a
// look.
[[nodiscard]] std::vector<std::string> report_lines(const MapReport& report);
// Every key and unit is in docs/mapping.md.
[[nodiscard]] std::string report_json(const MapReport& report, const MapOptions& options);

}  // namespace flexel
