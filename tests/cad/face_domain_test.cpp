// What of a face's domain is in the face, however thin it is there.
#include "cad/deform/face_domain.h"

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Wire.hxx>
#include <gp_Pln.hxx>
#include <gp_Pnt.hxx>

namespace flexel::cad {
namespace {

// In the plane z = 0, two arms of 100 mm, `thick` wide (mm).
TopoDS_Face angle_face(double thick) {
  BRepBuilderAPI_MakePolygon polygon;
  for (const gp_Pnt& corner : {gp_Pnt(0, 0, 0), gp_Pnt(100, 0, 0), gp_Pnt(100, thick, 0),
                               gp_Pnt(thick, thick, 0), gp_Pnt(thick, 100, 0), gp_Pnt(0, 100, 0)})
    polygon.Add(corner);
  polygon.Close();
  return BRepBuilderAPI_MakeFace(gp_Pln(), polygon.Wire());
}

// In the plane z = 0, a frame of 100 x 100 mm, 4 mm wide, and a rib at x = `middle`, `thick` wide (mm).
TopoDS_Face rib_face(double middle, double thick) {
  const auto wire = [](const gp_Pnt& low, const gp_Pnt& high) {
    BRepBuilderAPI_MakePolygon polygon(low, gp_Pnt(high.X(), low.Y(), 0), high, gp_Pnt(low.X(), high.Y(), 0),
                                       Standard_True);
    return polygon.Wire();
  };
  BRepBuilderAPI_MakeFace face(gp_Pln(), wire(gp_Pnt(0, 0, 0), gp_Pnt(100, 100, 0)));
  face.Add(TopoDS::Wire(wire(gp_Pnt(4, 4, 0), gp_Pnt(middle - thick / 2, 96, 0)).Reversed()));
  face.Add(TopoDS::Wire(wire(gp_Pnt(middle + thick / 2, 4, 0), gp_Pnt(96, 96, 0)).Reversed()));
  return face;
}

TEST(FaceMask, FindsArmsOfAnyThickness) {
  for (const double thick : {20.0, 1.0, 0.1, 0.03, 0.003}) {
    const TopoDS_Face face = angle_face(thick);
    const FaceDomain domain = face_domain(face);
    const FaceMask mask(face, domain);
    for (const double along : {10.0, 50.0, 99.0}) {
      for (const double across : {0.2, 0.5, 0.8}) {
        EXPECT_TRUE(mask.has(along, across * thick)) << thick << " " << along;
        EXPECT_TRUE(mask.has(across * thick, along)) << thick << " " << along;
      }
      if (along < 20) continue;
      EXPECT_FALSE(mask.has(along, thick + 1)) << thick << " " << along;
      EXPECT_FALSE(mask.has(thick + 1, along)) << thick << " " << along;
    }
    EXPECT_FALSE(mask.has(60, 60)) << thick;
  }
}

// Between the rows of middles of the coarse raster, too.
TEST(FaceMask, FindsRibsBetweenItsMiddles) {
  for (const double thick : {3.0, 1.0, 0.3})
    for (const double at : {46.0, 49.3, 50.0, 50.4}) {
      const TopoDS_Face face = rib_face(at, thick);
      const FaceMask mask(face, face_domain(face));
      for (const double along : {10.0, 33.3, 50.0, 81.0}) {
        EXPECT_TRUE(mask.has(at, along)) << thick << " " << at;
        EXPECT_FALSE(mask.has(at - thick / 2 - 1, along)) << thick << " " << at;
        EXPECT_FALSE(mask.has(at + thick / 2 + 1, along)) << thick << " " << at;
      }
    }
}

}  // namespace
}  // namespace flexel::cad
