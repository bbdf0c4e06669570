// OFF: polygons, colours and normals as text; no unit.
#include "formats/common/file_format.h"

namespace flexel {

constinit const FileFormat kOffFormat{
    .name = "off",
    .title = "OFF",
    .write_new = [](const DeformedSurface& deformed, bool, OutputFile& out) { write_new_off(deformed, out); },
    .rewrite = rewrite_off,
    .refine = refine_off,
    .add_note = [](Surface& surface, bool,
                   const std::string& note) { add_source_line(surface, kOffFormat.name, "# " + note, 1); }};

}  // namespace flexel
