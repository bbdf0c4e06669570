// IGES through OpenCASCADE. Most files hold no solids but the trimmed surfaces of one; those are sewn along
// their edges first, at the smallest of a few tolerances that leaves no edge free, and the closed shells
// are taken as solids. Names, colours and levels are those of the entities.
#include <fmt/format.h>

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <Bnd_Box.hxx>
#include <IGESCAFControl.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Reader.hxx>
#include <IGESData_ColorEntity.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESGraph_Color.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/files/memory_file.h"
#include "cad/read/occt.h"
#include "cad/read/tells_share.h"
#include "formats/common/readers.h"

namespace flexel::cad {
namespace {

// The last line has a T in column 73; the first is one of the start section.
void check_iges_complete(const CadReadJob& job) {
  constexpr std::size_t kLetter = 72;
  std::string_view text(reinterpret_cast<const char*>(job.bytes.data()), job.bytes.size());
  if (text.size() <= kLetter || text[kLetter] != 'S')
    throw InputError(job.where, "is no IGES file: its first line does not have an S in column 73");
  while (!text.empty() &&
         (text.back() == '\n' || text.back() == '\r' || text.back() == ' ' || text.back() == '\0'))
    text.remove_suffix(1);
  const std::size_t line = text.rfind('\n') + 1;
  if (text.size() - line <= kLetter || text[line + kLetter] != 'T')
    throw InputError(job.where, "is cut off: an IGES file ends with a line that has a T in column 73");
}

// What an entity says of its shape.
struct Look {
  std::string name, layer;  // the layer is the number of the level; "": none
  std::optional<ShapeColor> color;
};
using Looks = std::map<const void*, Look>;  // by the TShape

std::optional<ShapeColor> color_of(const IGESData_IGESEntity& entity) {
  ShapeColor color{};
  if (entity.DefColor() == IGESData_DefReference) {
    const Handle(IGESGraph_Color) own = Handle(IGESGraph_Color)::DownCast(entity.Color());
    if (own.IsNull()) return std::nullopt;
    own->RGBIntensity(color[0], color[1], color[2]);
    for (double& value : color) value = std::isfinite(value) ? std::clamp(value / 100, 0.0, 1.0) : 1;
    return color;
  }
  if (entity.RankColor() <= 0) return std::nullopt;
  IGESCAFControl::DecodeColor(entity.RankColor()).Values(color[0], color[1], color[2], Quantity_TOC_sRGB);
  return color;
}

Looks looks_in(const IGESControl_Reader& reader) {
  Looks looks;
  const Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  for (Standard_Integer i = 1; i <= process->NbMapped(); ++i) {
    const Handle(IGESData_IGESEntity) entity = Handle(IGESData_IGESEntity)::DownCast(process->Mapped(i));
    if (entity.IsNull()) continue;
    Look look{"", "", color_of(*entity)};
    if (entity->HasName() && !entity->NameValue().IsNull())
      look.name = clean_name(entity->NameValue()->ToCString());
    if (entity->DefLevel() == IGESData_DefOne && entity->Level() > 0)
      look.layer = fmt::format("{}", entity->Level());
    if (look.name.empty() && look.layer.empty() && !look.color) continue;
    const TopoDS_Shape shape = TransferBRep::ShapeResult(process, entity);
    if (!shape.IsNull()) looks.emplace(shape.TShape().get(), look);
  }
  return looks;
}

std::size_t count(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind) {
  std::size_t found = 0;
  for (TopExp_Explorer explorer(shape, kind); explorer.More(); explorer.Next()) ++found;
  return found;
}

// The faces joined to shells, with the looks of the faces that they came from.
TopoDS_Shape sewn(const TopoDS_Shape& shape, Looks& looks) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box, Standard_False);
  const double diagonal = box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
  TopoDS_Shape result = shape;
  for (const double share : {1e-7, 1e-6, 1e-5, 1e-4}) {
    BRepBuilderAPI_Sewing sewing(share * diagonal);
    for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) sewing.Add(face.Current());
    sewing.Perform();
    result = sewing.SewedShape();
    if (sewing.NbFreeEdges() > 0 && share < 1e-4) continue;
    for (TopExp_Explorer face(shape, TopAbs_FACE); face.More(); face.Next()) {
      const auto look = looks.find(face.Current().TShape().get());
      if (look != looks.end() && sewing.IsModifiedSubShape(face.Current()))
        looks.emplace(sewing.ModifiedSubShape(face.Current()).TShape().get(), look->second);
    }
    break;
  }
  return result;
}

CadShape read_entities(const std::string& path, const CadReadJob& job) {
  Message::DefaultMessenger()->ChangePrinters().Clear();  // stdout belongs to the result
  IGESControl_Controller::Init();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  IGESControl_Reader reader;
  reader.SetReadVisible(Standard_False);
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone)
    throw InputError(job.where, "is damaged: OpenCASCADE cannot make sense of it as IGES");
  constexpr double kLoaded = .3, kTransferred = .7;  // of the time
  tell_share(kLoaded);
  {
    const ShareScope transferring(kLoaded, kTransferred);
    reader.TransferRoots(TellsShare::begin()->Start());
  }
  TopoDS_Shape shape = reader.OneShape();
  if (shape.IsNull()) throw InputError(job.where, "holds no shape");
  const auto looks = std::make_shared<Looks>(looks_in(reader));
  if (count(shape, TopAbs_SOLID) == 0) {
    if (count(shape, TopAbs_FACE) == 0)
      throw InputError(job.where, "holds curves or points but no faces: export the part as a solid");
    shape = sewn(shape, *looks);
  }
  const auto look = [looks](const TopoDS_Shape& item) {
    const auto found = looks->find(item.TShape().get());
    return found == looks->end() ? Look() : found->second;
  };
  const auto name = [look](const TopoDS_Shape& item) { return look(item).name; };
  return {std::make_shared<TopoDS_Shape>(shape),
          kMillimetre,
          {name, name, [](const TopoDS_Shape&) { return std::string(); },
           [look](const TopoDS_Shape& item) { return look(item).color; },
           [look](const TopoDS_Shape& item) { return look(item).layer; }}};
}

}  // namespace

CadShape read_iges(const CadReadJob& job) {
  check_iges_complete(job);
  const MemoryFile file(job.bytes);  // OpenCASCADE reads IGES from files only
  return read_entities(file.path(), job);
}

}  // namespace flexel::cad
