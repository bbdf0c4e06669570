// Spheres with a pole at a corner of a face: the same shape, without it.
#include "cad/deform/sphere_frames.h"

#include <gtest/gtest.h>

#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_Surface.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <cmath>

#include "cad/deform/deform_shape.h"
#include "tests/cad/shape_volume.h"

namespace flexel::cad {
namespace {

using testing::shape_volume;

double area(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(shape, properties, 1e-9);
  return properties.Mass();
}

int poles(const TopoDS_Shape& shape) {
  int count = 0;
  for (TopExp_Explorer edge(shape, TopAbs_EDGE); edge.More(); edge.Next())
    count += BRep_Tool::Degenerated(TopoDS::Edge(edge.Current()));
  return count;
}

// Largest distance of an edge from its curve on each face that has it.
double widest_gap(const TopoDS_Shape& shape) {
  double widest = 0;
  for (TopExp_Explorer each(shape, TopAbs_FACE); each.More(); each.Next()) {
    const TopoDS_Face& face = TopoDS::Face(each.Current());
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
    for (TopExp_Explorer part(face, TopAbs_EDGE); part.More(); part.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(part.Current());
      double begin = 0, end = 0;
      const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, begin, end);
      if (curve.IsNull()) continue;
      const Handle(Geom2d_Curve) on_face = BRep_Tool::CurveOnSurface(edge, face, begin, end);
      for (int i = 0; i <= 50; ++i) {
        const double t = begin + (end - begin) * i / 50;
        const gp_Pnt2d uv = on_face->Value(t);
        widest = std::max(widest, curve->Value(t).Distance(surface->Value(uv.X(), uv.Y())));
      }
    }
  }
  return widest;
}

// Pieces of balls with a pole at a corner, in frames of their own.
std::vector<TopoDS_Shape> balls() {
  const gp_Ax2 here(gp_Pnt(3, -2, 5), gp_Dir(1, 2, 3));
  return {BRepPrimAPI_MakeSphere(7, 0, M_PI / 2, M_PI / 2).Shape(),
          BRepPrimAPI_MakeSphere(here, 4, 0, M_PI / 2, 1.1).Shape(),
          BRepPrimAPI_MakeSphere(here, 0.3, -M_PI / 2, 0, 2.2).Shape()};
}

TEST(SphereFrames, NoPoleIsLeftAndAllElseStays) {
  for (const TopoDS_Shape& ball : balls()) {
    ASSERT_GT(poles(ball), 0);
    const TurnedShape turned = turn_spheres(ball);
    EXPECT_EQ(poles(turned.shape), 0);
    EXPECT_TRUE(BRepCheck_Analyzer(turned.shape).IsValid());
    EXPECT_NEAR(shape_volume(turned.shape), shape_volume(ball), 1e-6 * shape_volume(ball));
    EXPECT_LT(widest_gap(turned.shape), 1e-7);
    TopTools_IndexedMapOfShape before, after;
    TopExp::MapShapes(ball, TopAbs_FACE, before);
    TopExp::MapShapes(turned.shape, TopAbs_FACE, after);
    ASSERT_EQ(before.Extent(), after.Extent());
    for (Standard_Integer f = 1; f <= before.Extent(); ++f) {
      EXPECT_TRUE(turned.image(before(f)).IsSame(after(f))) << f;
      EXPECT_EQ(before(f).Orientation(), after(f).Orientation()) << f;
      EXPECT_NEAR(area(after(f)), area(before(f)), 1e-6 * area(before(f))) << f;
      EXPECT_EQ(GeomAdaptor_Surface(BRep_Tool::Surface(TopoDS::Face(after(f)))).GetType(),
                GeomAdaptor_Surface(BRep_Tool::Surface(TopoDS::Face(before(f)))).GetType());
    }
  }
}

TEST(SphereFrames, WhatGoesAllAroundStaysAsItIs) {
  for (const TopoDS_Shape& ball :
       {BRepPrimAPI_MakeSphere(7).Shape(), BRepPrimAPI_MakeSphere(7, 0, M_PI / 2).Shape(),
        BRepPrimAPI_MakeBox(1, 2, 3).Shape()})
    EXPECT_TRUE(turn_spheres(ball).shape.IsSame(ball));
}

TEST(SphereFrames, WhatIsTurnedCanBeDeformed) {
  const auto bend = [](const gp_XYZ& p) {
    return gp_XYZ(p.X() + 0.02 * p.Z() * p.Z(), p.Y() + std::sin(0.2 * p.X()), p.Z());
  };
  const ShapeMap map{[&](std::size_t) { return PointMap(bend); }, [&] { return PointMap(bend); }};
  for (const TopoDS_Shape& ball : balls()) {
    const TopoDS_Shape turned = turn_spheres(ball).shape;
    const DeformedGeometry geometry(turned, map, {1e-4, 1});
    const DeformedShape deformed = deform_shape(turned, geometry);
    EXPECT_TRUE(BRepCheck_Analyzer(deformed.shape).IsValid());
    EXPECT_EQ(poles(deformed.shape), 0);
    EXPECT_NEAR(shape_volume(deformed.shape), shape_volume(ball),
                1e-4 * shape_volume(ball));  // det J = 1
  }
}

}  // namespace
}  // namespace flexel::cad
