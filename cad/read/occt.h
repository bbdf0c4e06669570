// What the readers of OpenCASCADE's formats (STEP, IGES, BREP) share. OpenCASCADE's types are only declared.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/cad/cad_job.h"

class TopoDS_Shape;

namespace flexel::cad {

using ShapeColor = std::array<double, 3>;  // red, green, blue in [0, 1], as the file has them
// What a file says of its solids and faces. Owns what it needs.
struct ShapeLabels {
  std::function<std::string(const TopoDS_Shape& solid)> solid_name;
  std::function<std::string(const TopoDS_Shape& face)> face_name;
  std::function<std::string(const TopoDS_Shape& compound)> assembly_name;  // of a product's shape, or ""
  std::function<std::optional<ShapeColor>(const TopoDS_Shape& solid_or_face)> color;
  std::function<std::string(const TopoDS_Shape& solid_or_face)> layer =
      {};  // of IGES: STEP's are read with its tree
};

// A file's shape.
struct CadShape {
  std::shared_ptr<TopoDS_Shape> shape;
  double unit = 1e-3;  // metres per unit of the shape
  ShapeLabels labels;
};

// Throw InputError: damaged, no solid.
[[nodiscard]] CadShape read_step(const CadReadJob& job, const Warn& warn);
[[nodiscard]] CadShape read_iges(const CadReadJob& job);
[[nodiscard]] CadShape read_brep(const CadReadJob& job);
// By the job's format.
[[nodiscard]] CadShape read_shape(const CadReadJob& job, const Warn& warn);

// The solids of a shape, in the order of the parts that are made of them; where there are none, the closed shells.
// Throws InputError: neither.
[[nodiscard]] std::vector<TopoDS_Shape> solids_of(const TopoDS_Shape& shape, const std::string& where);

// The solids, tessellated. Throws InputError: no solid, a deflection that is not positive.
[[nodiscard]] CadMesh mesh_of(const CadShape& shape, const CadReadJob& job);

// The message for what OpenCASCADE found wrong with a file.
[[nodiscard]] std::string damage_message(const std::string& what);

}  // namespace flexel::cad
