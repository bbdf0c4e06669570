// Options of reading a part's file.
#pragma once
#include <functional>
#include <optional>
#include <string>

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
  // The mesh is split until no edge is longer than this [m], so that flat faces can bend; more than 2 million
  // triangles are an error. Default: meshes (STL, OBJ, ...) stay as they are; the tessellation of CAD files
  // is split to a 64th of the diagonal of all solids together, or as far as 2 million triangles a file allow.
  std::optional<double> largest_edge;
  // s of processor time that OpenCASCADE may take over a file, and bytes of memory; not given: a minute and
  // 10 s a megabyte, and 2 GB and 500 bytes a byte, or 80 % of what is free
  std::optional<double> occt_seconds, occt_memory;
  // Called with a line for each thing that a reader ignored and the user should know.
  std::function<void(const std::string&)> warn;
};

}  // namespace flexel
