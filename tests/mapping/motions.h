// Bodies and known motions of all their elements, for measuring how well a mapping follows: in tests and in
// the table of convergence (bench/mapping).
#pragma once
#include <algorithm>

#include "bodies.h"
#include "mapping/methods/map_surface.h"
#include "mapping/types/result.h"

namespace flexel::mapping::test {

constexpr std::array<MapMethod, 4> kEveryMethod = {&kGramSchmidt, &kAffine, &kBlended, &kSmooth};
// For the names of tests: "gram_schmidt".
inline std::string test_name(MapMethod method) {
  std::string name = name_of(method);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

inline Progress& silent() {
  static Progress progress("test", Progress::Mode::quiet);
  return progress;
}
inline MapResult map_quietly(const Body& body, const MapOptions& options) {
  return map_surface(body, options, silent());
}
inline MapResult map_quietly(const Body& body, MapMethod method = &kAffine) {
  return map_quietly(body, MapOptions{method});
}

// The round bar of the study: diameter 1, length 8 along x, its lattice turned and shifted against it;
// `across` voxels to the diameter.
Body round_bar(int across, Placement placement, int along_vertices = 128, int around_vertices = 48);
// A trefoil tube of diameter 1, about 8 across, so that strands pass each other; its lattice is turned too.
Body knot(int across, Placement placement);

// A bar of 80 x 8 x 8 cells along x under six quads, so large that their cells are looked for where the points are.
constexpr double kBarLength = 4, kBarSide = 0.4, kBarSpacing = 0.05;
Body coarse_bar();
// Bends that bar along a circle by an angle over its length; the fibres at the height `neutral` keep their length.
Vec3 along_circle(const Vec3& p, double angle, double neutral);

Vec3 bend(const Vec3& p);     // of the bar: half a circle
Vec3 twist(const Vec3& p);    // one full turn over a length of 8
Vec3 stretch(const Vec3& p);  // to twice its length, keeping the volume
Vec3 turn(const Vec3& p);     // a rigid motion

// Distance of the mapped vertices from where `field` takes them [m].
double largest_error(const Body& body, const std::vector<Vec3>& displacement, const Field& field);
double rms_error(const Body& body, const std::vector<Vec3>& displacement, const Field& field);
// Root mean square, over edges between triangles, of the difference between the angle of their normals and
// that of the exact surface [degrees].
double normal_jump(const Body& body, const std::vector<Vec3>& displacement, const Field& field);

}  // namespace flexel::mapping::test
