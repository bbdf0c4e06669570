// What the program must know of one file format of parts. Each format's folder has one row
// (<folder>/<format>_format.cpp) and file_formats.cpp lists the rows; nothing else names a
// format. How it is read is the second half of the row (formats/common/readers.h), which lies in another library.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/files/files.h"
#include "formats/common/refine_files.h"
#include "formats/common/surface_writers.h"

namespace flexel {

enum class FileEncoding { text, binary, both };  // both: binary unless --ascii is given

struct FileFormat {
  std::string_view name;   // "stl": the word of --format and --input-format, and an extension
  std::string_view title;  // as it is called where files are read: "STL"
  std::span<const std::string_view> extensions{};  // others that mean it too: "stp"
  FileEncoding encoding = FileEncoding::text;
  bool carries_unit = false;      // the file says the unit of its coordinates; else --unit does
  bool is_cad = false;            // exact surfaces: tessellated where it is read, written by flexel-cad
  bool holds_attributes = false;  // numbers of any name at vertices
  bool by_assimp = false;         // read through assimp (formats/assimp)

  // The four that follow: none where the format is only read.
  // A new file of the surface.
  void (*write_new)(const DeformedSurface& deformed, bool ascii, OutputFile& out) = nullptr;
  // The file that the surface came from (its source's `bytes`), with other positions and normals; none where
  // `write_new` says all.
  void (*rewrite)(const DeformedSurface& deformed, OutputFile& out) = nullptr;
  // Splits the polygons in the source's bytes; returns what they hold that cannot be split (formats/common/refine_files.h).
  std::string (*refine)(SurfaceSource& source, const Refinement& refinement) = nullptr;
  // Puts a note for people where the file written from this surface shows it; none where there is no place.
  void (*add_note)(Surface& surface, bool ascii, const std::string& note) = nullptr;

  // Whether a source's coordinates are in single precision; none: never.
  bool (*in_single_precision)(const SurfaceSource& source) = nullptr;
};

// Whether `source` is a file of `format`: SurfaceSource::format is its name, and the encoding where it has both
// ("stl-binary").
[[nodiscard]] inline bool is_format(const SurfaceSource& source, const FileFormat& format) {
  const std::string_view name = std::string_view(source.format).substr(0, source.format.find('-'));
  return name == format.name;
}

// The rows; each is defined in its format's folder.
extern const FileFormat kStepFormat, kIgesFormat, kBrepFormat, kStlFormat, kObjFormat, kPlyFormat, kOffFormat,
    kGltfFormat, k3mfFormat, kVdbFormat;
// Those that are read through assimp (formats/assimp).
inline constexpr std::size_t kAssimpFormats = 28;
[[nodiscard]] std::span<const FileFormat, kAssimpFormats> assimp_formats();

}  // namespace flexel
