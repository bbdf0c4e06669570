// The same shape with other geometry: faces, edges and vertices in the same order, each with what DeformedGeometry found.
#pragma once
#include <TopoDS_Shape.hxx>

#include "cad/deform/deformed_geometry.h"

namespace flexel::cad {

// `geometry`: of `shape`. `modified` (TopoDS_Shape of a face or solid of `shape`) leads to its image.
struct DeformedShape {
  TopoDS_Shape shape;
  std::function<TopoDS_Shape(const TopoDS_Shape& part)> image;  // null shape: there is none
};

// Throws Standard_Failure: OpenCASCADE cannot put it together.
[[nodiscard]] DeformedShape deform_shape(const TopoDS_Shape& shape, const DeformedGeometry& geometry);

}  // namespace flexel::cad
