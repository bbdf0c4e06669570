// VTK's collection file (.pvd) and its frames.
#include "simulate/time/series.h"

#include <fmt/format.h>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "formats/lattice/body_file.h"

namespace flexel::simulate {

Series::Series(std::string path, bool compress) : path_(std::move(path)), compress_(compress) {
  if (extension(path_) != "pvd") throw InputError(path_, "a series of frames is a .pvd file");
  base_ = path_.substr(0, path_.size() - 4);
  name_ = stem(path_);
}

void Series::enter(double time) {
  std::string file;
  for (const char c : name_)
    file += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
  entries_ += fmt::format("    <DataSet timestep=\"{:.17g}\" part=\"0\" file=\"{}_{:05}.vtu\"/>\n", time,
                          file, place_.times.size());
  place_.times.push_back(time);
}

void Series::resume(const SeriesPlace& place) {
  for (const double time : place.times) enter(time);
  place_ = place;
}

void Series::add(const Body& body, double time) {
  BodyFileOptions options;
  options.compress = compress_;
  const std::size_t frame = place_.times.size();
  if (frame == 0 || body.parts.size() != place_.surface_parts) {  // parts may join
    place_.surface_frame = frame;
    place_.surface_parts = body.parts.size();
    surface_hash_.reset();
  } else if (body.surface.polygon_count() > 0) {
    if (!surface_hash_) surface_hash_ = surface_hash(body.surface);
    options.surface_beside = {fmt::format("{}_{:05}.vtu", name_, place_.surface_frame), *surface_hash_};
  }
  write_body(body, fmt::format("{}_{:05}.vtu", base_, frame), options);
  enter(time);
  OutputFile out(path_, false);
  out.write(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
      "  <Collection>\n" +
      entries_ + "  </Collection>\n</VTKFile>\n");
  out.commit();
}

}  // namespace flexel::simulate
