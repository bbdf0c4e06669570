// Writes an assembly as STEP for tests/programs/cad_chain_test.py: OpenCASCADE's own writer, nothing of ours.
//
//     make_assembly FILE MM|INCH|M AP203|AP214IS|AP242DIS
//
// "clamp" (80 x 40 mm): a "plate" with a green face called "seat", on layer "structure", blue; a "corner", an eighth of a
// ball whose pole is a corner of its face; and twice the assembly "bolt group", a "bolt" (red, layer "fasteners") on a
// "washer", the second use turned by 30 degrees. They touch where they meet.
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <TDF_Label.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_LayerTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <cmath>
#include <cstdio>
#include <string>

namespace {

constexpr double kThickness = 8, kWasher = 2;  // mm

class Clamp {
 public:
  Clamp() {
    XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document_);
    XCAFDoc_ShapeTool::SetAutoNaming(Standard_False);
    shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
    colors_ = XCAFDoc_DocumentTool::ColorTool(document_->Main());
    layers_ = XCAFDoc_DocumentTool::LayerTool(document_->Main());
    const TDF_Label clamp = assembly("clamp");
    use(clamp, plate(), at(0, 0, 0));
    use(clamp, part("corner", BRepPrimAPI_MakeSphere(10, 0, M_PI / 2, M_PI / 2).Shape(), "", nullptr),
        at(35, 15, kThickness));
    const Quantity_Color red(1, 0, 0, Quantity_TOC_RGB);
    const TDF_Label bolt = part("bolt", BRepPrimAPI_MakeCylinder(4, 20).Shape(), "fasteners", &red),
                    washer = part("washer", BRepPrimAPI_MakeCylinder(7, kWasher).Shape(), "", nullptr);
    const TDF_Label group = assembly("bolt group");
    use(group, washer, at(0, 0, 0));
    use(group, bolt, at(0, 0, kWasher));
    use(clamp, group, at(12, 20, kThickness));
    gp_Trsf turned;
    turned.SetRotation(gp::OZ(), M_PI / 6);
    turned.SetTranslationPart(gp_Vec(68, 20, kThickness));
    use(clamp, group, turned);
    shapes_->UpdateAssemblies();
  }
  [[nodiscard]] const Handle(TDocStd_Document) & document() const { return document_; }

 private:
  static gp_Trsf at(double x, double y, double z) {
    gp_Trsf shift;
    shift.SetTranslation(gp_Vec(x, y, z));
    return shift;
  }
  TDF_Label assembly(const char* name) {
    const TDF_Label label = shapes_->NewShape();
    TDataStd_Name::Set(label, name);
    return label;
  }
  void use(const TDF_Label& in, const TDF_Label& what, const gp_Trsf& where) {
    shapes_->AddComponent(in, what, TopLoc_Location(where));
  }
  TDF_Label part(const char* name, const TopoDS_Shape& shape, const char* layer,
                 const Quantity_Color* color) {
    const TDF_Label label = shapes_->AddShape(shape, Standard_False, Standard_False);
    TDataStd_Name::Set(label, name);
    if (*layer != '\0') layers_->SetLayer(label, TCollection_ExtendedString(layer));
    if (color != nullptr) colors_->SetColor(label, *color, XCAFDoc_ColorSurf);
    return label;
  }
  TDF_Label plate() {
    const TopoDS_Shape box = BRepPrimAPI_MakeBox(80, 40, kThickness).Shape();
    const Quantity_Color blue(0, 0, 1, Quantity_TOC_RGB), green(0, 1, 0, Quantity_TOC_RGB);
    const TDF_Label label = part("plate", box, "structure", &blue);
    TopTools_IndexedMapOfShape faces;
    TopExp::MapShapes(box, TopAbs_FACE, faces);
    const TDF_Label seat = shapes_->AddSubShape(label, faces(6));  // zmax
    TDataStd_Name::Set(seat, "seat");
    colors_->SetColor(seat, green, XCAFDoc_ColorSurf);
    return label;
  }

  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colors_;
  Handle(XCAFDoc_LayerTool) layers_;
};

}  // namespace

int main(int count, char** words) {
  if (count != 4) {
    std::fputs("make_assembly FILE MM|INCH|M AP203|AP214IS|AP242DIS\n", stderr);
    return 2;
  }
  Message::DefaultMessenger()->ChangePrinters().Clear();
  STEPCAFControl_Controller::Init();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  Interface_Static::SetCVal("write.step.unit", words[2]);
  Interface_Static::SetCVal("write.step.schema", words[3]);
  Interface_Static::SetIVal("write.stepcaf.subshapes.name", 1);
  const Clamp clamp;
  STEPCAFControl_Writer writer;
  writer.SetColorMode(Standard_True);
  writer.SetNameMode(Standard_True);
  writer.SetLayerMode(Standard_True);
  const bool written =
      writer.Transfer(clamp.document(), STEPControl_AsIs) && writer.Write(words[1]) == IFSelect_RetDone;
  if (!written) std::fprintf(stderr, "%s cannot be written\n", words[1]);
  return written ? 0 : 1;
}
