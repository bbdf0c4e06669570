// Body files: .vtu, appended raw data. docs/reference/body-file.md describes every field.
#pragma once
#include <string>

#include "base/files/files.h"
#include "formats/lattice/body.h"

namespace flexel {

constexpr int kBodyFileVersion = 1;

struct BodyFileOptions {
  bool compress = false;      // zlib-compressed arrays (VTK's vtkZLibDataCompressor blocks)
  bool embed_surface = true;  // false for frames of a series after the first
};

// Writes `body` ("-": stdout). The round trip is bit-exact.
void write_body(const Body& body, const std::string& path, const BodyFileOptions& options = {});

// The bytes of such a file.
[[nodiscard]] Bytes body_bytes(const Body& body);

// Reads a body ("-": stdin). Throws InputError: not a body file, empty or truncated (for stdin: the program
// before it failed), an unknown version, a size that does not agree (naming the field).
[[nodiscard]] Body read_body(const std::string& path);
// Likewise from the bytes of a file; `where` is its name for messages.
[[nodiscard]] Body read_body(Bytes bytes, const std::string& where);

// True when the bytes begin like a body file.
[[nodiscard]] bool looks_like_body(std::span<const std::byte> bytes);

}  // namespace flexel
