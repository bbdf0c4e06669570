// The passes in order: bind at rest, map the state, lay out what is known of each vertex.
#include "mapping/map.h"

#include "formats/parallel.h"
#include "formats/program.h"
#include "mapping/bind.h"

namespace flexel {

MapMethod map_method(const std::string& name) {
  if (name == "affine") return MapMethod::affine;
  if (name == "gram-schmidt") return MapMethod::gram_schmidt;
  throw InputError("unknown method \"" + name + "\": --method is gram-schmidt or affine" +
                   did_you_mean(name, {"gram-schmidt", "affine"}));
}

MapResult map_surface(const Body& body, const MapOptions& options, Progress& progress) {
  progress.update(0, "binding vertices");
  const Binding binding = bind(body, options.method);
  throw_if_interrupted();
  progress.update(0.7, "mapping");
  Mapped mapped = apply(binding, body, body.position);
  throw_if_interrupted();

  const std::size_t n = binding.frame.size();
  MapResult result;
  result.displacement = std::move(mapped.displacement);
  result.flags = std::move(mapped.flags);
  result.kind.resize(n);
  result.quadruple.resize(n);
  result.rings.resize(n);
  parallel_for_each(n, [&](std::size_t v) {
    const Frame& frame = binding.frames[binding.frame[v]];
    result.kind[v] = frame.kind;
    result.quadruple[v] = frame.elements;
    result.rings[v] = frame.rings;
  });
  result.referenced = binding.referenced;
  result.distinct_frames = binding.frames.size();
  result.rest_residual = binding.rest_residual;
  result.distance_outside = binding.distance_outside;
  progress.update(1);
  return result;
}

}  // namespace flexel
