// Picks the writer and checks what all writers need.
#include "formats/exchange/surface_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <stdexcept>

#include "base/error.h"
#include "base/files/output_file.h"
#include "base/nearest_word.h"
#include "formats/common/file_formats.h"

namespace flexel {
namespace {

void check_finite(const DeformedSurface& deformed, const std::string& path) {
  for (std::size_t v = 0; v < deformed.displacement.size(); ++v)
    if (!deformed.at(v).allFinite())
      throw InputError(path,
                       fmt::format("cannot write the part: vertex {} is not finite once deformed", v + 1));
}

// Whether the file that the surface came from can be written again: it is one of this format, its bytes are
// there, and it is not a binary one that shall become text.
bool is_source_format(const Surface& surface, SurfaceFormat format) {
  if (format.file->rewrite == nullptr || surface.sources.size() != 1) return false;
  const SurfaceSource& source = surface.sources[0];
  return is_format(source, *format.file) && !source.bytes.empty() &&
         !(format.ascii && source.format.ends_with("-binary"));
}

}  // namespace

SurfaceFormat surface_format(const std::string& format, const std::string& path, bool ascii, bool cad) {
  const std::vector<std::string> known = written_formats(cad);
  const std::string asked = format.empty() ? extension(path) : format;
  const FileFormat* named = format_named(asked);
  // CAD formats by any of their extensions; ".gltf" is text, which is not written
  const bool known_name = std::find(known.begin(), known.end(), asked) != known.end();
  if (named != nullptr && (known_name || (cad && named->is_cad))) {
    const FileFormat& file = *named;
    if (ascii && file.encoding != FileEncoding::both)
      throw InputError(fmt::format(
          "--ascii is for {} only: {} is {}",
          written_titles([](const FileFormat& each) { return each.encoding == FileEncoding::both; }, "and"),
          capitals(file), file.encoding == FileEncoding::binary ? "binary" : "text as it is"));
    return {&file, ascii};
  }
  if (!format.empty())
    throw InputError(fmt::format("unknown output format \"{}\": {}{}", format, fmt::join(known, ", "),
                                 did_you_mean(format, known)));
  if (path == "-" || path.empty())
    throw InputError(fmt::format("a pipe needs --format ({})", fmt::join(known, ", ")));
  if (asked.empty()) throw InputError(path, "the name has no extension that tells the format: give --format");
  throw InputError(path, fmt::format("parts cannot be written as \"{}\": use .{}{}", asked,
                                     fmt::join(known, ", ."), did_you_mean(asked, known)));
}

void write_surface(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                   double unit, const std::string& path) {
  if (displacement.size() != surface.vertices.size())
    throw std::invalid_argument("write_surface: a displacement per vertex is needed");
  if (names_parts(path)) return write_parts(surface, displacement, format, unit, path);
  const DeformedSurface deformed{surface, displacement, unit};
  check_finite(deformed, path);
  OutputFile out(path, format.file->encoding != FileEncoding::text && !format.ascii);
  if (is_source_format(surface, format))
    format.file->rewrite(deformed, out);
  else
    format.file->write_new(deformed, format.ascii, out);
  out.commit();
}

double default_unit(const Surface& surface) {
  constexpr double kMillimetre = 1e-3;
  if (surface.sources.empty()) return kMillimetre;
  for (const SurfaceSource& source : surface.sources)
    if (source.unit != surface.sources[0].unit) return kMillimetre;
  return surface.sources[0].unit;
}

}  // namespace flexel
