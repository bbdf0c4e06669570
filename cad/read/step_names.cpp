// A solid that is the only one of its product has the product's name, any other its own. Both are read from
// the STEP entities that OpenCASCADE translated into shapes.
#include <Quantity_Color.hxx>
#include <STEPConstruct_Styles.hxx>
#include <STEPControl_Reader.hxx>
#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepShape_Face.hxx>
#include <StepShape_SolidModel.hxx>
#include <StepVisual_Colour.hxx>
#include <StepVisual_StyledItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <vector>

#include "cad/read/step_names.h"
#include "formats/common/readers.h"

namespace flexel::cad {
namespace {

std::string name_of(const Handle(TCollection_HAsciiString) & text) {
  if (text.IsNull()) return "";
  const std::string name = clean_name(text->ToCString());
  const bool empty = name == "NONE" || name.starts_with("Open CASCADE STEP translator");
  return empty ? "" : name;
}

}  // namespace

void StepNames::add_product(const StepBasic_ProductDefinition& definition, const TopoDS_Shape& shape) {
  if (definition.Formation().IsNull() || definition.Formation()->OfProduct().IsNull()) return;
  std::string name = name_of(definition.Formation()->OfProduct()->Name());
  if (name.empty()) name = name_of(definition.Formation()->OfProduct()->Id());
  assembly_.emplace(shape.TShape().get(), name);
  std::vector<const void*> solids;
  for (TopExp_Explorer explorer(shape, TopAbs_SOLID); explorer.More(); explorer.Next())
    solids.push_back(explorer.Current().TShape().get());
  for (const void* solid : solids) {
    const auto [entry, added] = product_.emplace(solid, std::pair(solids.size(), name));
    if (!added && solids.size() < entry->second.first) entry->second = {solids.size(), name};
  }
}

StepNames::StepNames(const STEPControl_Reader& reader) {
  add_colors(reader);
  const Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  for (Standard_Integer i = 1; i <= process->NbMapped(); ++i) {
    const Handle(Standard_Transient) entity = process->Mapped(i);
    const bool is_product = entity->IsKind(STANDARD_TYPE(StepBasic_ProductDefinition));
    const bool is_item =
        entity->IsKind(STANDARD_TYPE(StepShape_Face)) || entity->IsKind(STANDARD_TYPE(StepShape_SolidModel));
    if (!is_product && !is_item) continue;
    const TopoDS_Shape shape = TransferBRep::ShapeResult(process, entity);
    if (shape.IsNull()) continue;
    if (is_product)
      add_product(*Handle(StepBasic_ProductDefinition)::DownCast(entity), shape);
    else
      own_.emplace(shape.TShape().get(),
                   name_of(Handle(StepRepr_RepresentationItem)::DownCast(entity)->Name()));
  }
}

// Styled items; of two that style one shape, the last, which overrides.
void StepNames::add_colors(const STEPControl_Reader& reader) {
  STEPConstruct_Styles styles(reader.WS());
  if (!styles.LoadStyles()) return;
  const Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  for (Standard_Integer i = 1; i <= styles.NbStyles(); ++i) {
    const Handle(StepVisual_StyledItem) style = styles.Style(i);
    if (style.IsNull() || style->Item().IsNull()) continue;
    Handle(StepVisual_Colour) surface, boundary, curve, render;
    Standard_Real transparency = 0;
    Standard_Boolean component = Standard_False;
    if (!styles.GetColors(style, surface, boundary, curve, render, transparency, component)) continue;
    Quantity_Color color;
    if (surface.IsNull() || !STEPConstruct_Styles::DecodeColor(surface, color)) continue;
    const TopoDS_Shape shape = TransferBRep::ShapeResult(process, style->Item());
    if (shape.IsNull()) continue;
    // Of one use of the shape: it may have others.
    if (component && color_.contains(shape.TShape().get())) continue;
    ShapeColor& values = color_[shape.TShape().get()];
    color.Values(values[0], values[1], values[2], Quantity_TOC_sRGB);
    for (double& value : values) value = std::clamp(std::round(value * 1e6) / 1e6, 0.0, 1.0);
  }
}

std::optional<ShapeColor> StepNames::color(const TopoDS_Shape& shape) const {
  const auto found = color_.find(shape.TShape().get());
  return found == color_.end() ? std::nullopt : std::optional(found->second);
}

std::string StepNames::own(const TopoDS_Shape& shape) const {
  const auto found = own_.find(shape.TShape().get());
  return found == own_.end() ? "" : found->second;
}

std::string StepNames::assembly(const TopoDS_Shape& compound) const {
  const auto found = assembly_.find(compound.TShape().get());
  return found == assembly_.end() ? "" : found->second;
}

std::string StepNames::solid(const TopoDS_Shape& solid) const {
  const auto product = product_.find(solid.TShape().get());
  const std::string own_name = own(solid);
  if (product == product_.end()) return own_name;
  const auto& [solids, name] = product->second;
  return (solids > 1 && !own_name.empty()) || name.empty() ? own_name : name;
}

}  // namespace flexel::cad
