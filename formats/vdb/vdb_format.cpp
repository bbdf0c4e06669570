// OpenVDB's grids: level sets are read as parts. flexel-voxelize --vdb writes what a lattice holds; no part is written.
#include "formats/common/file_format.h"

namespace flexel {

constinit const FileFormat kVdbFormat{.name = "vdb",
                                      .title = "VDB",
                                      .encoding = FileEncoding::binary,
                                      .in_single_precision = [](const SurfaceSource&) { return true; }};

}  // namespace flexel
