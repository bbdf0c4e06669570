// Solids deformed by maps that are known: valid, as many faces, where the map says, and of the volume that it says.
#include "cad/deform/deform_shape.h"

#include <gtest/gtest.h>

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Plane.hxx>
#include <Poly_Triangulation.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <cmath>

#include "tests/cad/shape_volume.h"

namespace flexel::cad {
namespace {

using testing::shape_volume;

// About the z axis, by an angle that grows along it: keeps the volume.
gp_XYZ twist(const gp_XYZ& p) {
  const double c = std::cos(0.03 * p.Z()), s = std::sin(0.03 * p.Z());
  return {c * p.X() - s * p.Y(), s * p.X() + c * p.Y(), p.Z()};
}
gp_XYZ shear(const gp_XYZ& p) {
  return {p.X() + 0.004 * p.Z() * p.Z(), p.Y() + 3 * std::sin(0.05 * p.X()), p.Z()};
}

ShapeMap same_everywhere(const PointMap& map) {
  return {[map](std::size_t) { return map; }, [map] { return map; }};
}

struct Sample {
  const char* name;
  TopoDS_Shape shape;
};

std::vector<Sample> samples() {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(60, 20, 12).Shape();
  const TopoDS_Shape drilled =
      BRepAlgoAPI_Cut(box, BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(30, 10, -1), gp::DZ()), 5, 20).Shape())
          .Shape();
  return {{"box", box},
          {"drilled box", drilled},
          {"cylinder", BRepPrimAPI_MakeCylinder(8, 50).Shape()},
          {"sphere", BRepPrimAPI_MakeSphere(20).Shape()},     // poles
          {"cone", BRepPrimAPI_MakeCone(15, 0, 40).Shape()},  // an apex
          {"torus", BRepPrimAPI_MakeTorus(30, 8).Shape()}};   // two seams
}

constexpr double kTolerance = 5e-4;

TEST(DeformShape, SolidsStayValidAndKeepTheirVolume) {
  for (const auto& [name, shape] : samples())
    for (const PointMap& map : {PointMap(twist), PointMap(shear)}) {
      const DeformedGeometry geometry(shape, same_everywhere(map), {kTolerance, 5});
      const DeformedShape deformed = deform_shape(shape, geometry);
      EXPECT_TRUE(BRepCheck_Analyzer(deformed.shape).IsValid()) << name;
      EXPECT_NEAR(shape_volume(deformed.shape) / shape_volume(shape), 1, 3e-5) << name;
      TopTools_IndexedMapOfShape before, after;
      TopExp::MapShapes(shape, TopAbs_FACE, before);
      TopExp::MapShapes(deformed.shape, TopAbs_FACE, after);
      ASSERT_EQ(before.Extent(), after.Extent()) << name;
      for (Standard_Integer f = 1; f <= before.Extent(); ++f) {
        EXPECT_TRUE(geometry.face(f - 1).reached) << name << ' ' << f;
        EXPECT_TRUE(deformed.image(before(f)).IsSame(after(f))) << name << ' ' << f;
      }
    }
}

// At points of our own in every face; the parameters stay.
TEST(DeformShape, FacesAreWhereTheMapSays) {
  for (const auto& [name, shape] : samples()) {
    const DeformedGeometry geometry(shape, same_everywhere(twist), {kTolerance, 5});
    for (Standard_Integer f = 1; f <= geometry.faces().Extent(); ++f) {
      const Handle(Geom_Surface) before = BRep_Tool::Surface(TopoDS::Face(geometry.faces()(f)));
      const DeformedFace& face = geometry.face(f - 1);
      const FaceDomain& d = face.domain;
      for (double a = 0.0153; a < 1; a += 0.071)
        for (double b = 0.0327; b < 1; b += 0.083) {
          const double u = d.u_begin + a * (d.u_end - d.u_begin), v = d.v_begin + b * (d.v_end - d.v_begin);
          EXPECT_LT((face.surface->Value(u, v).XYZ() - twist(before->Value(u, v).XYZ())).Modulus(),
                    1.2 * kTolerance)
              << name << ' ' << f;
        }
    }
  }
}

TEST(DeformShape, ARigidMotionKeepsPlanesAndCylinders) {
  gp_Trsf turn;
  turn.SetRotation(gp_Ax1(gp_Pnt(3, 2, 1), gp_Dir(1, 2, 3)), 0.8);
  const auto rigid = [turn](const gp_XYZ& p) {
    gp_XYZ moved = p;
    turn.Transforms(moved);
    return moved;
  };
  const TopoDS_Shape drilled = samples()[1].shape;
  const DeformedGeometry geometry(drilled, same_everywhere(rigid), {kTolerance, 5});
  std::size_t planes = 0, cylinders = 0;
  for (Standard_Integer f = 0; f < geometry.faces().Extent(); ++f) {
    EXPECT_TRUE(geometry.face(f).kept);
    planes += geometry.face(f).surface->IsKind(STANDARD_TYPE(Geom_Plane));
    cylinders += geometry.face(f).surface->IsKind(STANDARD_TYPE(Geom_CylindricalSurface));
  }
  EXPECT_EQ(planes, 6u);
  EXPECT_EQ(cylinders, 1u);
  const DeformedShape moved = deform_shape(drilled, geometry);
  EXPECT_TRUE(BRepCheck_Analyzer(moved.shape).IsValid());
  EXPECT_NEAR(shape_volume(moved.shape) / shape_volume(drilled), 1, 1e-9);
}

// Pcurves stay, so whatever the tolerance of an edge or a vertex covers in the shape has to be covered after it.
TEST(DeformShape, TolerancesOfTheShapeAreKept) {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(60, 20, 12).Shape();
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(box, TopAbs_EDGE, edges);
  const TopoDS_Edge edge = TopoDS::Edge(edges(3));
  BRep_Builder().UpdateEdge(edge, 0.02);
  BRep_Builder().UpdateVertex(TopExp::FirstVertex(edge), 0.05);
  const auto longer = [](const gp_XYZ& p) { return gp_XYZ(2 * p.X(), 2 * p.Y(), 2 * p.Z()); };
  for (const PointMap& map : {PointMap(shear), PointMap(longer)}) {
    const double stretch = map(gp_XYZ(1, 0, 0)).X() > 1.5 ? 2 : 1;
    const DeformedGeometry geometry(box, same_everywhere(map), {kTolerance, 5});
    const DeformedShape deformed = deform_shape(box, geometry);
    const TopoDS_Edge after = TopoDS::Edge(deformed.image(edge));
    EXPECT_GE(BRep_Tool::Tolerance(after), stretch * 0.02 * (1 - 1e-9));
    EXPECT_GE(BRep_Tool::Tolerance(TopExp::FirstVertex(after)), stretch * 0.05 * (1 - 1e-9));
    EXPECT_LT(geometry.widest_gap(), 0.01);  // what is told of gaps is measured
  }
}

// The tip of a conical pocket is on the wall that it opens in, amid that wall's points: its vertex is where the cone's
// fit has its pole, not between the fits, and edges lead away from there.
TEST(DeformShape, AVertexAtAPoleIsThePole) {
  const TopoDS_Shape pocket =
      BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(60, 20, 12).Shape(),
                      BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(33.7, 0, 1), gp::DZ()), 6, 0, 7.7).Shape())
          .Shape();
  const auto wave = [](const gp_XYZ& p) {
    return gp_XYZ(p.X(), p.Y() + std::sin(0.3 * p.X() + 0.4 * p.Z()), p.Z() + 0.5 * std::cos(0.2 * p.X()));
  };
  const DeformedGeometry geometry(pocket, same_everywhere(wave), {kTolerance, 5});
  const TopoDS_Shape deformed = deform_shape(pocket, geometry).shape;
  EXPECT_TRUE(BRepCheck_Analyzer(deformed).IsValid());
  int poles = 0;
  for (TopExp_Explorer each(deformed, TopAbs_FACE); each.More(); each.Next()) {
    const TopoDS_Face& face = TopoDS::Face(each.Current());
    for (TopExp_Explorer part(face, TopAbs_EDGE); part.More(); part.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(part.Current());
      if (!BRep_Tool::Degenerated(edge)) continue;
      ++poles;
      double begin = 0, end = 0;
      const Handle(Geom2d_Curve) on_face = BRep_Tool::CurveOnSurface(edge, face, begin, end);
      const gp_Pnt2d uv = on_face->Value(begin);
      const gp_Pnt pole = BRep_Tool::Surface(face)->Value(uv.X(), uv.Y());
      EXPECT_LT(pole.Distance(BRep_Tool::Pnt(TopExp::FirstVertex(edge))), 1e-9);
      for (TopExp_Explorer other(face, TopAbs_EDGE); other.More(); other.Next()) {
        const TopoDS_Edge& beside = TopoDS::Edge(other.Current());
        if (BRep_Tool::Degenerated(beside)) continue;
        const bool first = TopExp::FirstVertex(beside).IsSame(TopExp::FirstVertex(edge));
        if (!first && !TopExp::LastVertex(beside).IsSame(TopExp::FirstVertex(edge))) continue;
        const Handle(Geom_Curve) curve = BRep_Tool::Curve(beside, begin, end);
        EXPECT_LT(curve->Value(first ? begin : end).Distance(pole), 1e-9);
      }
    }
  }
  EXPECT_EQ(poles, 1);
}

// What is around a pole is smaller than any tolerance: a curve that ends there is the nearer to the pole's surface, the nearer
// it is to the pole. A quarter of a cone has its tip in a corner of three faces.
TEST(DeformShape, ACurveIntoAPoleLiesOnItsSurface) {
  const TopoDS_Shape cone = BRepPrimAPI_MakeCone(15, 0, 40, M_PI / 2).Shape();
  const auto wave = [](const gp_XYZ& p) {
    return gp_XYZ(p.X() + 2 * std::sin(0.2 * p.Z()), p.Y() + std::sin(0.3 * p.X() + 0.2 * p.Z()), p.Z());
  };
  const DeformedGeometry geometry(cone, same_everywhere(wave), {0.05, 40});  // fits that differ
  const TopoDS_Shape deformed = deform_shape(cone, geometry).shape;
  EXPECT_TRUE(BRepCheck_Analyzer(deformed).IsValid());
  int curves = 0;
  for (TopExp_Explorer each(deformed, TopAbs_FACE); each.More(); each.Next()) {
    const TopoDS_Face& face = TopoDS::Face(each.Current());
    TopoDS_Vertex pole;
    for (TopExp_Explorer part(face, TopAbs_EDGE); part.More(); part.Next())
      if (BRep_Tool::Degenerated(TopoDS::Edge(part.Current())))
        pole = TopExp::FirstVertex(TopoDS::Edge(part.Current()));
    if (pole.IsNull()) continue;
    for (TopExp_Explorer part(face, TopAbs_EDGE); part.More(); part.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(part.Current());
      const bool first = TopExp::FirstVertex(edge).IsSame(pole);
      if (BRep_Tool::Degenerated(edge) || (!first && !TopExp::LastVertex(edge).IsSame(pole))) continue;
      ++curves;
      double begin = 0, end = 0;
      const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, begin, end);
      const Handle(Geom2d_Curve) on_face = BRep_Tool::CurveOnSurface(edge, face, begin, end);
      for (const double share : {1e-1, 1e-3, 1e-5}) {
        const double t = first ? begin + share * (end - begin) : end - share * (end - begin);
        const gp_Pnt along = curve->Value(t);
        const gp_Pnt2d uv = on_face->Value(t);
        EXPECT_LT(along.Distance(BRep_Tool::Surface(face)->Value(uv.X(), uv.Y())),
                  1e-4 * along.Distance(BRep_Tool::Pnt(pole)))
            << share;
      }
    }
  }
  EXPECT_EQ(curves, 2);
}

// Pcurves of other programs pass the last knot of their surface by a little: in a span that short, second derivatives are
// the rounding of a file's digits, and a rim beside a pole has a curvature of any size.
TEST(DeformShape, AFaceThatPassesAKnotByALittleHasNoShortSpan) {
  constexpr double kPast = 3e-5, kLoose = 0.05;  // of the surface's lengths, which are some 25 a unit
  TColgp_Array2OfPnt poles(1, 2, 1, 6);
  for (int i = 1; i <= 2; ++i)
    for (int j = 1; j <= 6; ++j) poles(i, j) = gp_Pnt(20 * i, 10 * j, j % 2);
  TColStd_Array1OfReal u_knots(1, 2), v_knots(1, 3);
  TColStd_Array1OfInteger u_times(1, 2), v_times(1, 3);
  u_knots(1) = v_knots(1) = 0, u_knots(2) = v_knots(2) = 1, v_knots(3) = 2;
  u_times(1) = u_times(2) = v_times(2) = 2, v_times(1) = v_times(3) = 4;
  const Handle(Geom_BSplineSurface) surface =
      new Geom_BSplineSurface(poles, u_knots, v_knots, u_times, v_times, 1, 3);
  const TopoDS_Face face = BRepBuilderAPI_MakeFace(surface, 0, 1, 0, 1 + kPast, 1e-9);
  const DeformedGeometry geometry(face, same_everywhere(twist), {kLoose, 5});
  EXPECT_TRUE(geometry.face(0).reached);
  const auto fitted = Handle(Geom_BSplineSurface)::DownCast(geometry.face(0).surface);
  ASSERT_FALSE(fitted.IsNull());
  EXPECT_NEAR(fitted->VKnot(fitted->NbVKnots()), 1 + kPast, 1e-12);
  for (int i = 2; i <= fitted->NbVKnots(); ++i)
    EXPECT_GT(fitted->VKnot(i) - fitted->VKnot(i - 1), 10 * kPast) << i;
  for (double v = 0; v <= 1; v += 0.03125) {
    const gp_XYZ to = twist(surface->Value(0.3, v).XYZ());
    EXPECT_LT((fitted->Value(0.3, v).XYZ() - to).Modulus(), 1.2 * kLoose) << v;
  }
}

// OpenCASCADE meshes each face with the points of its edges: a face that it cannot mesh is left out without a word.
TEST(DeformShape, EveryFaceCanBeMeshed) {
  for (const auto& [name, shape] : samples()) {
    const DeformedGeometry geometry(shape, same_everywhere(twist), {kTolerance, 5});
    const TopoDS_Shape deformed = deform_shape(shape, geometry).shape;
    const BRepMesh_IncrementalMesh mesh(deformed, 0.05);
    for (TopExp_Explorer each(deformed, TopAbs_FACE); each.More(); each.Next()) {
      TopLoc_Location location;
      const auto triangles = BRep_Tool::Triangulation(TopoDS::Face(each.Current()), location);
      ASSERT_FALSE(triangles.IsNull()) << name;
      EXPECT_GT(triangles->NbTriangles(), 1) << name;
    }
  }
}

}  // namespace
}  // namespace flexel::cad
