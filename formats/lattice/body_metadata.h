// The data of a body other than arrays of numbers, as JSON text (field data "flexel_metadata" of a body
// file). Numbers are written with all digits; texts that are not UTF-8 are written as lists of bytes.
#pragma once
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "formats/lattice/body_file.h"

namespace flexel {

// Sizes of one source's packed bytes within the array "surface_source_bytes".
struct PackedSource {
  std::uint64_t size = 0;                  // bytes, unpacked
  std::vector<std::uint64_t> block_sizes;  // bytes of each zlib stream, packed
  std::uint64_t header_size = 0;           // bytes in "surface_source_headers"
};

// `sources` is empty when the surface is not embedded; it is `beside` then, or there is none.
[[nodiscard]] std::string metadata_to_json(const Body& body, bool with_surface,
                                           const std::vector<PackedSource>& sources,
                                           const std::optional<SurfaceBeside>& beside);

struct Metadata {
  Body body;  // parts, notes and the surface's parts and sources; no arrays
  bool with_surface = false;
  std::optional<SurfaceBeside> beside = {};                       // where it is instead
  std::vector<std::pair<std::uint32_t, std::string>> face_names;  // of the faces that have one
  std::vector<PackedSource> sources;
};

// Throws InputError that names the key.
[[nodiscard]] Metadata metadata_from_json(const std::string& text, const std::string& where);

// The materials of the parts, each once, in order of first use; cell data "material" is an index into it.
[[nodiscard]] std::vector<std::string> materials_of(const Body& body);

}  // namespace flexel
