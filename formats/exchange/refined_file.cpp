// Only a file that comes out again is split; for all other formats the surface says all.
#include "formats/exchange/refined_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "formats/common/file_formats.h"

namespace flexel {

Surface refined_with_file(const Surface& surface, const Refinement& refinement,
                          std::span<const SurfaceFormat> formats) {
  Surface result = refined(surface, refinement);
  if (surface.sources.size() != 1 || surface.sources[0].bytes.empty()) return result;
  const FileFormat* own = format_of(surface.sources[0]);
  const bool comes_out = std::any_of(formats.begin(), formats.end(),
                                     [&](const SurfaceFormat& each) { return each.file == own; });
  if (own == nullptr || own->refine == nullptr || !comes_out) return result;
  SurfaceSource& source = result.sources[0];
  source.bytes = surface.sources[0].bytes;
  source.order = surface.sources[0].order;
  std::string why;
  try {
    const std::string held = own->refine(source, refinement);
    if (held.empty()) return result;
    why = fmt::format("holds {}, which cannot be split with its triangles", held);
  } catch (const InputError& error) {
    why = error.what();
  }
  throw InputError(source.file,
                   why +
                       ": --keep-vertices leaves them as they are; read with --edge LENGTH the part "
                       "comes out as a new file without it");
}

}  // namespace flexel
