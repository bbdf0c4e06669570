// STL: triangles, binary or text, a name a solid; no unit, no colours.
#include <fmt/format.h>

#include <cstring>

#include "formats/common/file_format.h"

namespace flexel {
namespace {

void write_stl(const DeformedSurface& deformed, bool ascii, OutputFile& out) {
  ascii ? write_stl_ascii(deformed, out) : write_stl_binary(deformed, out);
}

// In the header of a binary file, in the solids' names of an ASCII one.
void note_in_header(Surface& surface, bool ascii, const std::string& note) {
  constexpr std::size_t kHeader = 80;
  if (ascii)
    for (SurfacePart& part : surface.parts) part.name += fmt::format(" ({})", note);
  for (SurfaceSource& source : surface.sources) {
    source.stl_header.assign(kHeader, std::byte{0});
    std::memcpy(source.stl_header.data(), note.data(), std::min(note.size(), kHeader));
  }
}

}  // namespace

constinit const FileFormat kStlFormat{
    .name = "stl",
    .title = "STL",
    .encoding = FileEncoding::both,
    .write_new = write_stl,
    .add_note = note_in_header,
    .in_single_precision = [](const SurfaceSource& source) { return source.format == "stl-binary"; }};

}  // namespace flexel
