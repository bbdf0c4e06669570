// 3MF: its own unit, double precision in text.
#include "formats/common/file_format.h"

namespace flexel {

constinit const FileFormat k3mfFormat{
    .name = "3mf",
    .title = "3MF",
    .encoding = FileEncoding::binary,
    .carries_unit = true,
    .write_new = [](const DeformedSurface& deformed, bool, OutputFile& out) { write_new_3mf(deformed, out); },
    .rewrite = rewrite_3mf,
    .refine = refine_3mf};

}  // namespace flexel
