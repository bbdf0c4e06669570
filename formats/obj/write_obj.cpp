// Writes OBJ. From OBJ: the source's bytes are copied up to each number of a v or vn line that changes, and
// the new number is put in its place, so everything else stays as it was. A normal (vn) is turned by the
// smallest rotation that takes the summed area vectors of the polygons that use it from rest to their
// deformed state; its length stays.
#include <fmt/format.h>

#include <iterator>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/output_file.h"
#include "base/parallel.h"
#include "base/version.h"
#include "formats/common/normal_change.h"
#include "formats/common/surface_writers.h"
#include "formats/obj/obj_text.h"

namespace flexel {
namespace {

std::string_view source_text(const DeformedSurface& deformed) {
  const Bytes& bytes = deformed.surface.sources[0].bytes;
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void add_polygon(const DeformedSurface& deformed, const std::vector<ObjCorner>& corners,
                 std::vector<NormalChange>& changes) {
  const std::vector<Vec3>&vertices = deformed.surface.vertices, &displacement = deformed.displacement;
  bool moved = false;
  for (const ObjCorner& corner : corners) moved = moved || displacement[corner.vertex] != Vec3::Zero();
  const Vec3 rest = area_vector(corners.size(), [&](std::size_t i) { return vertices[corners[i].vertex]; });
  const Vec3 now = moved ? area_vector(corners.size(),
                                       [&](std::size_t i) {
                                         const std::int64_t v = corners[i].vertex;
                                         return Vec3(vertices[v] + displacement[v]);
                                       })
                         : rest;
  for (const ObjCorner& corner : corners) {
    if (corner.normal == kNoIndex || corner.normal >= static_cast<std::int64_t>(changes.size())) continue;
    NormalChange& change = changes[corner.normal];
    change.rest += rest;
    change.deformed += now;
    change.moved = change.moved || moved;
  }
}

std::size_t count_normals(std::string_view text) {
  std::size_t count = 0;
  ObjLines lines(text);
  for (ObjLine line; lines.next(line);) count += line.keyword == ObjKeyword::normal;
  return count;
}

// What happens to each vn line. Corners that name one that does not exist have none.
std::vector<NormalChange> normal_changes(const DeformedSurface& deformed) {
  std::vector<NormalChange> changes(count_normals(source_text(deformed)));
  ObjCounts counts;
  std::vector<ObjCorner> corners;
  const std::string& file = deformed.surface.sources[0].file;
  ObjLines lines(source_text(deformed));
  for (ObjLine line; lines.next(line);) {
    counts.vertices += line.keyword == ObjKeyword::vertex;
    counts.normals += line.keyword == ObjKeyword::normal;
    if (line.keyword != ObjKeyword::face) continue;
    parse_face(line, counts, file, corners);
    for (const ObjCorner& corner : corners)
      if (corner.vertex >= static_cast<std::int64_t>(deformed.displacement.size()))
        throw InputError(fmt::format("{}:{}", file, line.number), "index out of range");
    add_polygon(deformed, corners, changes);
  }
  return changes;
}

void rewrite_vertex(const DeformedSurface& deformed, const ObjLine& line, std::size_t vertex,
                    Rewriter& rewriter) {
  const Vec3 rest = parse_triple(line, deformed.surface.sources[0].file);
  std::string_view text = line.text;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::string_view word = next_word(text);
    if (const auto value = deformed.rewritten(vertex, i, rest[i]))
      rewriter.replace(word, fmt::format("{}", *value));
  }
}

void rewrite_normal(const NormalChange& change, const ObjLine& line, const std::string& file,
                    Rewriter& rewriter) {
  const std::optional<Eigen::Quaterniond> rotation = turn(change);
  if (!rotation) return;
  const Vec3 turned = *rotation * parse_triple(line, file);
  std::string_view text = line.text;
  for (const double value : turned) rewriter.replace(next_word(text), fmt::format("{:.9g}", value));
}

// Names in OBJ have no blanks.
std::string obj_name(std::string name) {
  for (char& c : name)
    if (c == ' ') c = '_';
  return name;
}

// Of a face: the group's own name where the part came from OBJ, else "part/12".
std::string written_group(const Surface& surface, std::uint32_t face, std::uint32_t number) {
  const auto& [name, part] = surface.faces[face];
  const bool own = !name.empty() && part < surface.part_source.size() &&
                   surface.sources[surface.part_source[part]].format == "obj";
  return obj_name(own ? name : fmt::format("{}/{}", surface.parts[part].name, number));
}

}  // namespace

void rewrite_obj(const DeformedSurface& deformed, OutputFile& out) {
  const std::string& file = deformed.surface.sources[0].file;
  const std::vector<NormalChange> changes = normal_changes(deformed);
  Rewriter rewriter(source_text(deformed), out);
  std::size_t vertex = 0, normal = 0;
  ObjLines lines(source_text(deformed));
  for (ObjLine line; lines.next(line);) {
    if (line.keyword == ObjKeyword::vertex) {
      if (vertex == deformed.displacement.size())
        throw InputError(file, "the embedded OBJ has more vertices than the surface");
      rewrite_vertex(deformed, line, vertex++, rewriter);
    } else if (line.keyword == ObjKeyword::normal) {
      rewrite_normal(changes[normal++], line, file, rewriter);
    }
  }
  if (vertex != deformed.displacement.size())
    throw InputError(file, "the embedded OBJ has fewer vertices than the surface");
  rewriter.copy_rest();
}

void write_new_obj(const DeformedSurface& deformed, OutputFile& out) {
  constexpr std::size_t kGrain = 4096;
  const Surface& surface = deformed.surface;
  out.write(fmt::format("# Flexel {}\n", version()));
  std::vector<std::string> chunks(surface.vertices.size() / kGrain + 1);
  parallel_chunks(surface.vertices.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    std::string& text = chunks[begin / kGrain];
    for (std::size_t v = begin; v < end; ++v) {
      text += 'v';
      append_position(text, deformed, v);
      text += '\n';
    }
  });
  for (const std::string& text : chunks) out.write(text);
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  std::string text;
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    const std::uint32_t face = surface.polygon_face[p], part = surface.faces[face].part;
    const std::string name = obj_name(surface.parts[part].name);
    if (p == 0 || part != surface.polygon_part(p - 1)) append_text(text, "o {}\n", name);
    if (p == 0 || face != surface.polygon_face[p - 1])
      append_text(text, "g {}\n", written_group(surface, face, numbers[face]));
    text += 'f';
    for (const std::uint32_t vertex : surface.polygon(p)) append_text(text, " {}", std::uint64_t{vertex} + 1);
    text += '\n';
  }
  out.write(text);
}

}  // namespace flexel
