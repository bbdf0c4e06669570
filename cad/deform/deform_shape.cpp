// OpenCASCADE's own modifier walks the topology; pcurves stay as they are, for the parameters of surfaces do.
#include "cad/deform/deform_shape.h"

#include <BRepTools_Modification.hxx>
#include <BRepTools_Modifier.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_TrimmedCurve.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Standard_Failure.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <memory>

namespace flexel::cad {
namespace {

class Deformation : public BRepTools_Modification {
 public:
  explicit Deformation(const DeformedGeometry& geometry) : geometry_(geometry) {}

  Standard_Boolean NewSurface(const TopoDS_Face& face, Handle(Geom_Surface) & surface,
                              TopLoc_Location& location, Standard_Real& tolerance,
                              Standard_Boolean& reverse_wires, Standard_Boolean& reverse_face) override {
    const DeformedFace* moved = geometry_.find_face(face);
    if (moved == nullptr || moved->surface.IsNull()) return Standard_False;
    surface = moved->surface;
    location.Identity();
    tolerance = 1e-7;
    reverse_wires = reverse_face = Standard_False;
    return Standard_True;
  }
  Standard_Boolean NewCurve(const TopoDS_Edge& edge, Handle(Geom_Curve) & curve, TopLoc_Location& location,
                            Standard_Real& tolerance) override {
    const DeformedEdge* moved = geometry_.find_edge(edge);
    if (moved == nullptr) return Standard_False;
    location.Identity();
    tolerance = moved->tolerance;
    curve = moved->curve;
    if (moved->kept) curve = new Geom_TrimmedCurve(moved->curve, moved->begin, moved->end);
    return Standard_True;
  }
  Standard_Boolean NewPoint(const TopoDS_Vertex& vertex, gp_Pnt& point, Standard_Real& tolerance) override {
    const DeformedVertex* moved = geometry_.find_vertex(vertex);
    if (moved == nullptr) return Standard_False;
    point = moved->point;
    tolerance = moved->tolerance;
    return Standard_True;
  }
  Standard_Boolean NewCurve2d(const TopoDS_Edge& edge, const TopoDS_Face& face, const TopoDS_Edge&,
                              const TopoDS_Face&, Handle(Geom2d_Curve) & curve,
                              Standard_Real& tolerance) override {
    Standard_Real begin = 0, end = 0;
    Handle(Geom2d_Curve) own = BRep_Tool::CurveOnSurface(edge, face, begin, end);
    const DeformedEdge* moved = geometry_.find_edge(edge);
    if (own.IsNull() || moved == nullptr) return Standard_False;
    if (const auto trimmed = Handle(Geom2d_TrimmedCurve)::DownCast(own); !trimmed.IsNull())
      own = trimmed->BasisCurve();
    curve = new Geom2d_TrimmedCurve(own, begin, end);
    tolerance = moved->tolerance;
    return Standard_True;
  }
  Standard_Boolean NewParameter(const TopoDS_Vertex& vertex, const TopoDS_Edge& edge,
                                Standard_Real& parameter, Standard_Real& tolerance) override {
    const DeformedVertex* moved = geometry_.find_vertex(vertex);
    parameter = BRep_Tool::Parameter(vertex, edge);
    tolerance = moved != nullptr ? moved->tolerance : 1e-7;
    return Standard_True;
  }
  GeomAbs_Shape Continuity(const TopoDS_Edge& edge, const TopoDS_Face& first, const TopoDS_Face& second,
                           const TopoDS_Edge&, const TopoDS_Face&, const TopoDS_Face&) override {
    return BRep_Tool::Continuity(edge, first, second);
  }

 private:
  const DeformedGeometry& geometry_;
};

}  // namespace

DeformedShape deform_shape(const TopoDS_Shape& shape, const DeformedGeometry& geometry) {
  const Handle(Deformation) deformation = new Deformation(geometry);
  const auto modifier = std::make_shared<BRepTools_Modifier>(shape);
  modifier->Perform(deformation);
  if (!modifier->IsDone()) throw Standard_Failure("the deformed faces cannot be put together");
  DeformedShape result;
  result.shape = modifier->ModifiedShape(shape);
  result.image = [modifier](const TopoDS_Shape& part) {
    try {
      return modifier->ModifiedShape(part);
    } catch (const Standard_Failure&) {
      return TopoDS_Shape();
    }
  };
  return result;
}

}  // namespace flexel::cad
