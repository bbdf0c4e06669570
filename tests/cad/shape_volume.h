// The volume of a shape as OpenCASCADE integrates it.
#pragma once
#include <BRepGProp.hxx>
#include <GProp_GProps.hxx>
#include <TopoDS_Shape.hxx>

namespace flexel::cad::testing {

// In cubes of the shape's unit, to a relative 1e-9.
inline double shape_volume(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties, 1e-9);
  return properties.Mass();
}

}  // namespace flexel::cad::testing
