// Through a document (XCAF), whose writers take names, colours and layers along. The time in the header is that of the
// source, or none: a run writes the same bytes today and tomorrow.
#include "cad/deform/write_tree.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <HeaderSection_FileName.hxx>
#include <IGESBasic_Name.hxx>
#include <IGESCAFControl_Writer.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPCAFControl_Controller.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StepData_StepModel.hxx>
#include <TCollection_AsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopoDS_Compound.hxx>
#include <TransferBRep.hxx>
#include <TransferBRep_ShapeMapper.hxx>
#include <Transfer_FinderProcess.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_LayerTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <sstream>

#include "base/files/memory_file.h"

namespace flexel::cad {
namespace {

Bytes bytes_of(const std::string& text) {
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

// Puts nodes into a document.
class DocumentWriter {
 public:
  DocumentWriter() {
    XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document_);
    XCAFDoc_ShapeTool::SetAutoNaming(Standard_False);
    shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
    colors_ = XCAFDoc_DocumentTool::ColorTool(document_->Main());
    layers_ = XCAFDoc_DocumentTool::LayerTool(document_->Main());
  }
  void add(const std::vector<CadNode>& roots) {
    for (const CadNode& root : roots) {
      if (root.location.IsIdentity()) {
        add(root);
        continue;
      }
      CadNode holder;  // a root has no place of its own
      holder.name = root.name;
      holder.children.push_back(root);
      add(holder);
    }
    shapes_->UpdateAssemblies();
  }
  [[nodiscard]] const Handle(TDocStd_Document) & document() const { return document_; }

 private:
  TDF_Label add(const CadNode& node) {
    TDF_Label label;
    if (node.children.empty()) {
      label = shapes_->AddShape(node.shape, Standard_False, Standard_False);
      for (const StyledShape& each : node.styled) {
        const TDF_Label part = shapes_->AddSubShape(label, each.shape);
        if (!part.IsNull()) dress(part, each.name, each.style);
      }
    } else {
      label = shapes_->NewShape();
      for (const CadNode& child : node.children) {
        const TDF_Label component = shapes_->AddComponent(label, add(child), child.location);
        dress(component, child.instance_name.IsEmpty() ? name_of(child) : child.instance_name,
              child.instance_style);
      }
    }
    dress(label, name_of(node), node.style);
    return label;
  }
  static TCollection_ExtendedString name_of(const CadNode& node) {
    return node.name.IsEmpty() ? TCollection_ExtendedString("part") : node.name;
  }
  void dress(const TDF_Label& label, const TCollection_ExtendedString& name, const ShapeStyle& style) {
    if (!name.IsEmpty()) TDataStd_Name::Set(label, name);
    for (std::size_t type = 0; type < kColorTypes.size(); ++type)
      if (style.colors[type]) colors_->SetColor(label, *style.colors[type], kColorTypes[type]);
    for (const TCollection_ExtendedString& layer : style.layers) layers_->SetLayer(label, layer);
  }
  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colors_;
  Handle(XCAFDoc_LayerTool) layers_;
};

// What OpenCASCADE calls the schema of a file: AP203, AP214 or AP242.
const char* schema_name(const std::string& schema) {
  if (schema.starts_with("CONFIG_CONTROL_DESIGN")) return "AP203";
  if (schema.starts_with("AP242")) return "AP242DIS";
  return "AP214IS";
}

Bytes write_step(const CadTree& style, const Handle(TDocStd_Document) & document) {
  STEPCAFControl_Controller::Init();  // knows the settings that follow
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  Interface_Static::SetCVal("write.step.schema", schema_name(style.schema));
  Interface_Static::SetCVal("write.step.unit", style.length_unit.empty() ? "MM" : style.length_unit.c_str());
  Interface_Static::SetIVal("write.stepcaf.subshapes.name", 1);
  STEPCAFControl_Writer writer;
  writer.SetColorMode(Standard_True);
  writer.SetNameMode(Standard_True);
  writer.SetLayerMode(Standard_True);
  if (!writer.Transfer(document, STEPControl_AsIs))
    throw Standard_Failure("the shapes cannot be written as STEP");
  APIHeaderSection_MakeHeader header(
      Handle(StepData_StepModel)::DownCast(writer.ChangeWriter().WS()->Model()));
  header.SetTimeStamp(
      new TCollection_HAsciiString(style.time.empty() ? "1970-01-01T00:00:00" : style.time.c_str()));
  header.SetOriginatingSystem(new TCollection_HAsciiString("Flexel"));
  const MemoryFile file;  // it knows names of files only
  if (writer.Write(file.path().c_str()) != IFSelect_RetDone)
    throw Standard_Failure("the STEP file cannot be written");
  return file.bytes();
}

// The names of an IGES file. OpenCASCADE's own writer puts them in the order of their addresses in memory.
class IgesNames {
 public:
  explicit IgesNames(IGESCAFControl_Writer& writer) : writer_(writer) {}

  void write(const Handle(TDocStd_Document) & document) {
    TDF_LabelSequence roots;
    XCAFDoc_DocumentTool::ShapeTool(document->Main())->GetFreeShapes(roots);
    for (Standard_Integer i = 1; i <= roots.Length(); ++i) write(roots(i), TopLoc_Location());
  }

 private:
  void write(const TDF_Label& label, const TopLoc_Location& above) {
    const TopLoc_Location here = above * XCAFDoc_ShapeTool::GetLocation(label);
    TDF_Label product = label;
    if (XCAFDoc_ShapeTool::IsReference(label)) XCAFDoc_ShapeTool::GetReferredShape(label, product);
    name(label, XCAFDoc_ShapeTool::GetShape(product).Moved(here));
    TDF_LabelSequence inside;
    if (XCAFDoc_ShapeTool::IsAssembly(product)) {
      XCAFDoc_ShapeTool::GetComponents(product, inside);
      for (Standard_Integer i = 1; i <= inside.Length(); ++i) write(inside(i), here);
      return;
    }
    XCAFDoc_ShapeTool::GetSubShapes(product, inside);
    for (Standard_Integer i = 1; i <= inside.Length(); ++i)
      name(inside(i), XCAFDoc_ShapeTool::GetShape(inside(i)).Moved(here));
  }
  void name(const TDF_Label& label, const TopoDS_Shape& shape) {
    Handle(TDataStd_Name) found;
    if (shape.IsNull() || !label.FindAttribute(TDataStd_Name::GetID(), found)) return;
    Handle(IGESData_IGESEntity) entity;
    const Handle(Transfer_FinderProcess) process = writer_.TransferProcess();
    const Handle(TransferBRep_ShapeMapper) mapper = TransferBRep::ShapeMapper(process, shape);
    if (!process->FindTypedTransient(mapper, STANDARD_TYPE(IGESData_IGESEntity), entity) || entity->HasName())
      return;
    const Handle(IGESBasic_Name) written = new IGESBasic_Name();
    written->Init(1, new TCollection_HAsciiString(TCollection_AsciiString(found->Get(), '_')));
    entity->AddProperty(written);
    writer_.AddEntity(written);
  }
  IGESCAFControl_Writer& writer_;
};

Bytes write_iges(const Handle(TDocStd_Document) & document) {
  IGESControl_Controller::Init();
  Interface_Static::SetIVal("write.iges.brep.mode", 1);  // solids, not loose faces
  IGESCAFControl_Writer writer;
  writer.SetColorMode(Standard_True);
  writer.SetNameMode(Standard_False);
  writer.SetLayerMode(Standard_True);
  if (!writer.Transfer(document)) throw Standard_Failure("the shapes cannot be written as IGES");
  IgesNames(writer).write(document);
  std::ostringstream out;
  writer.ComputeModel();
  IGESData_GlobalSection global = writer.Model()->GlobalSection();
  const Handle(TCollection_HAsciiString) date = new TCollection_HAsciiString("19700101.000000");
  global.SetDate(date);
  global.SetLastChangeDate(date);
  writer.Model()->SetGlobalSection(global);
  if (!writer.Write(out)) throw Standard_Failure("the IGES file cannot be written");
  return bytes_of(out.str());
}

void collect(const std::vector<CadNode>& nodes, const TopLoc_Location& above,
             std::vector<TopoDS_Shape>& shapes) {
  for (const CadNode& node : nodes) {
    const TopLoc_Location here = above * node.location;
    collect(node.children, here, shapes);
    if (!node.shape.IsNull()) shapes.push_back(node.shape.Moved(here));
  }
}

Bytes write_brep(const std::vector<CadTree>& trees) {
  std::vector<TopoDS_Shape> shapes;
  for (const CadTree& tree : trees) collect(tree.roots, TopLoc_Location(), shapes);
  TopoDS_Shape all = shapes.front();
  if (shapes.size() > 1) {
    TopoDS_Compound compound;
    BRep_Builder builder;
    builder.MakeCompound(compound);
    for (const TopoDS_Shape& shape : shapes) builder.Add(compound, shape);
    all = compound;
  }
  std::ostringstream out;
  BRepTools::Write(all, out);
  return bytes_of(out.str());
}

}  // namespace

Bytes write_tree(const std::vector<CadTree>& trees, const std::string& format) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  if (format == "brep") return write_brep(trees);
  DocumentWriter writer;
  for (const CadTree& tree : trees) writer.add(tree.roots);
  return format == "iges" ? write_iges(writer.document()) : write_step(trees.front(), writer.document());
}

}  // namespace flexel::cad
