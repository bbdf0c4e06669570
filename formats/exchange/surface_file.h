// Writes a Surface as a mesh file, in the unit it came in.
#pragma once
#include <string>
#include <vector>

#include "formats/part/surface.h"

namespace flexel {

struct FileFormat;  // formats/common/file_format.h

// A format to write, as text where it has both encodings and `ascii` is set.
struct SurfaceFormat {
  const FileFormat* file = nullptr;
  bool ascii = false;
  bool operator==(const SurfaceFormat&) const = default;
};

// The format for `format` ("stl", "obj", "ply", "off", "glb", "3mf") or, when that is empty, for the extension of
// `path`; InputError when neither tells (a pipe needs --format) or the format is unknown (with the nearest). CAD formats
// with `cad` only.
[[nodiscard]] SurfaceFormat surface_format(const std::string& format, const std::string& path = "",
                                           bool ascii = false, bool cad = false);

// Writes `surface` with vertex i moved by displacement[i] (vertices x 3, m). Every coordinate is written in
// `unit` metres; pass default_unit(surface) for the unit the file came in (mm for CAD formats). STL: the
// triangles in the input's order, normals recomputed, the header and the solids' names kept; polygons are
// triangulated. OBJ from OBJ: the same lines with only v and vn rewritten; a vertex that did not move keeps
// its text. Else a new OBJ with a group per face. PLY, OFF, GLB and 3MF likewise: from a file of the same format
// (PLY: the same encoding, or `ply`) that file with other positions and normals, else a new one with the
// surface's colours, attributes and names. GLB and 3MF are always in their source's unit, a new GLB in metres. Throws
// InputError for the disk, and when a coordinate does not fit the single precision of the format.
void write_surface(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                   double unit, const std::string& path);

[[nodiscard]] double default_unit(const Surface& surface);

// True when the path has "{part}" in it: then every part goes to a file of its own, by its name.
[[nodiscard]] bool names_parts(const std::string& path);
// Writes each part to the path with its name ("/" as "_", and a number where that is another part's name) in
// place of "{part}". Parts of a file that holds several become new files, with their colours, groups and
// attributes.
void write_parts(const Surface& surface, const std::vector<Vec3>& displacement, SurfaceFormat format,
                 double unit, const std::string& path);

}  // namespace flexel
