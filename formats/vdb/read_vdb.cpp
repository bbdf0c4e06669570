// Read by flexel-meshes.
#include "formats/common/mesh_job.h"
#include "formats/common/readers.h"

namespace flexel {
namespace {

constexpr std::string_view kVdbMark("\x20\x42\x44\x56\0\0\0\0", 8);  // openvdb::OPENVDB_MAGIC

}  // namespace

constinit const FileReader kVdbReader{
    .format = &kVdbFormat,
    .sniff =
        [](const ImportInput& input) {
          return beginning(input).starts_with(kVdbMark) ? Evidence::magic : Evidence::none;
        },
    .read = [](ImportInput& input,
               const ImportOptions& options) { return read_foreign(input, options, kVdbFormat, "OpenVDB"); }};

}  // namespace flexel
