// Tells the format by the first bytes, then by the extension, has its reader make the surface, and finishes
// it: names, source, and our own checks, whatever the reader promised.
#include "formats/exchange/import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "formats/common/file_formats.h"
#include "formats/common/readers.h"
#include "formats/exchange/unread_formats.h"
#include "formats/lattice/body_file.h"
#include "formats/part/part_name.h"
#include "formats/part/subdivide.h"
#include "formats/vtu/vtu_head.h"

namespace flexel {
namespace {

// Our own first, then those of assimp.
const std::vector<const FileReader*>& all_readers() {
  static const std::vector<const FileReader*> kAll = [] {
    std::vector<const FileReader*> all = {&kStepReader, &kIgesReader, &kBrepReader, &kStlReader, &kObjReader,
                                          &kPlyReader,  &kOffReader,  &kGltfReader, &k3mfReader, &kVdbReader};
    for (const FileReader& reader : assimp_readers()) all.push_back(&reader);
    return all;
  }();
  return kAll;
}

ImportInput load(const std::string& path) {
  ImportInput input;
  input.bytes = read_all(path);
  const bool piped = path == "-";
  input.where = piped ? "stdin" : path;
  input.file = piped ? "stdin" : clean_name(std::filesystem::path(path).filename().string());
  input.folder = piped ? "" : std::filesystem::path(path).parent_path().string();
  input.stem = piped ? "part" : clean_name(stem(path));
  return input;
}

// The reader whose format the bytes speak for most, and how much; of equal ones the first.
std::pair<const FileReader*, Evidence> strongest(const ImportInput& input) {
  std::pair<const FileReader*, Evidence> best{nullptr, Evidence::none};
  for (const FileReader* reader : all_readers())
    if (const Evidence evidence = reader->sniff(input); evidence > best.second) best = {reader, evidence};
  return best;
}

// The encoding of text whose characters are two or four bytes wide, by which of their bytes are 0 and which
// are letters; "" for all else. Most of a part's text is ASCII.
std::string wide_encoding(const ImportInput& input) {
  constexpr std::size_t kLooked = 256;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(input.bytes[i]); };
  const bool short_mark =
      input.bytes.size() >= 4 && ((at(0) == 0xff && at(1) == 0xfe) || (at(0) == 0xfe && at(1) == 0xff));
  const bool long_mark =
      (short_mark && at(2) == 0 && at(3) == 0) ||
      (input.bytes.size() >= 4 && at(0) == 0 && at(1) == 0 && at(2) == 0xfe && at(3) == 0xff);
  const std::size_t begin = long_mark ? 4 : short_mark ? 2 : 0;
  const std::size_t quads = std::min(input.bytes.size() - begin, kLooked) / 4;
  std::array<std::size_t, 4> zeros{}, letters{};
  for (std::size_t i = 0; i < 4 * quads; ++i) {
    const unsigned char byte = at(begin + i);
    zeros[i % 4] += byte == 0;
    letters[i % 4] += (byte >= ' ' && byte < 0x7f) || (byte >= '\t' && byte <= '\r');
  }
  const auto is = [&](std::string_view kinds) {  // 0: a zero, c: a letter
    for (std::size_t i = 0; i < 4; ++i)
      if (10 * (kinds[i] == '0' ? zeros : letters)[i] < 9 * quads) return false;
    return quads > 0;
  };
  if (is("c0c0")) return "UTF-16LE";
  if (is("0c0c")) return "UTF-16BE";
  if (is("c000")) return "UTF-32LE";
  if (is("000c")) return "UTF-32BE";
  return "";
}

// A binary file of a format without a mark of its own, which its size tells.
bool told_by_size(const ImportInput& input) {
  return std::any_of(all_readers().begin(), all_readers().end(),
                     [&](const FileReader* reader) { return reader->sniff(input) == Evidence::size; });
}

// Takes off the mark of UTF-8 at the front, which says nothing, and refuses wider characters.
void check_encoding(ImportInput& input) {
  constexpr std::array kMark = {std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
  if (told_by_size(input)) return;
  if (const std::string encoding = wide_encoding(input); !encoding.empty())
    throw InputError(input.where,
                     fmt::format("is text in {}, which is not read: save it as UTF-8 (iconv -f {} "
                                 "-t UTF-8 {} > NEW)",
                                 encoding, encoding, input.file));
  if (input.bytes.size() >= kMark.size() && std::equal(kMark.begin(), kMark.end(), input.bytes.begin()))
    input.bytes.erase(input.bytes.begin(), input.bytes.begin() + kMark.size());
}

// No text holds a NUL, but some writers pad its end with them.
void check_text(const ImportInput& input, const FileReader& reader) {
  if (reader.is_text == nullptr || !reader.is_text(input)) return;
  const auto begin = input.bytes.begin();
  const auto nul = std::find(begin, input.bytes.end(), std::byte{0});
  if (std::all_of(nul, input.bytes.end(), [](std::byte byte) { return byte == std::byte{0}; })) return;
  throw InputError(
      fmt::format("{}:{}", input.where, 1 + std::count(begin, nul, static_cast<std::byte>('\n'))),
      "holds a byte that is 0, which no text has: the file is damaged, or in another format or encoding; "
      "export it anew, in UTF-8");
}

// By the name of its format or an extension; nullptr: none.
const FileReader* reader_named(const std::string& name) {
  const FileFormat* format = format_named(name);
  for (const FileReader* reader : all_readers())
    if (reader->format == format) return reader;
  return nullptr;
}

void refuse_unread(const ImportInput& input, const std::string& why) {
  if (!why.empty()) throw InputError(input.where, why);
}

const FileReader& sniff(const ImportInput& input, const std::string& path) {
  refuse_unread(input, unread_bytes(beginning(input)));
  const auto [found, evidence] = strongest(input);
  if (evidence > Evidence::weak) return *found;
  if (path != "-") refuse_unread(input, unread_extension(extension(path)));
  if (vtu::is_file_of(input.bytes, "PUnstructuredGrid"))
    throw InputError(
        input.where,
        "lists the pieces of a lattice: flexel-map maps it and flexel info says what it holds; what "
        "draws bodies draws a piece, if that is named (.vtu)");
  if (looks_like_body(input.bytes))
    throw InputError(
        input.where,
        "is a body (a lattice), not a part: give it to flexel-simulate or flexel-map, or give a part "
        "(STEP, STL, OBJ, ...) here");
  if (const FileReader* named = reader_named(path == "-" ? "" : extension(path))) return *named;
  if (found != nullptr) return *found;
  throw InputError(input.where,
                   path == "-"
                       ? fmt::format("its bytes do not tell its format: say it with --input-format ({})",
                                     fmt::join(read_formats(), ", "))
                       : fmt::format("is in no format that can be read: a part comes as {}", read_titles()));
}

const FileReader& reader_of(const ImportInput& input, const ImportOptions& options, const std::string& path) {
  if (!options.format) return sniff(input, path);
  if (const FileReader* named = reader_named(*options.format)) return *named;
  throw InputError(fmt::format("unknown input format \"{}\": {}{}", *options.format,
                               fmt::join(read_formats(), ", "),
                               did_you_mean(*options.format, read_formats())));
}

struct HashedSurface {
  Surface surface;
  std::uint64_t hash = 0;
};

HashedSurface read_and_hash(ImportInput& input, const FileReader& reader, const ImportOptions& options) {
  HashedSurface result;
  if (reader.hashed_while_read) {
    parallel_both([&] { result.surface = reader.read(input, options); },
                  [&] { result.hash = content_hash(input.bytes); });
    return result;
  }
  result.hash = content_hash(input.bytes);
  result.surface = reader.read(input, options);
  return result;
}

}  // namespace

Surface import_surface(const std::string& path, const ImportOptions& options) {
  ImportInput input = load(path);
  check_encoding(input);
  const FileReader& reader = reader_of(input, options, path);
  check_text(input, reader);
  constexpr double kLoaded = .1, kRead = .85;  // of the time, of large files of any format
  tell_share(kLoaded);
  HashedSurface read = [&] {
    const ShareScope reading(kLoaded, kRead);
    return read_and_hash(input, reader, options);
  }();
  tell_share(kRead);
  Surface& surface = read.surface;
  surface.sources.at(0).file = input.file;
  surface.sources.at(0).hash = read.hash;
  if (options.largest_edge && !reader.format->is_cad)  // CAD is split where it is tessellated
    subdivide_mesh(surface, *options.largest_edge, input.where);
  surface.part_source.assign(surface.parts.size(), 0);
  for (SurfacePart& part : surface.parts)
    if (says_nothing(part.name)) part.name.clear();
  make_part_names_unique(surface, input.stem.empty() ? "part" : input.stem);
  check(surface, input.where);
  const bool has_area = std::any_of(surface.vertices.begin(), surface.vertices.end(),
                                    [&](const Vec3& vertex) { return vertex != surface.vertices.front(); });
  if (!has_area) throw InputError(input.where, "all its vertices are at one point: nothing to work on");
  return std::move(read.surface);
}

std::vector<std::string> refinement_notes(const Surface& surface) {
  std::vector<std::string> lines;
  for (const SurfaceSource& source : surface.sources) {
    if (is_rewritten(source) && source.bytes.empty())
      lines.push_back(fmt::format(
          "{}: its triangles were split, so the part comes out as a new file: vertices keep their "
          "order and new ones follow; groups, names and colours stay, textures, materials, "
          "metadata and normals do not",
          source.file));
  }
  return lines;
}

}  // namespace flexel
