// What flexel-cad tells of the faces that it writes is true, however thin they are.
#include "cad/deform/write_job.h"

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <Geom_Surface.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Pln.hxx>
#include <gp_Vec.hxx>
#include <numbers>
#include <sstream>

#include "../mapping/bodies.h"
#include "base/error.h"
#include "formats/lattice/body_file.h"
#include "mapping/space/space_field.h"

namespace flexel::cad {
namespace {

constexpr double kThickness = 2, kMillimetres = 1e-3;
constexpr double kAskedTolerance = 20e-6;                    // m
constexpr double kCoarse = 100.0 / 96, kFine = 100.0 / 768;  // mm, cells of a FaceMask

TopoDS_Wire rectangle(double x_low, double x_high, double y_low, double y_high) {
  return BRepBuilderAPI_MakePolygon(gp_Pnt(x_low, y_low, 0), gp_Pnt(x_high, y_low, 0),
                                    gp_Pnt(x_high, y_high, 0), gp_Pnt(x_low, y_high, 0), Standard_True)
      .Wire();
}

// A frame of 100 x 100 x 2 mm, 4 mm wide, and a rib along y from x = `low` to `high` (mm).
TopoDS_Shape frame(double low, double high) {
  BRepBuilderAPI_MakeFace face(gp_Pln(), rectangle(0, 100, 0, 100));
  face.Add(TopoDS::Wire(rectangle(4, low, 4, 96).Reversed()));
  face.Add(TopoDS::Wire(rectangle(high, 96, 4, 96).Reversed()));
  return BRepPrimAPI_MakePrism(face.Face(), gp_Vec(0, 0, kThickness)).Shape();
}

TopTools_IndexedMapOfShape faces_of(const TopoDS_Shape& shape) {
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  return faces;
}

// Its body at 1 mm: the rib waves, the frame around it rests.
Body waving(const TopoDS_Shape& shape) {
  Lattice lattice;
  lattice.spacing = Vec3::Constant(kMillimetres);
  const auto is_rib = [](const Vec3& x) { return std::abs(x.x() - 0.05) < 1.1e-3; };
  Body body = mapping::test::make_body(
      lattice, {0, 0, 0}, {100, 100, 2},
      [&](const Vec3& x) {
        return (x - Vec3(0.05, 0.05, 0)).head<2>().cwiseAbs().maxCoeff() > 0.046 || is_rib(x);
      },
      Placement::centre);
  mapping::test::deform(body, [&](const Vec3& x) {
    const bool moves = is_rib(x) && x.y() > 0.02 && x.y() < 0.08;
    return Vec3(x + Vec3(0, 0, moves ? 3e-4 * std::sin(2 * std::numbers::pi * x.y() / 12e-3) : 0));
  });
  std::ostringstream out;
  BRepTools::Write(shape, out);
  const std::string text = out.str();
  SurfaceSource source;
  source.file = "frame.brep";
  source.format = "brep";
  source.bytes.assign(reinterpret_cast<const std::byte*>(text.data()),
                      reinterpret_cast<const std::byte*>(text.data()) + text.size());
  Surface& surface = body.surface;
  surface = {};
  surface.sources = {source};
  surface.parts = {{body.parts[0].name}};
  surface.part_source = {0};
  surface.vertices = {Vec3::Zero(), Vec3(0.1, 0, 0), Vec3(0, 0.1, 0)};
  surface.polygon_offsets = {0};
  for (Standard_Integer f = 0; f < faces_of(shape).Extent(); ++f) {  // a triangle stands for each
    surface.faces.push_back({"", 0});
    surface.polygon_face.push_back(static_cast<std::uint32_t>(f));
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), {0, 1, 2});
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  }
  return body;
}

struct Miss {
  double largest = 0;  // m
  std::string face;
};

// Of the upper and the lower face of `written`, along the middle of the rib.
Miss miss_on_rib(const TopoDS_Shape& before, const CadWritten& written, const Body& body, double middle) {
  CadReadJob job;
  job.format = "brep";
  job.bytes = written.files.front().bytes;
  job.where = job.file = "bent.brep";
  const CadShape after = read_shape(job, {});
  const TopTools_IndexedMapOfShape old_faces = faces_of(before), new_faces = faces_of(*after.shape);
  const mapping::SpaceField field(body, mapping::map_method("blended"), 1);
  mapping::SpaceField::Probe probe(field);
  Miss found;
  for (Standard_Integer f = 1; f <= old_faces.Extent(); ++f) {
    const Handle(Geom_Surface) from = BRep_Tool::Surface(TopoDS::Face(old_faces(f))),
                               to = BRep_Tool::Surface(TopoDS::Face(new_faces(f)));
    const gp_Pnt at = from->Value(middle, 50);
    if (std::abs(at.X() - middle) > 1e-9 || std::abs(at.Y() - 50) > 1e-9) continue;
    for (double y = 5; y < 95; y += 0.05) {
      const gp_XYZ x = from->Value(middle, y).XYZ(), moved = to->Value(middle, y).XYZ();
      const double miss = (kMillimetres * Vec3(moved.X(), moved.Y(), moved.Z()) -
                           probe.at(kMillimetres * Vec3(x.X(), x.Y(), x.Z()), 0))
                              .norm();
      if (miss > found.largest) found = {miss, "part/" + std::to_string(f)};
    }
  }
  return found;
}

struct Told {
  CadWritten written;
  Miss miss;
};

Told write_frame(double low, double high) {
  const TopoDS_Shape shape = frame(low, high);
  const Body body = waving(shape);
  CadWriteJob job;
  job.body = body_bytes(body);
  job.formats = {"brep"};
  job.method = "blended";
  job.tolerance = kAskedTolerance;
  Told told{write_deformed(job, [](const std::string&) {}), {}};
  told.miss = miss_on_rib(shape, told.written, body, (low + high) / 2);
  return told;
}

// Between two rows of middles of either raster of a FaceMask: what the fit does not see is told.
TEST(WriteDeformed, AMissOnARibIsToldHoweverThinItIs) {
  const double fine = (std::floor(50 / kFine) + 0.5) * kFine;
  int misses = 0;
  for (const auto& [low, high] :
       {std::pair(50 - 0.45 * kCoarse, 50 + 0.45 * kCoarse), std::pair(fine + 0.01, fine + kFine - 0.01)}) {
    const Told told = write_frame(low, high);
    if (told.miss.largest <= kAskedTolerance) continue;
    ++misses;
    EXPECT_GT(told.written.deviation, 0.5 * told.miss.largest) << low << " " << high;
    EXPECT_FALSE(told.written.missed.empty()) << low << " " << high;
    EXPECT_TRUE(std::any_of(told.written.missed.begin(), told.written.missed.end(), [&](const CadFace& face) {
      return face.name == told.miss.face;
    })) << told.miss.face;
  }
  EXPECT_GT(misses, 0) << "nothing was there to be told";
}

}  // namespace
}  // namespace flexel::cad
