// The dimples are cut one after the other; they do not meet.
#include "bench/import/step_part.h"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Writer.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Ax2.hxx>
#include <stdexcept>

namespace flexel {

void write_dimpled_block(const std::string& path) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  TopoDS_Shape block = BRepPrimAPI_MakeBox(gp_Pnt(-20, 0, 0), gp_Pnt(140, 80, 20)).Shape();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 4; ++j)
      block = BRepAlgoAPI_Cut(block, BRepPrimAPI_MakeSphere(gp_Pnt(10 + 20 * i, 10 + 20 * j, 22), 9).Shape());
  for (const double x : {-10., 130.})
    block = BRepAlgoAPI_Cut(
        block, BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, 40, -1), gp_Dir(0, 0, 1)), 6, 22).Shape());
  STEPControl_Writer writer;
  writer.Transfer(TopExp_Explorer(block, TopAbs_SOLID).Current(), STEPControl_AsIs);
  if (writer.Write(path.c_str()) != IFSelect_RetDone) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace flexel
