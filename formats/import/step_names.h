// Names of solids and faces in a STEP file. Inside flexel_import; OpenCASCADE's types are only declared.
#pragma once
#include <map>
#include <string>
#include <utility>

class STEPControl_Reader;
class StepBasic_ProductDefinition;
class TopoDS_Shape;

namespace flexel {

class StepNames {
 public:
  // Of a file that has been transferred.
  explicit StepNames(const STEPControl_Reader& reader);
  // The name of a face or solid itself, or "".
  [[nodiscard]] std::string own(const TopoDS_Shape& shape) const;
  // A product with one solid gives it its name; the solids of one product are told apart by their own names.
  [[nodiscard]] std::string solid(const TopoDS_Shape& solid) const;

 private:
  void add_product(const StepBasic_ProductDefinition& definition, const TopoDS_Shape& shape);

  // By the TShape that a shape's instances share.
  std::map<const void*, std::string> own_;
  // Of the smallest product that holds a solid, and how many solids that product holds.
  std::map<const void*, std::pair<std::size_t, std::string>> product_;
};

}  // namespace flexel
