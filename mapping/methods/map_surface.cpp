// The passes in order: bind at rest, map the state, lay out what is known of each vertex.
#include "mapping/methods/map_surface.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/nearest_word.h"
#include "base/program/share_scope.h"
#include "base/stop.h"
#include "mapping/anchors/frame.h"
#include "mapping/checks/cgal_checks.h"
#include "mapping/methods/apply.h"
#include "mapping/methods/bind.h"

namespace flexel::mapping {

namespace {

// The rotation nearest to a deformation gradient (its polar factor); the identity where it has none.
Mat3 rotation_of(const Mat3& gradient) {
  if (!gradient.allFinite()) return Mat3::Identity();
  const NearestRotation nearest = nearest_rotation(gradient);
  return nearest.sense > 0 ? nearest.rotation : Mat3(Mat3::Identity());
}

void treat_far_vertices(const Body& body, const MapOptions& options, MapResult& result) {
  if (options.far == FarVertices::follow) return;
  const std::vector<Mat3> gradients = deformation_gradients(result.frames, body.rest, body.position);
  for (std::size_t v = 0; v < result.frame.size(); ++v) {
    const Vec3& vertex = body.surface.vertices[v];
    const double outside = distance_outside(body, result.frame_of(v), vertex);
    if (outside <= options.far_distance) continue;
    if (options.far == FarVertices::refuse)
      throw InputError(fmt::format(
          "vertex {} lies {:.3g} spacings outside the lattice (at most {:g} are allowed): is the file in the "
          "part's own place and unit? --far rigid or follow takes it all the same",
          v + 1, outside, options.far_distance));
    const std::uint32_t origin = result.frame_of(v).elements[0];
    const Mat3 turned = rotation_of(gradients[result.frame[v]]) - Mat3::Identity();
    result.displacement[v] =
        body.position[origin] - body.rest[origin] + turned * (vertex - body.rest[origin]);
    ++result.far;
  }
}

void make_checks(const Body& body, const MapOptions& options, MapResult& result) {
  const bool finite = std::none_of(result.flags.begin(), result.flags.end(),
                                   [](std::uint8_t flags) { return (flags & kNotFinite) != 0; });
  if (options.check_voronoi && finite) {
    const std::vector<std::uint8_t> changed = voronoi_changes(body, result);
    for (std::size_t v = 0; v < result.flags.size(); ++v)
      if (result.referenced[v] && changed[result.frame_of(v).elements[0]]) result.flags[v] |= kVoronoiChanged;
    result.voronoi_checked = true;
  }
  if (options.check_intersection && finite) result.new_meetings = new_meetings(body, result.displacement);
}

// Of the time: where vertices have their anchors, and where the state is mapped.
constexpr double kLocated = 0.3, kMapped = 0.95, kMappedBeforeChecks = 0.4;

const std::vector<std::string> kFarNames = {"follow", "rigid", "refuse"};  // by FarVertices
const std::vector<std::string> kChecks = {"voronoi", "self-intersection"};

}  // namespace

FarVertices far_vertices(const std::string& name) {
  const auto found = std::find(kFarNames.begin(), kFarNames.end(), name);
  if (found != kFarNames.end()) return static_cast<FarVertices>(found - kFarNames.begin());
  throw InputError(
      fmt::format("--far \"{}\": {}{}", name, fmt::join(kFarNames, ", "), did_you_mean(name, kFarNames)));
}

void add_checks(MapOptions& options, const std::string& names) {
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = names.substr(begin, end - begin);
    begin = end + 1;
    if (name == kChecks[0])
      options.check_voronoi = true;
    else if (name == kChecks[1])
      options.check_intersection = true;
    else
      throw InputError(
          fmt::format("--check \"{}\": {}{}", name, fmt::join(kChecks, ", "), did_you_mean(name, kChecks)));
  }
}

MapResult map_state(const Binding& binding, const Body& body) {
  MapResult result;
  result.displacement = apply(binding, body, body.position);
  check_stop();
  result.flags = judge(binding, body, body.position, result.displacement);
  result.frames = binding.frames;
  result.frame = binding.frame;
  result.referenced = binding.referenced;
  result.rest_residual = binding.rest_residual;
  result.distance_outside = binding.distance_outside;
  return result;
}

void complete(const Body& body, const MapOptions& options, MapResult& result) {
  treat_far_vertices(body, options, result);
  make_checks(body, options, result);
}

MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress) {
  const VertexAnchors anchors = [&] {
    const ShareScope locating(progress, 0, kLocated, "binding vertices");
    return locate_vertices(body);
  }();
  return map_surface(body, options, anchors, progress);
}

MapResult map_surface(const Body& body, const MapOptions& options, const VertexAnchors& anchors,
                      Progress& progress) {
  const bool checks = options.check_voronoi || options.check_intersection;
  const double mapped = checks ? kMappedBeforeChecks : kMapped;
  MapResult result = [&] {
    const ShareScope binding(progress, kLocated, mapped, "binding vertices");
    const Binding found = bind(body, options.method, anchors);
    tell_share(0.5);
    return map_state(found, body);
  }();
  const ShareScope checking(progress, mapped, 1, "checking");
  complete(body, options, result);
  tell_share(1);
  return result;
}

}  // namespace flexel::mapping
