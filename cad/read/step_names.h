// Names and colours of solids and faces in a STEP file. OpenCASCADE's types are only declared.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "cad/read/occt.h"

class STEPControl_Reader;
class StepBasic_ProductDefinition;
class TopoDS_Shape;

namespace flexel::cad {

class StepNames {
 public:
  // Of a file that has been transferred.
  explicit StepNames(const STEPControl_Reader& reader);
  // The name of a face or solid itself, or "".
  [[nodiscard]] std::string own(const TopoDS_Shape& shape) const;
  // A product with one solid gives it its name; several solids of one product have their own names.
  [[nodiscard]] std::string solid(const TopoDS_Shape& solid) const;
  // The name of the product whose shape this is, or "".
  [[nodiscard]] std::string assembly(const TopoDS_Shape& compound) const;
  // The colour of a face or solid itself, in sRGB as the file has it.
  [[nodiscard]] std::optional<ShapeColor> color(const TopoDS_Shape& shape) const;

 private:
  void add_colors(const STEPControl_Reader& reader);
  void add_product(const StepBasic_ProductDefinition& definition, const TopoDS_Shape& shape);

  // By the TShape that a shape's instances share.
  std::map<const void*, std::string> own_;
  std::map<const void*, ShapeColor> color_;
  std::map<const void*, std::string> assembly_;
  // Of the smallest product that holds a solid, and how many solids that product holds.
  std::map<const void*, std::pair<std::size_t, std::string>> product_;
};

}  // namespace flexel::cad
