// The new axis is across the middle of the face, of all such directions the one that the face stays farthest from.
#include "cad/deform/sphere_frames.h"

#include <BRepTools_ReShape.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <ElSLib.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Iterator.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "cad/deform/face_domain.h"
#include "cad/fit/fit.h"

namespace flexel::cad {
namespace {

constexpr double kClear = 0.95;  // sine of the latitude that a face may reach
constexpr double kExact = 1e-8;  // of an edge from its curve on the sphere, in the shape's unit

Handle(Geom_SphericalSurface) sphere_of(const TopoDS_Face& face) {
  TopLoc_Location location;
  Handle(Geom_Surface) surface = BRep_Tool::Surface(face, location);
  if (!location.IsIdentity()) return {};
  if (const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface); !trimmed.IsNull())
    surface = trimmed->BasisSurface();
  return Handle(Geom_SphericalSurface)::DownCast(surface);
}

// Whether an edge of the face is a pole, and none is a seam.
bool has_pole_at_corner(const TopoDS_Face& face) {
  bool pole = false;
  for (TopExp_Explorer each(face, TopAbs_EDGE); each.More(); each.Next()) {
    const TopoDS_Edge& edge = TopoDS::Edge(each.Current());
    if (BRep_Tool::Degenerated(edge))
      pole = true;
    else if (BRep_Tool::IsClosed(edge, face))
      return false;
  }
  return pole;
}

// Unit vectors from the centre to points of the face.
std::vector<gp_XYZ> directions_of(const TopoDS_Face& face, const Handle(Geom_SphericalSurface) & sphere) {
  constexpr int kPoints = 48;  // in each direction
  const FaceDomain d = face_domain(face);
  const FaceMask mask(face, d);
  const gp_XYZ centre = sphere->Location().XYZ();
  std::vector<gp_XYZ> found;
  for (int i = 0; i <= kPoints; ++i)
    for (int j = 0; j <= kPoints; ++j) {
      const double u = d.u_begin + (d.u_end - d.u_begin) * i / kPoints,
                   v = d.v_begin + (d.v_end - d.v_begin) * j / kPoints;
      if (mask.has_near(u, v, (d.u_end - d.u_begin) / kPoints, (d.v_end - d.v_begin) / kPoints))
        found.push_back((sphere->Value(u, v).XYZ() - centre) / sphere->Radius());
    }
  return found;
}

// Nothing: every axis comes near a pole.
std::optional<gp_Ax3> frame_clear_of(const std::vector<gp_XYZ>& directions, const gp_Ax3& before) {
  constexpr int kAxes = 72;
  gp_XYZ mean(0, 0, 0);
  for (const gp_XYZ& each : directions) mean += each;
  if (directions.empty() || mean.Modulus() < 0.2 * static_cast<double>(directions.size())) return {};
  const gp_Ax2 about(before.Location(), gp_Dir(mean));
  std::optional<gp_Dir> best;
  double least = kClear;
  for (int k = 0; k < kAxes; ++k) {
    const double angle = M_PI * k / kAxes;
    const gp_XYZ axis =
        std::cos(angle) * about.XDirection().XYZ() + std::sin(angle) * about.YDirection().XYZ();
    double highest = 0;
    for (const gp_XYZ& each : directions) highest = std::max(highest, std::abs(axis.Dot(each)));
    if (highest >= least) continue;
    least = highest;
    best = gp_Dir(axis);
  }
  if (!best) return {};
  gp_Ax3 frame(before.Location(), *best, gp_Dir(mean.Reversed()));  // the seam is behind the face
  if (!before.Direct()) frame.YReverse();
  return frame;
}

// The curve of an edge on the turned sphere, over the parameters of that on the old one. Null: there is none so exact.
Handle(Geom2d_Curve)
    turned_curve(const Handle(Geom2d_Curve) & old_curve, double begin, double end,
                 const Handle(Geom_SphericalSurface) & from, const Handle(Geom_SphericalSurface) & to) {
  constexpr std::size_t kSpans = 8;
  const auto map = [&](double t) {
    const gp_Pnt2d old = old_curve->Value(t);
    double u = 0, v = 0;
    ElSLib::SphereParameters(to->Position(), to->Radius(), from->Value(old.X(), old.Y()), u, v);
    return gp_XYZ(u, v, 0);
  };
  const CurveFit fit = fit_curve(map, make_knots(begin, end, {}, kSpans), false, kExact / to->Radius());
  if (fit.curve.IsNull() || !fit.reached) return {};
  TColgp_Array1OfPnt2d poles(1, fit.curve->NbPoles());
  for (Standard_Integer i = 1; i <= poles.Length(); ++i)
    poles(i) = gp_Pnt2d(fit.curve->Pole(i).X(), fit.curve->Pole(i).Y());
  return new Geom2d_BSplineCurve(poles, fit.curve->Knots(), fit.curve->Multiplicities(), kDegree);
}

struct EdgeCurve {
  TopoDS_Edge edge;
  Handle(Geom2d_Curve) curve;
  double begin = 0, end = 0;
};

// Of all edges but those at poles; nothing where one has none.
std::optional<std::vector<EdgeCurve>> turned_curves(const TopoDS_Face& face,
                                                    const Handle(Geom_SphericalSurface) & from,
                                                    const Handle(Geom_SphericalSurface) & to) {
  std::vector<EdgeCurve> curves;
  for (TopExp_Explorer each(face, TopAbs_EDGE); each.More(); each.Next()) {
    EdgeCurve made;
    made.edge = TopoDS::Edge(each.Current());
    if (BRep_Tool::Degenerated(made.edge)) continue;
    const Handle(Geom2d_Curve) old_curve = BRep_Tool::CurveOnSurface(made.edge, face, made.begin, made.end);
    if (old_curve.IsNull()) return {};
    made.curve = turned_curve(old_curve, made.begin, made.end, from, to);
    if (made.curve.IsNull()) return {};
    curves.push_back(made);
  }
  return curves;
}

// Null: it stays as it is.
TopoDS_Face turned_face(const TopoDS_Face& face) {
  const Handle(Geom_SphericalSurface) sphere = sphere_of(face);
  if (sphere.IsNull() || !has_pole_at_corner(face)) return {};
  const std::optional<gp_Ax3> frame = frame_clear_of(directions_of(face, sphere), sphere->Position());
  if (!frame) return {};
  const Handle(Geom_SphericalSurface) turned = new Geom_SphericalSurface(*frame, sphere->Radius());
  const std::optional<std::vector<EdgeCurve>> curves = turned_curves(face, sphere, turned);
  if (!curves) return {};
  const BRep_Builder builder;
  for (const EdgeCurve& each : *curves) {
    builder.UpdateEdge(each.edge, each.curve, turned, TopLoc_Location(), BRep_Tool::Tolerance(each.edge));
    builder.Range(each.edge, turned, TopLoc_Location(), each.begin, each.end);
  }
  TopoDS_Face made;
  builder.MakeFace(made, turned, BRep_Tool::Tolerance(face));
  for (TopoDS_Iterator wire(face); wire.More(); wire.Next()) {
    if (wire.Value().ShapeType() != TopAbs_WIRE) return {};
    TopoDS_Wire copy;
    builder.MakeWire(copy);
    for (TopoDS_Iterator edge(wire.Value().Oriented(TopAbs_FORWARD)); edge.More(); edge.Next())
      if (!BRep_Tool::Degenerated(TopoDS::Edge(edge.Value()))) builder.Add(copy, edge.Value());
    copy.Closed(wire.Value().Closed());
    builder.Add(made, copy.Oriented(wire.Value().Orientation()));
  }
  return made;
}

}  // namespace

TurnedShape turn_spheres(const TopoDS_Shape& shape) {
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  const Handle(BRepTools_ReShape) turned = new BRepTools_ReShape();
  bool any = false;
  for (Standard_Integer i = 1; i <= faces.Extent(); ++i) {
    const TopoDS_Face face = TopoDS::Face(faces(i).Oriented(TopAbs_FORWARD));
    const TopoDS_Face made = turned_face(face);
    if (made.IsNull()) continue;
    turned->Replace(face, made);
    any = true;
  }
  if (!any) return {shape, [](const TopoDS_Shape& part) { return part; }};
  return {turned->Apply(shape), [turned](const TopoDS_Shape& part) { return turned->Apply(part); }};
}

}  // namespace flexel::cad
