// Body files: .vtu, appended raw data. docs/reference/body-file.md describes every field.
#pragma once
#include <optional>
#include <string>

#include "base/files/files.h"
#include "formats/lattice/body.h"

namespace flexel {

constexpr int kBodyFileVersion = 1;

// Where the surface of a frame lies: in another frame of its series.
struct SurfaceBeside {
  std::string file;        // its name, in the same folder
  std::uint64_t hash = 0;  // of the surface there: surface_hash()
};

struct BodyFileOptions {
  bool compress = false;  // zlib-compressed arrays (VTK's vtkZLibDataCompressor blocks)
  std::optional<SurfaceBeside> surface_beside = {};  // in place of the surface and the moments
};

// Writes `body` ("-": stdout). The round trip is bit-exact.
void write_body(const Body& body, const std::string& path, const BodyFileOptions& options = {});

// The bytes of such a file.
[[nodiscard]] Bytes body_bytes(const Body& body);

// Reads a body ("-": stdin). Throws InputError: not a body file, empty or truncated (for stdin: the program
// before it failed), an unknown version, a size that does not agree (naming the field). A frame takes its surface and
// its moments from where they lie, but from stdin; InputError: they are not there, or another's.
[[nodiscard]] Body read_body(const std::string& path);
// Likewise from the bytes of a file; `where` is its name for messages. Without what lies in another file.
[[nodiscard]] Body read_body(Bytes bytes, const std::string& where);
// A frame without what lies in another file, for who goes through a series and has it.
[[nodiscard]] Body read_frame(const std::string& path);

// Gives `frame` the surface of `from`, which loses it and whose parts it must have: InputError(where, ...).
// Which cells lie under polygons, and the moments, go along where the cells are the same; else they are empty.
void take_surface(Body& frame, Body& from, const std::string& where);

// Tells surfaces apart by their vertices and polygons.
[[nodiscard]] std::uint64_t surface_hash(const Surface& surface);

// True when the bytes begin like a body file.
[[nodiscard]] bool looks_like_body(std::span<const std::byte> bytes);

}  // namespace flexel
