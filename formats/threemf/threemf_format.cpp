// 3MF: read only.
#include "formats/common/file_format.h"

namespace flexel {

constinit const FileFormat k3mfFormat{
    .name = "3mf", .title = "3MF", .encoding = FileEncoding::binary, .carries_unit = true};

}  // namespace flexel
