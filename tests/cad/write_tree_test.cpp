// A file's own unit, schema, names, colours and placements come back.
#include "cad/deform/write_tree.h"

#include <gtest/gtest.h>

#include <BRepBuilderAPI_Copy.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <Interface_Static.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <STEPControl_Controller.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDocStd_Document.hxx>
#include <TopoDS_Shape.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_GraphNode.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <cmath>
#include <map>
#include <memory>
#include <string_view>

#include "base/files/memory_file.h"
#include "cad/read/assembly_paths.h"
#include "tests/cad/shape_volume.h"

namespace flexel::cad {
namespace {

using testing::shape_volume;

// Two boxes of one product, 100 mm apart, in an assembly; the second use has a colour of its own.
CadTree assembly(const std::string& unit, const std::string& schema) {
  CadNode box;
  box.name = "a box";
  box.shape = BRepPrimAPI_MakeBox(10, 20, 30).Shape();
  box.style.colors[1] = Quantity_ColorRGBA(0.2F, 0.4F, 0.6F, 1.0F);
  box.style.layers.emplace_back("layer 7");
  CadNode root;
  root.name = "pair";
  root.children = {box, box};
  gp_Trsf shift;
  shift.SetTranslation(gp_Vec(100, 0, 0));
  root.children[1].location = TopLoc_Location(shift);
  root.children[1].shape = BRepPrimAPI_MakeBox(10, 20, 30).Shape();
  CadTree tree;
  tree.roots.push_back(root);
  tree.length_unit = unit;
  tree.schema = schema;
  tree.time = "2001-02-03T04:05:06";
  return tree;
}

CadReadJob job_of(const Bytes& bytes, const std::string& format) {
  CadReadJob job;
  job.format = format;
  job.bytes = bytes;
  job.where = job.file = "written." + format;
  return job;
}

std::string_view text(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(WriteTree, UnitsAndSchemasComeBack) {
  for (const auto& [unit, word] :
       {std::pair("MM", "MILLI"), std::pair("INCH", "INCH"), std::pair("M", "METRE")})
    for (const char* schema : {"CONFIG_CONTROL_DESIGN", "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }",
                               "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF. {1 0 10303 442 1 1 4 }"}) {
      const Bytes bytes = write_tree({assembly(unit, schema)}, "step");
      EXPECT_NE(text(bytes).find(word), std::string_view::npos) << unit;
      const CadTree back = read_tree(job_of(bytes, "step"), true);
      EXPECT_EQ(back.length_unit, unit);
      EXPECT_EQ(back.schema.substr(0, 5), std::string(schema).substr(0, 5));
      EXPECT_EQ(back.time, "2001-02-03T04:05:06");
      ASSERT_EQ(back.solids, 2u);
      EXPECT_NEAR(shape_volume(back.roots.at(0).children.at(0).shape), 6000, 1e-6)
          << unit;  // mm^3, whatever the unit
      EXPECT_NEAR(back.roots[0].children.at(1).location.Transformation().TranslationPart().X(), 100, 1e-9)
          << unit;
    }
}

TEST(WriteTree, NamesColoursAndLayersComeBack) {
  const CadTree back = read_tree(job_of(write_tree({assembly("MM", "")}, "step"), "step"), true);
  ASSERT_EQ(back.roots.size(), 1u);
  const CadNode& root = back.roots[0];
  EXPECT_TRUE(root.name.IsEqual("pair"));
  ASSERT_EQ(root.children.size(), 2u);
  for (const CadNode& child : root.children) {
    EXPECT_TRUE(child.name.IsEqual("a box"));
    ASSERT_EQ(child.style.layers.size(), 1u);
    EXPECT_TRUE(child.style.layers[0].IsEqual("layer 7"));
    bool found = false;
    for (const auto& color : child.style.colors)
      found = found || (color && std::abs(color->GetRGB().Green() - 0.4) < 1e-3);
    EXPECT_TRUE(found);
  }
}

// Of the leaves of a tree: x + y of their place, and the colour that counts: what their uses say goes first.
void collect_greens(const std::vector<CadNode>& nodes, const TopLoc_Location& above,
                    std::map<double, double>& greens) {
  for (const CadNode& node : nodes) {
    const TopLoc_Location here = above * node.location;
    collect_greens(node.children, here, greens);
    if (node.shape.IsNull()) continue;
    double green = -1;
    for (const ShapeStyle* style : {&node.style, &node.instance_style})
      for (const auto& color : style->colors)
        if (color) green = color->GetRGB().Green();
    const gp_XYZ at = here.Transformation().TranslationPart();
    greens[std::round(at.X() + at.Y())] = std::round(100 * green) / 100;
  }
}

// A shape of its own for each use, as deformation makes them.
void make_own(std::vector<CadNode>& nodes) {
  for (CadNode& node : nodes) {
    make_own(node.children);
    if (!node.shape.IsNull()) node.shape = BRepBuilderAPI_Copy(node.shape).Shape();
  }
}

// Two uses of a pair of boxes; the first box in the second pair has a colour that the outermost assembly gives it.
TEST(WriteTree, ColoursOfSingleUsesInsideAssembliesComeBack) {
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  const auto shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  const auto colors = XCAFDoc_DocumentTool::ColorTool(document->Main());
  gp_Trsf shift;
  shift.SetTranslation(gp_Vec(100, 0, 0));
  const TDF_Label box = shapes->AddShape(BRepPrimAPI_MakeBox(10, 20, 30).Shape(), Standard_False);
  colors->SetColor(box, Quantity_Color(0.2, 0.4, 0.6, Quantity_TOC_RGB), XCAFDoc_ColorSurf);
  const TDF_Label pair = shapes->NewShape(), machine = shapes->NewShape();
  const TDF_Label first = shapes->AddComponent(pair, box, TopLoc_Location());
  shapes->AddComponent(pair, box, TopLoc_Location(shift));
  shift.SetTranslation(gp_Vec(0, 200, 0));
  shapes->AddComponent(machine, pair, TopLoc_Location());
  const TDF_Label second = shapes->AddComponent(machine, pair, TopLoc_Location(shift));
  shapes->UpdateAssemblies();
  TDF_LabelSequence path;
  path.Append(second);
  path.Append(first);
  Handle(XCAFDoc_GraphNode) use;
  ASSERT_TRUE(shapes->SetSHUO(path, use));
  ASSERT_TRUE(XCAFDoc_ShapeTool::FindSHUO(path, use));
  colors->SetColor(use->Label(), Quantity_Color(0.9, 0.8, 0.1, Quantity_TOC_RGB), XCAFDoc_ColorSurf);
  STEPCAFControl_Writer writer;
  writer.SetSHUOMode(Standard_True);
  ASSERT_TRUE(writer.Transfer(document, STEPControl_AsIs));
  const MemoryFile file;
  ASSERT_EQ(writer.Write(file.path().c_str()), IFSelect_RetDone);
  CadTree tree = read_tree(job_of(file.bytes(), "step"), true);
  const std::map<double, double> wanted = {{0, .4}, {100, .4}, {200, .8}, {300, .4}};
  std::map<double, double> greens;
  collect_greens(tree.roots, TopLoc_Location(), greens);
  EXPECT_EQ(greens, wanted);
  make_own(tree.roots);
  const CadTree back = read_tree(job_of(write_tree({tree}, "step"), "step"), true);
  greens.clear();
  collect_greens(back.roots, TopLoc_Location(), greens);
  EXPECT_EQ(greens, wanted);
}

TEST(WriteTree, IgesIsTheSameEveryTime) {
  const CadTree tree = assembly("MM", "");
  std::vector<std::unique_ptr<char[]>> moved;  // what follows lies elsewhere in memory
  const Bytes first = write_tree({tree}, "iges");
  for (std::size_t i = 0; i < 200; ++i) moved.push_back(std::make_unique<char[]>(16 + 8 * i));
  EXPECT_EQ(write_tree({assembly("MM", "")}, "iges"), first);
}

TEST(WriteTree, OtherFormatsHoldTheSolidsInPlace) {
  for (const char* format : {"iges", "brep"}) {
    const CadTree back = read_tree(job_of(write_tree({assembly("MM", "")}, format), format), true);
    EXPECT_EQ(back.solids, 2u) << format;
  }
}

TEST(AssemblyPaths, ASecondUseOfANameHasANumber) {
  CadTree tree = assembly("MM", "");
  CadNode outer;
  outer.name = "machine/1";
  outer.children = {tree.roots[0], tree.roots[0], tree.roots[0].children[0]};
  tree.roots = {outer};
  const CadReadJob job = job_of(write_tree({tree}, "step"), "step");
  const std::vector<std::string> paths = assembly_paths(read_shape(job, nullptr));
  EXPECT_EQ(paths, (std::vector<std::string>{"machine_1/pair", "machine_1/pair", "machine_1/pair-2",
                                             "machine_1/pair-2", "machine_1"}));
  CadReadJob meshed = job;
  meshed.angular_deflection = 0.35;
  const CadMesh mesh = mesh_of(read_shape(meshed, nullptr), meshed);
  ASSERT_EQ(mesh.surface.parts.size(), paths.size());
  for (std::size_t p = 0; p < paths.size(); ++p) EXPECT_EQ(mesh.surface.parts[p].assembly, paths[p]);
}

TEST(AssemblyPaths, ANumberIsNoSiblingsName) {
  const CadTree tree = assembly("MM", "");
  CadNode outer, named = tree.roots[0];
  outer.name = "machine";
  named.name = "pair-2";
  outer.children = {tree.roots[0], tree.roots[0], named};
  CadTree whole = tree;
  whole.roots = {outer};
  const std::vector<std::string> paths =
      assembly_paths(read_shape(job_of(write_tree({whole}, "step"), "step"), nullptr));
  EXPECT_EQ(paths, (std::vector<std::string>{"machine/pair", "machine/pair", "machine/pair-3",
                                             "machine/pair-3", "machine/pair-2", "machine/pair-2"}));
}

}  // namespace
}  // namespace flexel::cad
