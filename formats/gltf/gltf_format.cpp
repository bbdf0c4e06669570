// glTF 2.0: read as .gltf and .glb, written as GLB, in metres.
#include <array>

#include "formats/common/file_format.h"

namespace flexel {
namespace {

constexpr std::array<std::string_view, 1> kGltfExtensions = {"gltf"};

}  // namespace

constinit const FileFormat kGltfFormat{
    .name = "glb",
    .title = "glTF",
    .extensions = kGltfExtensions,
    .encoding = FileEncoding::binary,
    .carries_unit = true,
    .write_new = [](const DeformedSurface& deformed, bool, OutputFile& out) { write_new_glb(deformed, out); },
    .rewrite = rewrite_glb,
    .refine = refine_glb};

}  // namespace flexel
