// Formats of one maker's programs, whose files only these read whole, and descriptions that hold no surface.
#include "formats/exchange/unread_formats.h"

#include <fmt/format.h>

namespace flexel {
namespace {

struct UnreadFormat {
  std::string_view extension;
  std::string_view title;  // "an IFC building model"
  std::string_view way;    // what to do
};

constexpr std::string_view kExport = "export it from there as STEP";
constexpr std::string_view kIfc =
    "convert it with IfcConvert of IfcOpenShell (IfcConvert model.ifc model.stp)";

constexpr UnreadFormat kUnread[] = {
    {"ifc", "an IFC building model", kIfc},
    {"ifczip", "a packed IFC building model", kIfc},
    {"jt", "a JT file",
     "export STEP from the program that wrote it, or open it in CAD Assistant of Open Cascade and save it as "
     "STEP"},
    {"sldprt", "a part of SolidWorks", kExport},
    {"sldasm", "an assembly of SolidWorks", kExport},
    {"catpart", "a part of CATIA", kExport},
    {"catproduct", "an assembly of CATIA", kExport},
    {"ipt", "a part of Inventor", kExport},
    {"iam", "an assembly of Inventor", kExport},
    {"prt", "a part of NX or Creo", kExport},
    {"par", "a part of Solid Edge", kExport},
    {"f3d", "a design of Fusion", kExport},
    {"fcstd", "a document of FreeCAD", kExport},
    {"3dm", "a model of Rhino", kExport},
    {"skp", "a model of SketchUp", "export it from there as STL or Collada"},
    {"x_t", "a Parasolid file", "export STEP from the program that wrote it"},
    {"x_b", "a Parasolid file", "export STEP from the program that wrote it"},
    {"sat", "an ACIS file", "export STEP from the program that wrote it"},
    {"sab", "an ACIS file", "export STEP from the program that wrote it"},
    {"dwg", "a drawing of AutoCAD", "export its solids from there as STL or STEP"},
    {"scad", "a program of OpenSCAD", "run it: openscad -o part.stl part.scad"},
    {"wrl", "a VRML file", "export it as X3D, OBJ or STL"},
    {"usdz", "a USD file", "export it as glTF, OBJ or STL"},
};

// STEP's syntax is that of IFC too; its header names the schema.
bool is_ifc(std::string_view beginning) {
  const std::size_t schema = beginning.find("FILE_SCHEMA");
  if (schema == std::string_view::npos) return false;
  const std::string_view named = beginning.substr(schema, 80);
  return named.find("'IFC") != std::string_view::npos || named.find("'ifc") != std::string_view::npos;
}

bool is_jt(std::string_view beginning) {
  return beginning.starts_with("Version ") && beginning.substr(0, 80).find(" JT ") != std::string_view::npos;
}

}  // namespace

std::string unread_extension(std::string_view extension) {
  for (const UnreadFormat& format : kUnread)
    if (format.extension == extension)
      return fmt::format("is {}, which is not read: {}", format.title, format.way);
  return "";
}

std::string unread_bytes(std::string_view beginning) {
  if (is_ifc(beginning)) return unread_extension("ifc");
  return is_jt(beginning) ? unread_extension("jt") : "";
}

}  // namespace flexel
