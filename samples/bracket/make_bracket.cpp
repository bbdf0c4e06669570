// Writes the sample part: an L-bracket of 80 x 40 x 60 mm, 6 mm thick, with a fillet in its corner and two
// bolt holes in its wall leg, as STEP in mm; or, by the file's extension, as IGES or as BREP.
//
//     make_bracket bracket.step
//     make_bracket bracket.igs
//     make_bracket bracket.brep
//
// The outline is extruded along y and drilled along x. Boolean operations leave the faces in an order of
// their own, so the solid is put together again from the same faces in the order below; that is their
// numbering ("bracket/1" is the wall side), and each carries its name.
#include <fmt/format.h>

#include <BRepAdaptor_Surface.hxx>
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <GProp_GProps.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Writer.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <StepShape_AdvancedFace.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/arguments.h"
#include "base/program/program.h"

namespace {

// All in mm. x leads away from the wall, z up.
constexpr double kReach = 80, kWidth = 40, kHeight = 60, kThickness = 6, kFillet = 8, kHoleRadius = 4.5;
constexpr double kHoleHeight = 40;
constexpr std::array<double, 2> kHoleSides = {12, 28};

// Outline in the plane y = 0, round the bracket: under the seat, up the tip, along the seat, the fillet, up
// the wall leg, back.
TopoDS_Face outline() {
  const gp_Pnt corner(0, 0, 0), tip_low(kReach, 0, 0), tip_high(kReach, 0, kThickness);
  const gp_Pnt fillet_low(kThickness + kFillet, 0, kThickness),
      fillet_high(kThickness, 0, kThickness + kFillet);
  const gp_Pnt front(kThickness, 0, kHeight), back(0, 0, kHeight);
  const double inward = kFillet * (1 - std::sqrt(0.5));
  const gp_Pnt fillet_middle(kThickness + inward, 0, kThickness + inward);
  BRepBuilderAPI_MakeWire wire;
  wire.Add(BRepBuilderAPI_MakeEdge(corner, tip_low));
  wire.Add(BRepBuilderAPI_MakeEdge(tip_low, tip_high));
  wire.Add(BRepBuilderAPI_MakeEdge(tip_high, fillet_low));
  wire.Add(BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(fillet_low, fillet_middle, fillet_high).Value()));
  wire.Add(BRepBuilderAPI_MakeEdge(fillet_high, front));
  wire.Add(BRepBuilderAPI_MakeEdge(front, back));
  wire.Add(BRepBuilderAPI_MakeEdge(back, corner));
  return BRepBuilderAPI_MakeFace(wire.Wire());
}

TopoDS_Shape drilled_bracket() {
  TopoDS_Shape bracket = BRepPrimAPI_MakePrism(outline(), gp_Vec(0, kWidth, 0));
  for (const double side : kHoleSides) {
    const gp_Ax2 axis(gp_Pnt(-1, side, kHoleHeight), gp_Dir(1, 0, 0));
    bracket = BRepAlgoAPI_Cut(bracket, BRepPrimAPI_MakeCylinder(axis, kHoleRadius, kThickness + 2));
  }
  return bracket;
}

gp_Pnt centre(const TopoDS_Shape& face) {
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(face, properties);
  return properties.CentreOfMass();
}

struct NamedFace {
  TopoDS_Face face;
  int rank = 0;  // place in the order of faces
  std::string name;
};

NamedFace identify(const TopoDS_Face& face) {
  const gp_Pnt at = centre(face);
  const auto near = [](double a, double b) { return std::abs(a - b) < 1e-6; };
  const BRepAdaptor_Surface surface(face);
  if (surface.GetType() == GeomAbs_Cylinder) {
    if (near(surface.Cylinder().Radius(), kFillet)) return {face, 4, "fillet"};
    return near(at.Y(), kHoleSides[0]) ? NamedFace{face, 10, "left hole"} : NamedFace{face, 11, "right hole"};
  }
  if (near(at.X(), 0)) return {face, 1, "wall side"};
  if (near(at.X(), kReach)) return {face, 2, "tip"};
  if (near(at.Y(), 0)) return {face, 8, "left side"};
  if (near(at.Y(), kWidth)) return {face, 9, "right side"};
  if (near(at.Z(), kHeight)) return {face, 6, "top"};
  if (near(at.Z(), 0)) return {face, 7, "underside"};
  if (near(at.X(), kThickness)) return {face, 5, "front"};
  return {face, 3, "seat"};
}

std::vector<NamedFace> ordered_faces(const TopoDS_Shape& shape) {
  std::vector<NamedFace> faces;
  for (TopExp_Explorer explorer(shape, TopAbs_FACE); explorer.More(); explorer.Next())
    faces.push_back(identify(TopoDS::Face(explorer.Current())));
  std::sort(faces.begin(), faces.end(),
            [](const NamedFace& a, const NamedFace& b) { return a.rank < b.rank; });
  return faces;
}

TopoDS_Solid solid_of(const std::vector<NamedFace>& faces) {
  const BRep_Builder builder;
  TopoDS_Shell shell;
  builder.MakeShell(shell);
  for (const NamedFace& named : faces) builder.Add(shell, named.face);
  shell.Closed(Standard_True);
  TopoDS_Solid solid;
  builder.MakeSolid(solid);
  builder.Add(solid, shell);
  return solid;
}

// Names the product and, in the order they were written, the faces.
void set_names(const Handle(Interface_InterfaceModel) & model, const std::vector<NamedFace>& faces) {
  const auto text = [](const std::string& name) { return new TCollection_HAsciiString(name.c_str()); };
  std::size_t next_face = 0;
  for (Standard_Integer i = 1; i <= model->NbEntities(); ++i) {
    const Handle(StepBasic_Product) product = Handle(StepBasic_Product)::DownCast(model->Value(i));
    if (!product.IsNull()) {
      product->SetId(text("bracket"));
      product->SetName(text("bracket"));
    }
    const Handle(StepShape_AdvancedFace) face = Handle(StepShape_AdvancedFace)::DownCast(model->Value(i));
    if (!face.IsNull()) face->SetName(text(faces.at(next_face++).name));
  }
}

std::string step_text(const std::vector<NamedFace>& faces) {
  STEPControl_Writer writer;
  // OpenCASCADE reports on stdout.
  Message::DefaultMessenger()->ChangePrinters().Clear();
  Interface_Static::SetCVal("write.step.unit", "MM");
  if (writer.Transfer(solid_of(faces), STEPControl_ManifoldSolidBrep) != IFSelect_RetDone)
    throw std::runtime_error("OpenCASCADE could not turn the bracket into STEP");
  set_names(writer.WS()->Model(), faces);
  std::ostringstream text;
  StepData_StepWriter lines(Handle(StepData_StepModel)::DownCast(writer.WS()->Model()));
  lines.SendModel(Handle(StepData_Protocol)::DownCast(writer.WS()->Protocol()));
  if (!lines.Print(text)) throw std::runtime_error("OpenCASCADE could not write the bracket");
  return text.str();
}

std::string iges_text(const std::vector<NamedFace>& faces) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  IGESControl_Controller::Init();
  IGESControl_Writer writer("MM", 1);
  std::ostringstream text;
  if (!writer.AddShape(solid_of(faces)) || !writer.Write(text))
    throw std::runtime_error("OpenCASCADE could not write the bracket");
  return text.str();
}

std::string brep_text(const std::vector<NamedFace>& faces) {
  std::ostringstream text;
  BRepTools::Write(solid_of(faces), text);
  return text.str();
}

std::string text_for(const std::string& path) {
  const std::vector<NamedFace> faces = ordered_faces(drilled_bracket());
  const std::string extension = flexel::extension(path);
  if (extension == "igs" || extension == "iges") return iges_text(faces);
  if (extension == "brep") return brep_text(faces);
  return step_text(faces);
}

int make_bracket(int argc, char** argv) {
  flexel::CommandLine app{"Writes the sample bracket as STEP, IGES or BREP"};
  std::string path;
  app.add_option("FILE", path, "where to write it (\"-\": stdout)").required();
  if (!flexel::parse_arguments(app, argc, argv)) return flexel::kExitDone;
  flexel::OutputFile out(path, false);
  out.write(text_for(path));
  out.commit();
  return flexel::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return flexel::run_program("make_bracket", [&] { return make_bracket(argc, argv); });
}
