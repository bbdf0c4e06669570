// What of a face's domain is in the face, however thin it is there.
#include "cad/deform/face_domain.h"

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
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

}  // namespace
}  // namespace flexel::cad
