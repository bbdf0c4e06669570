// The volumes of a solid before and after its deformation.
#pragma once
#include <TopoDS_Shape.hxx>

namespace flexel::cad {

// In the shape's unit cubed; negative: inside out.
struct Volumes {
  double before = 0, after = 0;
};

// By OpenCASCADE's quick rule, which is good to some 1e-4 on most faces. Where their ratio is not near `expected` (nan:
// not known), and the rule may be at fault, by the triangles of both.
[[nodiscard]] Volumes volumes_of(const TopoDS_Shape& before, const TopoDS_Shape& after, double expected);

[[nodiscard]] double quick_volume(const TopoDS_Shape& shape);
[[nodiscard]] double mesh_volume(const TopoDS_Shape& shape);

}  // namespace flexel::cad
