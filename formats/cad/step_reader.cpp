// STEP through OpenCASCADE.
#include <fmt/format.h>

#include <BRepCheck_Analyzer.hxx>
#include <BRep_Tool.hxx>
#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Version.hxx>
#include <StepGeom_GeometricRepresentationItem.hxx>
#include <StepRepr_Representation.hxx>
#include <StepShape_SolidModel.hxx>
#include <StepShape_TopologicalRepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>

#include "base/error.h"
#include "formats/cad/cad_readers.h"
#include "formats/cad/occt.h"
#include "formats/cad/occt_help.h"
#include "formats/cad/step_names.h"

namespace flexel {
namespace {

bool is_geometry(const Handle(Standard_Transient) & entity) {
  const bool representation = entity->IsKind(STANDARD_TYPE(StepRepr_Representation)) &&
                              !std::string_view(entity->DynamicType()->Name()).starts_with("StepVisual_");
  return representation || entity->IsKind(STANDARD_TYPE(StepGeom_GeometricRepresentationItem)) ||
         entity->IsKind(STANDARD_TYPE(StepShape_TopologicalRepresentationItem));
}

// Units come from far outside the geometry, and without them lengths are wrong.
bool is_unit(const Handle(Standard_Transient) & entity) {
  return std::string_view(entity->DynamicType()->Name()).find("Unit") != std::string_view::npos;
}

// "#176" of "Unresolved Reference, Ent.Id.#176 Param.n0 4 (Id.#225)", or "".
std::string label_in(std::string_view message) {
  constexpr std::string_view kBefore = "Ent.Id.";
  const std::size_t at = message.find(kBefore);
  if (at == std::string_view::npos) return "";
  const std::string_view label = message.substr(at + kBefore.size());
  return std::string(label.substr(0, label.find(' ')));
}

// A reference from a solid or a unit to something that is not in the file. OpenCASCADE keeps these apart, as
// messages on the whole.
void check_references(const Handle(Interface_InterfaceModel) & model, const ImportInput& input) {
  const Handle(Interface_Check) check = model->GlobalCheck();
  const auto examine = [&](Standard_CString message) {
    const std::string label = label_in(message);
    const Standard_Integer number = label.empty() ? 0 : model->NextNumberForLabel(label.c_str());
    if (number > 0 && (is_geometry(model->Value(number)) || is_unit(model->Value(number))))
      throw InputError(input.where, damage_message(message));
  };
  for (Standard_Integer i = 1; i <= check->NbFails(); ++i) examine(check->CFail(i));
  for (Standard_Integer i = 1; i <= check->NbWarnings(); ++i) examine(check->CWarning(i));
}

// OpenCASCADE loads what it can and later follows missing references. So a file with missing references is
// refused, and one whose solids or representations did not load. Returns what did not load of their geometry,
// "" for nothing. Damage elsewhere in the file (drawings, tolerances, colours) is ignored.
std::string check_loaded(const STEPControl_Reader& reader, const ImportInput& input) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  check_references(model, input);
  std::string damage;
  const Interface_CheckIterator checks = reader.WS()->ModelCheckList(Standard_False);
  for (checks.Start(); checks.More(); checks.Next()) {
    if (!checks.Value()->HasFailed() || checks.Number() < 1) continue;
    const Handle(Standard_Transient) entity = model->Value(checks.Number());
    if (!is_geometry(entity) && !is_unit(entity)) continue;
    const std::string found =
        fmt::format("{}: {}", model->StringLabel(entity)->ToCString(), checks.Value()->CFail(1));
    if (!entity->IsKind(STANDARD_TYPE(StepGeom_GeometricRepresentationItem)) ||
        entity->IsKind(STANDARD_TYPE(StepShape_SolidModel)))
      throw InputError(input.where, damage_message(found));
    if (damage.empty()) damage = found;
  }
  return damage;
}

// The file's solids, by what OpenCASCADE made of them.
struct SolidCount {
  std::size_t sound = 0;  // closed
  std::size_t unsound = 0, missing = 0;
};

SolidCount count_solids(const STEPControl_Reader& reader) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  const Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  SolidCount count;
  for (Standard_Integer i = 1; i <= model->NbEntities(); ++i) {
    if (!model->Value(i)->IsKind(STANDARD_TYPE(StepShape_SolidModel))) continue;
    const TopoDS_Shape solid = TransferBRep::ShapeResult(process, model->Value(i));
    if (solid.IsNull()) {
      ++count.missing;
      continue;
    }
    bool closed = solid.ShapeType() == TopAbs_SOLID;
    for (TopExp_Explorer shells(solid, TopAbs_SHELL); shells.More(); shells.Next())
      closed = closed && BRep_Tool::IsClosed(shells.Current());
    ++(closed ? count.sound : count.unsound);
  }
  return count;
}

TopoDS_Shape transfer(STEPControl_Reader& reader, ImportInput& input, const ImportOptions& options) {
  // OpenCASCADE reports on stdout, which belongs to the result.
  Message::DefaultMessenger()->ChangePrinters().Clear();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  MemoryStream stream(input.bytes);
  if (reader.ReadStream(input.file.c_str(), stream) != IFSelect_RetDone)
    throw InputError(input.where, "is damaged: OpenCASCADE cannot make sense of it as STEP");
  const std::string damage = check_loaded(reader, input);
  reader.TransferRoots();
  const TopoDS_Shape shape = reader.OneShape();
  const SolidCount solids = count_solids(reader);
  if (!damage.empty() && (shape.IsNull() || solids.sound == 0 || solids.unsound + solids.missing > 0 ||
                          !BRepCheck_Analyzer(shape).IsValid()))
    throw InputError(input.where, damage_message(damage));
  if (!damage.empty() && options.warn)
    options.warn(
        fmt::format("{} {}; its solids are closed and valid all the same: compare their volume with "
                    "that in the CAD program",
                    input.file, damage_message(damage)));
  if (solids.sound > 0 && solids.missing > 0 && options.warn)
    options.warn(fmt::format("{}: solids that belong to no product are left out: {}, beside {} that are read",
                             input.file, solids.missing, solids.sound));
  return shape;
}

// OpenCASCADE passes over the triangles of AP242 without a word (release 7.7 reads them).
void tell_tessellated(const ImportInput& input, bool all, const ImportOptions& options) {
  const std::string_view text(reinterpret_cast<const char*>(input.bytes.data()), input.bytes.size());
  const auto holds = [&](const char* kind) { return text.find(kind) != std::string_view::npos; };
  constexpr const char* kAdvice =
      "OpenCASCADE " OCC_VERSION_COMPLETE
      " does not read: export the part with its exact geometry (B-rep), or as STL";
  if (all)
    for (const char* kind :
         {"TESSELLATED_SOLID", "TESSELLATED_SHELL", "TRIANGULATED_FACE", "TRIANGULATED_SURFACE_SET"})
      if (holds(kind))
        throw InputError(input.where,
                         fmt::format("holds tessellated geometry only ({}), which {}", kind, kAdvice));
  for (const char* kind : {"TESSELLATED_SOLID", "TESSELLATED_SHELL"})
    if (holds(kind) && options.warn)
      return options.warn(fmt::format("{}: holds tessellated geometry too ({}), which {}; it is left out",
                                      input.file, kind, kAdvice));
}

CadMesh read_solids(ImportInput& input, const ImportOptions& options) {
  STEPControl_Reader reader;
  const TopoDS_Shape shape = transfer(reader, input, options);
  tell_tessellated(input, shape.IsNull(), options);
  const StepNames names(reader);
  return mesh_of(shape, kMillimetre,
                 {[&](const TopoDS_Shape& solid) { return names.solid(solid); },
                  [&](const TopoDS_Shape& face) { return names.own(face); },
                  [&](const TopoDS_Shape& item) { return names.color(item); }},
                 options, input);
}

}  // namespace

Surface read_step(ImportInput& input, const ImportOptions& options) {
  if (options.unit) throw InputError(input.where, "a STEP file carries its own unit: leave out --unit");
  check_step_complete(input);
  return read_with_occt(input, options, source_in_unit("step", kMillimetre),
                        [&](const ImportOptions& heard) { return read_solids(input, heard); });
}

}  // namespace flexel
