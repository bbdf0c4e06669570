// A CAD file as a tree of products: assemblies and the shapes in them, with names, colours and layers.
#pragma once
#include <Quantity_ColorRGBA.hxx>
#include <TCollection_ExtendedString.hxx>
#include <TopAbs_ShapeEnum.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Shape.hxx>
#include <XCAFDoc_ColorType.hxx>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "cad/read/occt.h"

namespace flexel::cad {

inline constexpr std::array<XCAFDoc_ColorType, 3> kColorTypes = {XCAFDoc_ColorGen, XCAFDoc_ColorSurf,
                                                                 XCAFDoc_ColorCurv};

struct ShapeStyle {
  std::array<std::optional<Quantity_ColorRGBA>, kColorTypes.size()> colors;
  std::vector<TCollection_ExtendedString> layers;
};

// A face or solid of a shape that has a name or a style of its own.
struct StyledShape {
  TopoDS_Shape shape;
  TCollection_ExtendedString name;
  ShapeStyle style;
};

// What counts as solids of a shape: shells where it has none.
[[nodiscard]] TopAbs_ShapeEnum kind_of_solids(const TopoDS_Shape& shape);

constexpr std::size_t kNoSolid = static_cast<std::size_t>(-1);

struct CadNode {
  TCollection_ExtendedString name, instance_name;  // of the product, and of its use in the assembly above
  TopLoc_Location location;                        // in the assembly above
  ShapeStyle style, instance_style;
  std::vector<CadNode> children;  // of an assembly
  TopoDS_Shape shape;             // else: as it is in its product, without `location`
  std::vector<StyledShape> styled;
  std::vector<std::size_t>
      solids;  // of `shape`, in the order of exploration: index in solids_of() of the file
};

struct CadTree {
  std::vector<CadNode> roots;
  double unit = 1e-3;        // metres per unit of the shapes
  std::string length_unit;   // of the STEP file, as OpenCASCADE's "write.step.unit" has it
  std::string schema, time;  // of the STEP file's header
  std::size_t solids = 0;    // of the file
};

// Products that are used several times come once for each use, for each is deformed in its own way. Throws as
// read_shape(). `in_mm`: shapes of a file in another unit become millimetres.
[[nodiscard]] CadTree read_tree(const CadReadJob& job, bool in_mm);

}  // namespace flexel::cad
