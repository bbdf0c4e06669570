// STL, binary and ASCII, read by hand: see docs/reference/surfaces.md for why not by a library. Binary: 80 bytes of
// header, a count, 50 bytes a triangle (normal, three corners, all single precision; two bytes unused).
// ASCII: words, in any case, in double precision. Normals are not read: the corners' order says the same.
// Corners of a solid at exactly equal positions become one vertex, in order of first use.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/math/parallel_sort.h"
#include "base/math/weld.h"
#include "base/parallel.h"
#include "formats/common/readers.h"

namespace flexel {
namespace {

static_assert(std::endian::native == std::endian::little,
              "STL is little-endian; reading it here copies bytes");

constexpr std::size_t kHeaderSize = 80, kPreambleSize = 84, kRecordSize = 50;

// Adds the corners of one solid, triangle by triangle; position(corner) is its place in file units and
// key(corner) its bits.
template <class Position, class Key>
void add_solid(Surface& surface, std::size_t triangles, double unit, const Position& position,
               const Key& key) {
  const std::size_t corners = 3 * triangles, base = surface.vertices.size(),
                    first_corner = surface.polygon_vertices.size();
  const std::vector<std::uint32_t> first = first_equal(corners, key);
  std::vector<std::uint32_t> number(corners);  // of the vertex, valid at first corners
  std::uint32_t count = 0;
  for (std::size_t c = 0; c < corners; ++c)
    if (first[c] == c) number[c] = count++;
  surface.vertices.resize(base + count);
  surface.polygon_vertices.resize(first_corner + corners);
  parallel_for_each(
      corners,
      [&](std::size_t c) {
        const std::uint32_t vertex = number[first[c]];
        surface.polygon_vertices[first_corner + c] = static_cast<std::uint32_t>(base + vertex);
        if (first[c] == c) surface.vertices[base + vertex] = position(c) * unit;
      },
      1 << 15);
}

// Offsets, parts' polygons and faces, once all solids are in: those of a part of several patches are its
// patches.
struct Patches {
  std::vector<std::size_t> triangles;  // (patches)
  std::vector<std::uint32_t> part;     // (patches)
  std::vector<std::string> name;       // (patches)
};

void finish(Surface& surface, const Patches& patches) {
  const std::size_t triangles = surface.polygon_vertices.size() / 3;
  surface.polygon_offsets.resize(triangles + 1);
  for (std::size_t t = 0; t <= triangles; ++t) surface.polygon_offsets[t] = static_cast<std::uint32_t>(3 * t);
  std::vector<std::uint32_t> polygon_part, polygon_patch;
  polygon_part.reserve(triangles);
  polygon_patch.reserve(triangles);
  for (std::uint32_t p = 0; p < patches.triangles.size(); ++p) {
    polygon_part.insert(polygon_part.end(), patches.triangles[p], patches.part[p]);
    polygon_patch.insert(polygon_patch.end(), patches.triangles[p], p);
  }
  std::vector<std::uint32_t> welded(surface.vertices.size());
  std::iota(welded.begin(), welded.end(), 0u);
  if (surface.parts.size() == patches.triangles.size())
    assign_dihedral_faces(surface, polygon_part, welded);
  else
    assign_group_faces(surface, polygon_part, polygon_patch, patches.name, welded);
}

// --- binary

// Triangles in the file: the count of its header, or, where that is 0 though data follows, as many as are
// there.
std::size_t binary_count(const ImportInput& input) {
  const std::size_t size = input.bytes.size();
  if (size < kPreambleSize)
    throw InputError(input.where,
                     fmt::format("is no STL file, or cut off: {} bytes are less than a header", size));
  std::uint32_t announced = 0;
  std::memcpy(&announced, input.bytes.data() + kHeaderSize, sizeof announced);
  const std::size_t present = (size - kPreambleSize) / kRecordSize;
  if (announced == 0) return present;
  if (announced > present)
    throw InputError(
        input.where,
        fmt::format("is cut off, or no STL file: its header announces {} triangles, {} of them are missing",
                    announced, announced - present));
  return announced;
}

Surface read_binary(const ImportInput& input, const ImportOptions& options) {
  const std::size_t triangles = binary_count(input);
  if (triangles == 0) throw InputError(input.where, "holds no triangles");
  if (triangles > 0xffffffffu / 3) throw InputError(input.where, "holds too many triangles");
  const std::byte* records = input.bytes.data() + kPreambleSize;
  const auto floats = [&](std::size_t corner) {
    std::array<float, 3> xyz{};
    std::memcpy(xyz.data(), records + corner / 3 * kRecordSize + 12 + corner % 3 * 12, sizeof xyz);
    return xyz;
  };
  const auto not_finite = [&](std::size_t t) {
    for (std::size_t c = 3 * t; c < 3 * t + 3; ++c)
      for (const float value : floats(c))
        if (!std::isfinite(value)) return true;
    return false;
  };
  for (std::size_t t = 0; t < triangles; ++t)
    if (not_finite(t))
      throw InputError(input.where,
                       fmt::format("triangle {} has a coordinate that is not a finite number", t + 1));
  Surface surface;
  surface.sources.push_back(unitless_source("stl-binary", options));
  surface.sources[0].stl_header.assign(input.bytes.begin(), input.bytes.begin() + kHeaderSize);
  surface.parts.push_back({""});
  add_solid(
      surface, triangles, surface.sources[0].unit,
      [&](std::size_t c) {
        const auto xyz = floats(c);
        return Vec3(xyz[0], xyz[1], xyz[2]);
      },
      [&](std::size_t c) {
        const auto xyz = floats(c);
        return position_key(xyz[0], xyz[1], xyz[2]);
      });
  finish(surface, {{triangles}, {0}, {""}});
  return surface;
}

// --- ASCII

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

// The file as text, without the NULs or the end-of-file mark of CP/M that some writers pad it with.
std::string_view text_of(const ImportInput& input) {
  std::string_view text(reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size());
  while (!text.empty() && (text.back() == '\0' || text.back() == '\x1a')) text.remove_suffix(1);
  return text;
}

// Words of a text, with the line they are on.
class Words {
 public:
  Words(std::string_view text, std::string where) : text_(text), where_(std::move(where)) {}
  // The next word, "" at the end.
  std::string_view next() {
    while (at_ < text_.size() && blank(text_[at_])) line_ += text_[at_++] == '\n';
    const std::size_t begin = at_;
    while (at_ < text_.size() && !blank(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  std::string_view rest_of_line() {
    const std::size_t begin = at_;
    at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
    return text_.substr(begin, at_ - begin);
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}", where_, line_), what);
  }
  void expect(std::string_view keyword, std::size_t triangle) {
    const std::string_view word = next();
    if (same(word, keyword)) return;
    if (at_ == text_.size()) fail(fmt::format("the file is cut off inside triangle {}", triangle));
    fail(fmt::format("triangle {}: \"{}\" expected, \"{}\" found", triangle, keyword,
                     clean_name(word.substr(0, 40))));
  }
  [[nodiscard]] static bool same(std::string_view word, std::string_view keyword) {
    return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(),
                      [](char w, char k) { return lower(w) == k; });
  }

 private:
  std::string_view text_;
  std::string where_;
  std::size_t at_ = 0, line_ = 1;
};

double coordinate(Words& words, std::size_t triangle) {
  std::string_view word = words.next();
  if (word.empty()) words.fail(fmt::format("the file is cut off inside triangle {}", triangle));
  if (word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range && std::abs(value) < 1) return 0;
  if (end != word.data() + word.size() || error == std::errc::invalid_argument)
    words.fail(fmt::format("triangle {}: \"{}\" is not a number", triangle, clean_name(word.substr(0, 40))));
  if (error != std::errc{} || !std::isfinite(value))
    words.fail(fmt::format("triangle {} has a coordinate that is not a finite number", triangle));
  return value;
}

struct AsciiSolid {
  std::string name;
  std::vector<Vec3> corners;  // (triangles x 3) file units
};

// One facet, after its first word. The normal is skipped, whatever it holds.
void read_facet(Words& words, std::size_t triangle, AsciiSolid& solid) {
  words.expect("normal", triangle);
  for (int i = 0; i < 3; ++i) static_cast<void>(words.next());
  words.expect("outer", triangle);
  words.expect("loop", triangle);
  for (int corner = 0; corner < 3; ++corner) {
    words.expect("vertex", triangle);
    Vec3 position;
    for (double& value : position) value = coordinate(words, triangle);
    solid.corners.push_back(position);
  }
  words.expect("endloop", triangle);
  words.expect("endfacet", triangle);
}

// Some programs name a solid by the path that they wrote it to: the file's name alone, without ".stl". Other
// names with a slash stay whole.
std::string name_of_solid(std::string name) {
  const auto starts = [&](std::string_view text) { return name.starts_with(text); };
  const bool drive = name.size() > 2 && std::isalpha(static_cast<unsigned char>(name[0])) != 0 &&
                     name[1] == ':' && (name[2] == '\\' || name[2] == '/');
  if (drive || starts("/") || starts("~/") || starts("./") || starts("../") || starts("\\\\"))
    name = name.substr(name.find_last_of("/\\") + 1);
  const std::size_t dot = name.size() > 4 ? name.size() - 4 : std::string::npos;
  return dot != std::string::npos && Words::same(std::string_view(name).substr(dot), ".stl")
             ? name.substr(0, dot)
             : name;
}

// Everything up to the solid's end, after its first word; `triangles` counts over the file.
AsciiSolid read_solid(Words& words, std::size_t& triangles) {
  AsciiSolid solid;
  solid.name = name_of_solid(clean_name(words.rest_of_line()));
  while (true) {
    const std::string_view word = words.next();
    if (word.empty())
      words.fail(fmt::format("the file is cut off after triangle {}: no \"endsolid\"", triangles));
    if (Words::same(word, "endsolid")) break;
    if (!Words::same(word, "facet"))
      words.fail(
          fmt::format("\"facet\" or \"endsolid\" expected, \"{}\" found", clean_name(word.substr(0, 40))));
    read_facet(words, ++triangles, solid);
  }
  words.rest_of_line();
  return solid;
}

std::vector<AsciiSolid> read_solids(const ImportInput& input) {
  Words words(text_of(input), input.where);
  std::vector<AsciiSolid> solids;
  std::size_t triangles = 0;
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (!Words::same(word, "solid"))
      words.fail(fmt::format("\"solid\" expected, \"{}\" found", clean_name(word.substr(0, 40))));
    AsciiSolid solid = read_solid(words, triangles);
    if (!solid.corners.empty()) solids.push_back(std::move(solid));
  }
  if (solids.empty()) throw InputError(input.where, "holds no triangles");
  return solids;
}

PositionKey key_of(const Vec3& position) {
  return position_key(position.x(), position.y(), position.z());
}

// Solids that have an open edge in common are patches of one surface, as mesh generators write a body's
// boundary conditions: the first solid of the body that each belongs to (solids).
std::vector<std::uint32_t> bodies_of(const std::vector<AsciiSolid>& solids) {
  std::vector<std::uint32_t> body(solids.size());
  std::iota(body.begin(), body.end(), 0u);
  if (solids.size() < 2) return body;
  std::vector<Vec3> corners;
  for (const AsciiSolid& solid : solids)
    corners.insert(corners.end(), solid.corners.begin(), solid.corners.end());
  const std::vector<std::uint32_t> vertex =
      first_equal(corners.size(), [&](std::size_t c) { return key_of(corners[c]); });
  struct Edge {
    std::uint32_t low, high, solid;
    auto operator<=>(const Edge&) const = default;
  };
  std::vector<Edge> edges;
  std::size_t corner = 0;
  for (std::uint32_t s = 0; s < solids.size(); ++s)
    for (std::size_t c = 0; c < solids[s].corners.size(); ++c, ++corner) {
      const std::size_t next = c % 3 == 2 ? corner - 2 : corner + 1;
      const auto [low, high] = std::minmax(vertex[corner], vertex[next]);
      if (low != high) edges.push_back({low, high, s});
    }
  parallel_sort(edges.begin(), edges.end(), std::less<>());
  DisjointSets sets(solids.size());
  for (std::size_t n = 0, end; n < edges.size(); n = end) {
    std::uint32_t open = 0xffffffffu;  // the solid that is open at this edge
    for (end = n; end < edges.size() && edges[end].low == edges[n].low && edges[end].high == edges[n].high;) {
      const std::size_t first = end;
      while (end < edges.size() && edges[end] == edges[first]) ++end;
      if ((end - first) % 2 == 0) continue;
      if (open != 0xffffffffu) sets.unite(open, edges[first].solid);
      open = edges[first].solid;
    }
  }
  for (std::uint32_t s = 0; s < body.size(); ++s) body[s] = sets.root(s);
  return body;
}

Surface read_ascii(const ImportInput& input, const ImportOptions& options) {
  const std::vector<AsciiSolid> solids = read_solids(input);
  const std::vector<std::uint32_t> body = bodies_of(solids);
  Surface surface;
  surface.sources.push_back(unitless_source("stl-ascii", options));
  Patches patches;
  for (std::uint32_t first = 0; first < solids.size(); ++first) {
    if (body[first] != first) continue;
    std::vector<Vec3> corners;
    std::string name = solids[first].name;  // of all patches, else the file's
    for (std::uint32_t s = first; s < solids.size(); ++s) {
      if (body[s] != first) continue;
      corners.insert(corners.end(), solids[s].corners.begin(), solids[s].corners.end());
      patches.triangles.push_back(solids[s].corners.size() / 3);
      patches.part.push_back(static_cast<std::uint32_t>(surface.parts.size()));
      patches.name.push_back(solids[s].name);
      if (solids[s].name != name) name.clear();
    }
    add_solid(
        surface, corners.size() / 3, surface.sources[0].unit, [&](std::size_t c) { return corners[c]; },
        [&](std::size_t c) { return key_of(corners[c]); });
    surface.parts.push_back({name});
  }
  finish(surface, patches);
  return surface;
}

// ASCII when it begins with "solid", is text that far, and is not exactly as long as a binary file of its
// count would be: many binary files begin with "solid" too.
bool is_ascii(const ImportInput& input) {
  const std::size_t size = input.bytes.size();
  const std::string_view text = text_of(input).substr(0, 1024);
  std::size_t begin = 0;
  while (begin < text.size() && blank(text[begin])) ++begin;
  if (!Words::same(text.substr(begin, std::min<std::size_t>(5, text.size() - begin)), "solid")) return false;
  if (size >= kPreambleSize) {
    std::uint32_t count = 0;
    std::memcpy(&count, input.bytes.data() + kHeaderSize, sizeof count);
    if (size == kPreambleSize + kRecordSize * count) return false;
  }
  const auto binary = [](char c) { return c >= 0 && c < ' ' && !blank(c); };
  return std::none_of(text.begin(), text.end(), binary);
}

// A binary STL of n triangles is 84 + 50 n bytes long.
bool sized_like_binary(const ImportInput& input) {
  if (input.bytes.size() < kPreambleSize) return false;
  std::uint32_t count = 0;
  std::memcpy(&count, input.bytes.data() + kHeaderSize, sizeof count);
  return input.bytes.size() == kPreambleSize + kRecordSize * count;
}

Evidence sniff_stl(const ImportInput& input) {
  if (sized_like_binary(input)) return Evidence::size;
  return begins_with_word(beginning(input), "solid") ? Evidence::text : Evidence::none;
}

Surface read_stl(ImportInput& input, const ImportOptions& options) {
  return is_ascii(input) ? read_ascii(input, options) : read_binary(input, options);
}

}  // namespace

constinit const FileReader kStlReader{
    .format = &kStlFormat, .sniff = sniff_stl, .read = read_stl, .hashed_while_read = true};

}  // namespace flexel
