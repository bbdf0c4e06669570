// How the formats of assimp are told, and read: by flexel-meshes.
#include <utility>

#include "formats/assimp/assimp_formats.h"
#include "formats/common/mesh_job.h"
#include "formats/common/readers.h"
#include "formats/threemf/zip.h"

namespace flexel {
namespace {

bool has_mark(std::string_view text, std::size_t format) {
  if (assimp_formats()[format].name == "amf" && is_amf_name(first_zip_entry(text))) return true;
  const FormatMark mark = assimp_mark(format);
  if (mark.bytes.empty()) return false;
  if (!mark.in_xml) return text.starts_with(mark.bytes);
  return begins_with_word(text, "<") && text.find(mark.bytes) != std::string_view::npos;
}

template <std::size_t kFormat>
Evidence sniff_assimp(const ImportInput& input) {
  return has_mark(beginning(input), kFormat) ? Evidence::magic : Evidence::none;
}

template <std::size_t kFormat>
Surface read_assimp(ImportInput& input, const ImportOptions& options) {
  return read_foreign(input, options, assimp_formats()[kFormat], "assimp");
}

template <std::size_t... kFormat>
std::array<FileReader, sizeof...(kFormat)> readers_of(std::index_sequence<kFormat...>) {
  return {FileReader{
      .format = &assimp_formats()[kFormat], .sniff = sniff_assimp<kFormat>, .read = read_assimp<kFormat>}...};
}

}  // namespace

std::span<const FileReader> assimp_readers() {
  static const auto kReaders = readers_of(std::make_index_sequence<kAssimpFormats>());
  return kReaders;
}

}  // namespace flexel
