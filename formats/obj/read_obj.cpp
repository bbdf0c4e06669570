// OBJ, read by hand because the same lines must come out again: every vertex in the file's order, used or
// not, in double precision, polygons as they are (docs/reference/surfaces.md says what a library does instead). One
// file is one part; its faces are its groups, or dihedral regions where all its polygons are in one group.
#include <fmt/format.h>

#include <map>
#include <utility>

#include "base/error.h"
#include "formats/common/readers.h"
#include "formats/obj/obj_text.h"
#include "formats/part/topology.h"

namespace flexel {
namespace {

// What is collected line by line.
struct ObjScan {
  Surface surface;
  ObjCounts counts;
  std::string object, group;                                             // in force
  std::map<std::pair<std::string, std::string>, std::uint32_t> face_of;  // by object and group
  std::vector<ObjCorner> corners;                                        // scratch
};

// Words of a g or o line joined by blanks.
std::string group_name(std::string_view text) {
  std::string name;
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    if (!name.empty()) name += ' ';
    name += word;
  }
  return clean_name(name);
}

void add_face(ObjScan& scan, const ObjLine& line, const ImportInput& input) {
  parse_face(line, scan.counts, input.where, scan.corners);
  for (const ObjCorner& corner : scan.corners) {
    if (corner.vertex >= 0xffffffff)
      throw InputError(fmt::format("{}:{}", input.where, line.number), "index out of range");
    scan.surface.polygon_vertices.push_back(static_cast<std::uint32_t>(corner.vertex));
  }
  if (scan.surface.polygon_vertices.size() > 0xffffffffu)
    throw InputError(input.where, "holds too many polygons");
  scan.surface.polygon_offsets.push_back(static_cast<std::uint32_t>(scan.surface.polygon_vertices.size()));
  const auto next = static_cast<std::uint32_t>(scan.face_of.size());
  const auto [face, added] = scan.face_of.emplace(std::pair(scan.object, scan.group), next);
  if (added) scan.surface.faces.push_back({scan.group.empty() ? scan.object : scan.group, 0});
  scan.surface.polygon_face.push_back(face->second);
}

void add_line(ObjScan& scan, const ObjLine& line, const ImportInput& input) {
  switch (line.keyword) {
    case ObjKeyword::vertex:
      scan.surface.vertices.push_back(parse_triple(line, input.where));
      ++scan.counts.vertices;
      break;
    case ObjKeyword::normal:
      ++scan.counts.normals;
      break;
    case ObjKeyword::face:
      add_face(scan, line, input);
      break;
    case ObjKeyword::group:
      scan.group = group_name(line.text);
      break;
    case ObjKeyword::object:
      scan.object = group_name(line.text);
      scan.group.clear();
      break;
    case ObjKeyword::texture:
    case ObjKeyword::other:
      break;
  }
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

Evidence sniff_obj(const ImportInput& input) {
  return looks_like_obj(beginning(input)) ? Evidence::weak : Evidence::none;
}

Surface read_obj(ImportInput& input, const ImportOptions& options) {
  ObjScan scan;
  scan.surface.polygon_offsets.push_back(0);
  ObjLines lines({reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size()});
  for (ObjLine line; lines.next(line);) add_line(scan, line, input);
  Surface surface = std::move(scan.surface);
  if (surface.polygon_count() == 0)
    throw InputError(input.where, "holds no faces (f lines): is it an OBJ file with a surface?");
  check_indices(surface, input);
  surface.sources.push_back(unitless_source("obj", options));
  for (Vec3& vertex : surface.vertices) vertex *= surface.sources[0].unit;
  surface.parts.push_back({""});
  if (surface.faces.size() == 1) {
    surface.faces.clear();
    assign_dihedral_faces(surface, std::vector<std::uint32_t>(surface.polygon_count(), 0),
                          weld(surface.vertices));
  }
  surface.sources[0].bytes = std::move(input.bytes);
  return surface;
}

}  // namespace

constinit const FileReader kObjReader{
    .format = &kObjFormat, .sniff = sniff_obj, .read = read_obj, .is_text = [](const ImportInput&) {
      return true;
    }};

}  // namespace flexel
