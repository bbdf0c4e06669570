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
#include "cad/read/memory_stream.h"
#include "cad/read/occt.h"
#include "cad/read/step_names.h"
#include "cad/read/step_reader.h"
#include "cad/read/tells_share.h"

namespace flexel::cad {
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

// The first failure that matters; "" for none. Creo leaves out the dimensions of degrees (NAMED_UNIT(*)), which nobody
// needs to convert them.
std::string failure_of(const Interface_Check& check, bool unit) {
  for (Standard_Integer i = 1; i <= check.NbFails(); ++i) {
    const std::string_view text = check.CFail(i);
    if (!unit || text.find("(dimensions)") == std::string_view::npos) return std::string(text);
  }
  return "";
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
void check_references(const Handle(Interface_InterfaceModel) & model, const CadReadJob& job) {
  const Handle(Interface_Check) check = model->GlobalCheck();
  const auto examine = [&](Standard_CString message) {
    const std::string label = label_in(message);
    const Standard_Integer number = label.empty() ? 0 : model->NextNumberForLabel(label.c_str());
    if (number > 0 && (is_geometry(model->Value(number)) || is_unit(model->Value(number))))
      throw InputError(job.where, damage_message(message));
  };
  for (Standard_Integer i = 1; i <= check->NbFails(); ++i) examine(check->CFail(i));
  for (Standard_Integer i = 1; i <= check->NbWarnings(); ++i) examine(check->CWarning(i));
}

// OpenCASCADE loads what it can and later follows missing references. So a file with missing references is
// refused, and one whose solids or representations did not load. Returns what did not load of their geometry,
// "" for nothing. Damage elsewhere in the file (drawings, tolerances, colours) is ignored.
std::string check_loaded(const STEPControl_Reader& reader, const CadReadJob& job) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  check_references(model, job);
  std::string damage;
  const Interface_CheckIterator checks = reader.WS()->ModelCheckList(Standard_False);
  for (checks.Start(); checks.More(); checks.Next()) {
    if (!checks.Value()->HasFailed() || checks.Number() < 1) continue;
    const Handle(Standard_Transient) entity = model->Value(checks.Number());
    if (!is_geometry(entity) && !is_unit(entity)) continue;
    const std::string failure = failure_of(*checks.Value(), is_unit(entity));
    if (failure.empty()) continue;
    const std::string found = fmt::format("{}: {}", model->StringLabel(entity)->ToCString(), failure);
    if (!entity->IsKind(STANDARD_TYPE(StepGeom_GeometricRepresentationItem)) ||
        entity->IsKind(STANDARD_TYPE(StepShape_SolidModel)))
      throw InputError(job.where, damage_message(found));
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

void check_step_complete(const CadReadJob& job) {
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  if (text.rfind("END-ISO-10303-21") == std::string_view::npos)
    throw InputError(job.where, text.find("ISO-10303-21") == std::string_view::npos
                                    ? "is no STEP file: it does not begin with ISO-10303-21"
                                    : "is cut off: a STEP file ends with END-ISO-10303-21");
}

}  // namespace

TopoDS_Shape transfer_step(STEPControl_Reader& reader, const CadReadJob& job, const Warn& warn,
                           const std::function<void()>& transfer_roots) {
  check_step_complete(job);
  // OpenCASCADE reports on stdout, which belongs to the result.
  Message::DefaultMessenger()->ChangePrinters().Clear();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  MemoryStream stream(job.bytes);
  if (reader.ReadStream(job.file.c_str(), stream) != IFSelect_RetDone)
    throw InputError(job.where, "is damaged: OpenCASCADE cannot make sense of it as STEP");
  constexpr double kLoaded = .3, kTransferred = .9;  // of the time
  tell_share(kLoaded);
  const std::string damage = check_loaded(reader, job);
  {
    const ShareScope transferring(kLoaded, kTransferred);
    transfer_roots();
  }
  const TopoDS_Shape shape = reader.OneShape();
  const SolidCount solids = count_solids(reader);
  if (!damage.empty() && (shape.IsNull() || solids.sound == 0 || solids.unsound + solids.missing > 0 ||
                          !BRepCheck_Analyzer(shape).IsValid()))
    throw InputError(job.where, damage_message(damage));
  if (!damage.empty() && warn)
    warn(
        fmt::format("{} {}; its solids are closed and valid all the same: compare their volume with "
                    "that in the CAD program",
                    job.file, damage_message(damage)));
  if (solids.sound > 0 && solids.missing > 0 && warn)
    warn(fmt::format("{}: solids that belong to no product are left out: {}, beside {} that are read",
                     job.file, solids.missing, solids.sound));
  return shape;
}

namespace {

// OpenCASCADE passes over the triangles of AP242 without a word (release 7.7 reads them).
void tell_tessellated(const CadReadJob& job, bool all, const Warn& warn) {
  const std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  const auto holds = [&](const char* kind) { return text.find(kind) != std::string_view::npos; };
  constexpr const char* kAdvice =
      "OpenCASCADE " OCC_VERSION_COMPLETE
      " does not read: export the part with its exact geometry (B-rep), or as STL";
  if (all)
    for (const char* kind :
         {"TESSELLATED_SOLID", "TESSELLATED_SHELL", "TRIANGULATED_FACE", "TRIANGULATED_SURFACE_SET"})
      if (holds(kind))
        throw InputError(job.where,
                         fmt::format("holds tessellated geometry only ({}), which {}", kind, kAdvice));
  for (const char* kind : {"TESSELLATED_SOLID", "TESSELLATED_SHELL"})
    if (holds(kind) && warn)
      return warn(fmt::format("{}: holds tessellated geometry too ({}), which {}; it is left out", job.file,
                              kind, kAdvice));
}

}  // namespace

CadShape read_step(const CadReadJob& job, const Warn& warn) {
  STEPControl_Reader reader;
  CadShape result;
  result.shape = std::make_shared<TopoDS_Shape>(
      transfer_step(reader, job, warn, [&] { reader.TransferRoots(TellsShare::begin()->Start()); }));
  result.unit = kMillimetre;
  tell_tessellated(job, result.shape->IsNull(), warn);
  const auto names = std::make_shared<StepNames>(reader);
  result.labels = {[names](const TopoDS_Shape& solid) { return names->solid(solid); },
                   [names](const TopoDS_Shape& face) { return names->own(face); },
                   [names](const TopoDS_Shape& compound) { return names->assembly(compound); },
                   [names](const TopoDS_Shape& item) { return names->color(item); }};
  return result;
}

}  // namespace flexel::cad
