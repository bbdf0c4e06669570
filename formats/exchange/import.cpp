// Tells the format by the first bytes, then by the extension, has its reader make the surface, and finishes
// it: names, source, and our own checks, whatever the reader promised.
#include "formats/exchange/import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "base/error.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "formats/common/readers.h"
#include "formats/lattice/body_file.h"
#include "formats/off/off_text.h"
#include "formats/part/part_name.h"
#include "formats/part/subdivide.h"

namespace flexel {
namespace {

const std::vector<std::string>& known_formats() {
  static const std::vector<std::string> names{"step", "iges", "brep", "stl", "obj",
                                              "ply",  "off",  "glb",  "3mf"};
  return names;
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

std::string_view beginning(const ImportInput& input, std::size_t size) {
  return {reinterpret_cast<const char*>(input.bytes.data()), std::min(size, input.bytes.size())};
}

// A binary STL of n triangles is 84 + 50 n bytes long.
bool sized_like_binary_stl(const ImportInput& input) {
  if (input.bytes.size() < 84) return false;
  std::uint32_t count = 0;
  std::copy_n(input.bytes.data() + 80, 4, reinterpret_cast<std::byte*>(&count));
  return input.bytes.size() == 84 + std::size_t{50} * count;
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

// Takes off the mark of UTF-8 at the front, which says nothing, and refuses wider characters.
void check_encoding(ImportInput& input) {
  constexpr std::array kMark = {std::byte{0xef}, std::byte{0xbb}, std::byte{0xbf}};
  if (sized_like_binary_stl(input)) return;
  if (const std::string encoding = wide_encoding(input); !encoding.empty())
    throw InputError(input.where,
                     fmt::format("is text in {}, which is not read: save it as UTF-8 (iconv -f {} "
                                 "-t UTF-8 {} > NEW)",
                                 encoding, encoding, input.file));
  if (input.bytes.size() >= kMark.size() && std::equal(kMark.begin(), kMark.end(), input.bytes.begin()))
    input.bytes.erase(input.bytes.begin(), input.bytes.begin() + kMark.size());
}

// No text holds a NUL, but some writers pad its end with them.
void check_text(const ImportInput& input, const std::string& format) {
  const bool text =
      format == "obj" || format == "off" || format == "step" || format == "iges" ||
      (format == "ply" && beginning(input, 4096).find("format ascii") != std::string_view::npos);
  if (!text) return;
  const auto begin = input.bytes.begin();
  const auto nul = std::find(begin, input.bytes.end(), std::byte{0});
  if (std::all_of(nul, input.bytes.end(), [](std::byte byte) { return byte == std::byte{0}; })) return;
  throw InputError(
      fmt::format("{}:{}", input.where, 1 + std::count(begin, nul, static_cast<std::byte>('\n'))),
      "holds a byte that is 0, which no text has: the file is damaged, or in another format or encoding; "
      "export it anew, in UTF-8");
}

bool begins_with_word(std::string_view text, std::string_view word) {
  std::size_t at = 0;
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
  return text.size() - at >= word.size() &&
         std::equal(word.begin(), word.end(), text.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char w, char t) { return w == std::tolower(static_cast<unsigned char>(t)); });
}

// The first line that is neither empty nor a comment begins with a word of OBJ.
bool looks_like_obj(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.front())) != 0)
      line.remove_prefix(1);
    if (line.empty() || line.front() == '#') continue;
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
    constexpr std::array<std::string_view, 10> kWords{"v", "vn", "vt", "vp",     "f",
                                                      "g", "o",  "s",  "mtllib", "usemtl"};
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  }
  return false;
}

bool looks_like_brep(std::string_view text) {
  constexpr std::string_view kBinary = "Open CASCADE Topology V";
  return begins_with_word(text, "dbrep_drawableshape") || begins_with_word(text, "cascade topology v") ||
         text.substr(0, kBinary.size() + 1).find(kBinary) != std::string_view::npos;
}

// The first line is 80 characters long: text, an S in column 73, and the number 1.
bool looks_like_iges(std::string_view text) {
  constexpr std::size_t kLetter = 72, kLine = 80;
  if (text.size() < kLine || text[kLetter] != 'S') return false;
  const std::string_view number = text.substr(kLetter + 1, kLine - kLetter - 1);
  return number.find_first_not_of(" 0") == number.size() - 1 && number.back() == '1' &&
         text.substr(0, kLine).find('\n') == std::string_view::npos;
}

// JSON that speaks of an asset somewhere near its beginning.
bool looks_like_gltf(std::string_view text) {
  return begins_with_word(text, "{") && text.find("\"asset\"") != std::string_view::npos;
}

// The format that an extension or --input-format stands for, "" for none.
std::string format_named(const std::string& name) {
  if (name == "stp" || name == "p21") return "step";
  if (name == "igs") return "iges";
  if (name == "brp") return "brep";
  if (name == "gltf") return "glb";
  const auto& known = known_formats();
  return std::find(known.begin(), known.end(), name) == known.end() ? "" : name;
}

Surface read(const std::string& format, ImportInput& input, const ImportOptions& options) {
  if (format == "step") return read_step(input, options);
  if (format == "iges") return read_iges(input, options);
  if (format == "brep") return read_brep(input, options);
  if (format == "stl") return read_stl(input, options);
  if (format == "obj") return read_obj(input, options);
  if (format == "ply") return read_ply(input, options);
  if (format == "off") return read_off(input, options);
  if (format == "glb") return read_gltf(input, options);
  return read_3mf(input, options);
}

// Tessellated on import, and split there (formats/cad/occt_mesh.cpp).
bool is_cad(const std::string& format) {
  return format == "step" || format == "iges" || format == "brep";
}

std::string sniff(const ImportInput& input, const std::string& path) {
  const std::string_view text = beginning(input, 4096);
  if (begins_with_word(text, "iso-10303-21")) return "step";
  if (text.starts_with("glTF")) return "glb";
  if (text.starts_with("PK\x03\x04")) return "3mf";
  if (text.starts_with("ply\n") || text.starts_with("ply\r")) return "ply";
  if (sized_like_binary_stl(input)) return "stl";
  if (looks_like_body(input.bytes))
    throw InputError(
        input.where,
        "is a body (a lattice), not a part: give it to flexel-simulate or flexel-map, or give a part "
        "(STEP, STL, OBJ, ...) here");
  if (begins_with_word(text, "solid")) return "stl";
  if (looks_like_off(text)) return "off";
  if (looks_like_brep(text)) return "brep";
  if (looks_like_iges(text)) return "iges";
  const std::string suffix = format_named(path == "-" ? "" : extension(path));
  if (!suffix.empty()) return suffix;
  if (looks_like_obj(text)) return "obj";
  if (looks_like_gltf(text)) return "glb";
  throw InputError(input.where,
                   path == "-"
                       ? fmt::format("its bytes do not tell its format: say it with --input-format ({})",
                                     fmt::join(known_formats(), ", "))
                       : "is in no format that can be read: a part comes as STEP, IGES, BREP, STL, OBJ, PLY, "
                         "OFF, glTF or 3MF");
}

std::string format_of(const ImportInput& input, const ImportOptions& options, const std::string& path) {
  if (!options.format) return sniff(input, path);
  const std::string format = format_named(*options.format);
  if (format.empty())
    throw InputError(fmt::format("unknown input format \"{}\": {}{}", *options.format,
                                 fmt::join(known_formats(), ", "),
                                 did_you_mean(*options.format, known_formats())));
  return format;
}

struct HashedSurface {
  Surface surface;
  std::uint64_t hash = 0;
};

// STL is hashed while it is read, for neither makes full use of the threads; the other readers are larger
// than the hash, and one takes the bytes for itself.
HashedSurface read_and_hash(ImportInput& input, const std::string& format, const ImportOptions& options) {
  HashedSurface result;
  if (format == "stl") {
    parallel_both([&] { result.surface = read_stl(input, options); },
                  [&] { result.hash = content_hash(input.bytes); });
    return result;
  }
  result.hash = content_hash(input.bytes);
  result.surface = read(format, input, options);
  return result;
}

}  // namespace

Surface import_surface(const std::string& path, const ImportOptions& options) {
  ImportInput input = load(path);
  check_encoding(input);
  const std::string format = format_of(input, options, path);
  check_text(input, format);
  HashedSurface read = read_and_hash(input, format, options);
  Surface& surface = read.surface;
  surface.sources.at(0).file = input.file;
  surface.sources.at(0).hash = read.hash;
  if (options.largest_edge && !is_cad(format)) subdivide_mesh(surface, *options.largest_edge, input.where);
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
    const bool rewritten = source.format == "obj" || source.format == "off" || source.format == "glb" ||
                           source.format.starts_with("ply");
    if (rewritten && source.bytes.empty())
      lines.push_back(fmt::format(
          "{}: its triangles were split, so the part comes out as a new file: vertices keep their "
          "order and new ones follow; groups, names and colours stay, textures, materials and "
          "normals do not",
          source.file));
  }
  return lines;
}

}  // namespace flexel
