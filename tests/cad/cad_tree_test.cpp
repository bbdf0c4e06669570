// What a file's tree must not lose: solids that repeat, what lies in no solid, open shells, scaled places.
#include "cad/deform/cad_tree.h"

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Shell.hxx>
#include <gp_Pln.hxx>
#include <sstream>

#include "base/error.h"

namespace flexel::cad {
namespace {

CadReadJob brep(const TopoDS_Shape& shape, double unit = 1e-3) {
  std::ostringstream out;
  BRepTools::Write(shape, out);
  const std::string text = out.str();
  CadReadJob job;
  job.format = "brep";
  job.unit = unit;
  job.where = job.file = "part.brep";
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  job.bytes.assign(begin, begin + text.size());
  return job;
}

TopoDS_Compound compound(const std::vector<TopoDS_Shape>& shapes) {
  TopoDS_Compound all;
  BRep_Builder builder;
  builder.MakeCompound(all);
  for (const TopoDS_Shape& shape : shapes) builder.Add(all, shape);
  return all;
}

TopLoc_Location at(double x) {
  gp_Trsf shift;
  shift.SetTranslation(gp_Vec(x, 0, 0));
  return TopLoc_Location(shift);
}

std::size_t faces(const CadNode& node) {
  TopTools_IndexedMapOfShape found;
  if (!node.shape.IsNull()) TopExp::MapShapes(node.shape, TopAbs_FACE, found);
  std::size_t count = static_cast<std::size_t>(found.Extent());
  for (const CadNode& child : node.children) count += faces(child);
  return count;
}

TEST(CadTree, RepeatedSolidsComeApartAndLooseFacesStay) {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(10, 10, 10).Shape();
  const TopoDS_Shape sheet = BRepBuilderAPI_MakeFace(gp_Pln(), 0, 5, 0, 5).Shape();
  const CadTree tree = read_tree(brep(compound({box, box.Moved(at(30)), sheet})), true);
  EXPECT_EQ(tree.solids, 2u);
  ASSERT_EQ(tree.roots.size(), 1u);
  ASSERT_EQ(tree.roots[0].children.size(), 3u);
  EXPECT_EQ(faces(tree.roots[0]), 13u);
  EXPECT_EQ(tree.roots[0].children[0].solids, std::vector<std::size_t>{0});
  EXPECT_EQ(tree.roots[0].children[1].solids, std::vector<std::size_t>{1});
}

TEST(CadTree, OpenShellsAreNoSolids) {
  TopoDS_Shell open;
  BRep_Builder builder;
  builder.MakeShell(open);
  TopExp_Explorer face(BRepPrimAPI_MakeBox(5, 5, 5).Shape(), TopAbs_FACE);
  for (int i = 0; i < 5; ++i, face.Next()) builder.Add(open, face.Current());
  const TopoDS_Shape closed =
      TopExp_Explorer(BRepPrimAPI_MakeBox(gp_Pnt(20, 0, 0), 5, 5, 5).Shape(), TopAbs_SHELL).Current();
  const CadTree tree = read_tree(brep(compound({open, closed})), true);
  EXPECT_EQ(tree.solids, 1u);
  EXPECT_EQ(tree.roots.at(0).solids, (std::vector<std::size_t>{kNoSolid, 0}));
}

TEST(CadTree, OtherUnitsBecomeMillimetresWhereTheFormatHasThem) {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(1, 2, 3).Shape();
  EXPECT_EQ(read_tree(brep(box, 1.0), false).unit, 1.0);
  const CadTree tree = read_tree(brep(box, 1.0), true);
  EXPECT_EQ(tree.unit, 1e-3);
  TopTools_IndexedMapOfShape vertices;
  TopExp::MapShapes(tree.roots.at(0).shape, TopAbs_VERTEX, vertices);
  double largest = 0;
  for (Standard_Integer v = 1; v <= vertices.Extent(); ++v)
    largest = std::max(largest, BRep_Tool::Pnt(TopoDS::Vertex(vertices(v))).Z());
  EXPECT_NEAR(largest, 3000, 1e-9);
}

}  // namespace
}  // namespace flexel::cad
