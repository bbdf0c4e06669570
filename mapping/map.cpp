// The passes in order: bind at rest, map the state, lay out what is known of each vertex.
#include "mapping/map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "formats/program.h"
#include "mapping/bind.h"

namespace flexel {

namespace {

const std::vector<std::string> kMethods = {"gram-schmidt", "affine", "blended", "smooth"};  // by MapMethod

}  // namespace

MapMethod map_method(const std::string& name) {
  const auto found = std::find(kMethods.begin(), kMethods.end(), name);
  if (found != kMethods.end()) return static_cast<MapMethod>(found - kMethods.begin());
  throw InputError(fmt::format("unknown method \"{}\": --method is {}{}", name, fmt::join(kMethods, ", "),
                               did_you_mean(name, kMethods)));
}

std::string name_of(MapMethod method) {
  return kMethods[static_cast<std::size_t>(method)];
}

MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress) {
  return map_surface(body, options, take_seats(body), progress);
}

MapResult map_surface(const Body& body, const MapOptions& options, const Seats& seats, Progress& progress) {
  progress.update(0, "binding vertices");
  Binding binding = bind(body, options.method, seats);
  throw_if_interrupted();
  progress.update(0.5, "mapping");
  MapResult result;
  result.displacement = apply(binding, body, body.position);
  throw_if_interrupted();
  progress.update(0.9, "judging");
  result.flags = judge(binding, body, body.position, result.displacement);
  result.frames = std::move(binding.frames);
  result.frame = std::move(binding.frame);
  result.referenced = std::move(binding.referenced);
  result.rest_residual = binding.rest_residual;
  result.distance_outside = binding.distance_outside;
  progress.update(1);
  return result;
}

}  // namespace flexel
