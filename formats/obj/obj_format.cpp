// OBJ: polygons, groups, normals and texture coordinates as text; no unit.
#include "formats/common/file_format.h"

namespace flexel {

constinit const FileFormat kObjFormat{
    .name = "obj",
    .title = "OBJ",
    .write_new = [](const DeformedSurface& deformed, bool, OutputFile& out) { write_new_obj(deformed, out); },
    .rewrite = rewrite_obj,
    .refine = refine_obj,
    .add_note = [](Surface& surface, bool,
                   const std::string& note) { add_source_line(surface, kObjFormat.name, "# " + note, 0); }};

}  // namespace flexel
