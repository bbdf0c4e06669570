// A file's own unit, schema, names, colours and placements come back.
#include "cad/deform/write_tree.h"

#include <gtest/gtest.h>

#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <GProp_GProps.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Controller.hxx>
#include <TopoDS_Shape.hxx>
#include <string_view>

#include "cad/read/assembly_paths.h"

namespace flexel::cad {
namespace {

double solid_volume(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties);
  return properties.Mass();
}

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
      EXPECT_NEAR(solid_volume(back.roots.at(0).children.at(0).shape), 6000, 1e-6)
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
