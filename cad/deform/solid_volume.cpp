// The quick rule integrates over the parameters of each face. Where one B-spline curve bounds a whole face it can be off
// by a fifth (OpenCASCADE 7.6.3), and so can the rule with a tolerance, which also takes minutes.
#include "cad/deform/solid_volume.h"

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_Copy.hxx>
#include <BRepGProp.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <cmath>

namespace flexel::cad {
namespace {

// Six times the volume between the face's triangles and `origin`.
double under_triangles(const TopoDS_Face& face, const gp_XYZ& origin) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
  if (mesh.IsNull()) return 0;
  const auto at = [&](Standard_Integer node) {
    return mesh->Node(node).Transformed(location.Transformation()).XYZ() - origin;
  };
  const bool turned = (face.Orientation() == TopAbs_REVERSED) != location.Transformation().IsNegative();
  double sum = 0;
  for (Standard_Integer t = 1; t <= mesh->NbTriangles(); ++t) {
    Standard_Integer a = 0, b = 0, c = 0;
    mesh->Triangle(t).Get(a, b, c);
    sum += at(a).Dot(at(b).Crossed(at(c)));
  }
  return turned ? -sum : sum;
}

}  // namespace

double quick_volume(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties);
  return properties.Mass();
}

// The chords of both shapes of a comparison cut off about as much.
double mesh_volume(const TopoDS_Shape& shape) {
  constexpr double kDeflection = 1e-4;  // of the diagonal
  constexpr double kAngle = 0.15;       // rad
  Bnd_Box box;
  BRepBndLib::Add(shape, box, Standard_False);
  if (box.IsVoid()) return 0;
  // Of a copy: triangles that stay in the shape would be written with it.
  const TopoDS_Shape copy = BRepBuilderAPI_Copy(shape, Standard_False, Standard_False).Shape();
  BRepMesh_IncrementalMesh(copy, kDeflection * std::sqrt(box.SquareExtent()), Standard_False, kAngle,
                           Standard_True);
  double sum = 0;
  for (TopExp_Explorer face(copy, TopAbs_FACE); face.More(); face.Next())
    sum += under_triangles(TopoDS::Face(face.Current()), box.CornerMin().XYZ());
  return sum / 6;
}

Volumes volumes_of(const TopoDS_Shape& before, const TopoDS_Shape& after, double expected) {
  constexpr double kClose = 5e-4;
  const Volumes quick{quick_volume(before), quick_volume(after)};
  if (std::abs(quick.after / quick.before - expected) <= kClose) return quick;
  return {mesh_volume(before), mesh_volume(after)};
}

}  // namespace flexel::cad
