// Spheres whose pole is a corner of a face, turned so that the face is clear of both poles.
#pragma once
#include <TopoDS_Shape.hxx>
#include <functional>

namespace flexel::cad {

// The same shape: faces, edges and vertices in the same order and in the same places, without the edges of no length at
// the poles. `image` of a face or solid of the shape as it was; itself where nothing changed.
struct TurnedShape {
  TopoDS_Shape shape;
  std::function<TopoDS_Shape(const TopoDS_Shape& part)> image;
};

// A B-spline keeps a pole as a row of poles in one point, and meshers (gmsh) stumble over such a corner of a surface that
// they cannot tell to be a sphere. Left as it is: a face that goes all around, or nearly around any axis. The edges get
// curves in the parameters of the turned sphere beside those that they have.
[[nodiscard]] TurnedShape turn_spheres(const TopoDS_Shape& shape);

}  // namespace flexel::cad
