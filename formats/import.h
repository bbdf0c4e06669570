// Reads CAD and mesh files into a Surface. Implemented by flexel_import (OpenCASCADE), declared here so that
// no program sees that library.
#pragma once
#include <functional>
#include <optional>
#include <string>

#include "formats/surface.h"

namespace flexel {

struct ImportOptions {
  std::optional<double> unit;  // metres per file unit, for formats that carry none (STL, OBJ, PLY, OFF,
                               // BREP); default mm
  std::optional<std::string> format;  // "step", "iges", "brep", "stl", "obj", "ply", "off",
                                      // "glb" (glTF too), "3mf": overrides sniffing
  // STEP tessellation: largest distance [m] of the triangles from the CAD surface, and largest angle [rad]
  // between neighbouring normals. No deflection given: a thousandth of the part's diagonal.
  std::optional<double> deflection;
  double angular_deflection = 0.35;
  // The mesh is split until no edge is longer than this [m], so that flat faces can bend too; more than 2
  // million triangles are an error. Not given: meshes (STL, OBJ, ...) are the user's and stay as they are,
  // STEP's tessellation is split to a 64th of the diagonal of all solids together, or to what 2 million
  // triangles for the file allow.
  std::optional<double> largest_edge;
  // s of processor time that OpenCASCADE may take over a file; not given: a minute and 10 s a megabyte
  std::optional<double> occt_seconds;
  // Told, a line each, what a reader passed over and the user should know.
  std::function<void(const std::string&)> warn;
};

// Reads one file ("-": stdin). The format is told by its bytes, then by its extension. Solids become parts;
// CAD faces, groups or dihedral regions become faces; the result has passed check(). Throws InputError:
// unreadable, empty, truncated, unknown format, not finite, STEP without OpenCASCADE (the message says how to
// get it), a `unit` given for a file that carries another.
[[nodiscard]] Surface import_surface(const std::string& path, const ImportOptions& options = {});

// A line for each file of a format that is otherwise written again as it came, whose triangles were split
// (ImportOptions::largest_edge): what its new file does not hold.
[[nodiscard]] std::vector<std::string> refinement_notes(const Surface& surface);

}  // namespace flexel
