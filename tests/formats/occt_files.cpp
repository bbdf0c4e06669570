#include "tests/formats/occt_files.h"

#ifdef FLEXEL_STEP

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepTools.hxx>
#include <BinTools.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Pnt.hxx>

namespace flexel::test {
namespace {

TopoDS_Shape solid_bracket() {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  const TopoDS_Shape block = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(40, 30, 20)).Shape();
  const TopoDS_Shape room = BRepPrimAPI_MakeBox(gp_Pnt(10, 10, -1), gp_Pnt(41, 31, 21)).Shape();
  return TopExp_Explorer(BRepAlgoAPI_Cut(block, room).Shape(), TopAbs_SOLID).Current();
}

}  // namespace

void write_bracket_iges(const std::string& path, bool solid, const char* unit) {
  IGESControl_Controller::Init();
  const TopoDS_Shape bracket = solid_bracket();
  IGESControl_Writer writer(unit, solid ? 1 : 0);
  writer.AddShape(bracket);
  writer.ComputeModel();
  writer.Write(path.c_str());
}

void write_bracket_brep(const std::string& path, bool binary) {
  if (binary)
    BinTools::Write(solid_bracket(), path.c_str());
  else
    BRepTools::Write(solid_bracket(), path.c_str());
}

void write_ball_brep(const std::string& path) {
  BRepTools::Write(BRepPrimAPI_MakeSphere(10).Shape(), path.c_str());
}

void write_bracket_step(const std::string& path, const char* unit) {
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", unit);
  STEPControl_Writer writer;
  writer.Transfer(solid_bracket(), STEPControl_AsIs);
  writer.Write(path.c_str());
  Interface_Static::SetCVal("write.step.unit", "MM");
}

}  // namespace flexel::test

#endif
