// What the readers of OpenCASCADE's formats (STEP, IGES, BREP) share. Inside flexel_import; OpenCASCADE's
// types are only declared.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>

#include "formats/cad/cad_reading.h"
#include "formats/common/readers.h"

class TopoDS_Shape;

namespace flexel {

using ShapeColor = std::array<double, 3>;  // red, green, blue in [0, 1], as the file has them

// What a file says of its solids and faces.
struct ShapeLabels {
  std::function<std::string(const TopoDS_Shape& solid)> solid_name;
  std::function<std::string(const TopoDS_Shape& face)> face_name;
  std::function<std::optional<ShapeColor>(const TopoDS_Shape& solid_or_face)> color;
};

// What OpenCASCADE's readers of STEP and IGES make of every unit [m].
inline constexpr double kMillimetre = 1e-3;

// The solids of `shape`, tessellated. `unit`: metres per unit of the shape. Throws InputError: no solid, a
// deflection that is not positive.
[[nodiscard]] CadMesh mesh_of(const TopoDS_Shape& shape, double unit, const ShapeLabels& labels,
                              const ImportOptions& options, const ImportInput& input);

// The message for what OpenCASCADE found wrong with a file.
[[nodiscard]] std::string damage_message(const std::string& what);

// Runs `read`, which uses OpenCASCADE on the file, in a process of its own (reading_child.h), and finishes the
// mesh. It gets options whose warnings come through. Exceptions, crashes, endless loops and a hunger for
// memory become InputError.
[[nodiscard]] Surface read_with_occt(const ImportInput& input, const ImportOptions& options,
                                     SurfaceSource source,
                                     const std::function<CadMesh(const ImportOptions&)>& read);

}  // namespace flexel
