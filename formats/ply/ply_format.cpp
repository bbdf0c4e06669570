// PLY: polygons, colours and numbers of any name at vertices and faces, binary or text; no unit.
#include <algorithm>

#include "formats/common/file_format.h"
#include "formats/ply/ply_text.h"

namespace flexel {
namespace {

// Its vertices' x is a float.
bool has_float_coordinates(const SurfaceSource& source) {
  if (source.format != "ply-binary" || source.bytes.empty()) return false;
  const PlyHeader header = parse_ply_header(source.bytes, source.file);
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end()) return false;
  const std::size_t x = vertex_layout(*vertex).position[0];
  return x != kNoProperty && vertex->properties[x].type == PlyType::float32;
}

}  // namespace

constinit const FileFormat kPlyFormat{.name = "ply",
                                      .title = "PLY",
                                      .encoding = FileEncoding::both,
                                      .holds_attributes = true,
                                      .write_new = write_new_ply,
                                      .rewrite = rewrite_ply,
                                      .refine = refine_ply,
                                      .add_note =
                                          [](Surface& surface, bool, const std::string& note) {
                                            add_source_line(surface, kPlyFormat.name, "comment " + note, 2);
                                          },
                                      .in_single_precision = has_float_coordinates};

}  // namespace flexel
