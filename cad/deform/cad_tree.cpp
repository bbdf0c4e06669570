// STEP keeps its tree in OpenCASCADE's document (XCAF); IGES and BREP files are one node.
#include "cad/deform/cad_tree.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRep_Builder.hxx>
#include <HeaderSection_FileName.hxx>
#include <HeaderSection_FileSchema.hxx>
#include <Interface_Static.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <StepData_StepModel.hxx>
#include <TColStd_HSequenceOfExtendedString.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_MapOfShape.hxx>
#include <TopoDS_Compound.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_GraphNode.hxx>
#include <XCAFDoc_LayerTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "cad/read/step_reader.h"

namespace flexel::cad {
namespace {

TCollection_ExtendedString name_of(const TDF_Label& label) {
  Handle(TDataStd_Name) name;
  return label.FindAttribute(TDataStd_Name::GetID(), name) ? name->Get() : TCollection_ExtendedString();
}

ShapeStyle overridden(ShapeStyle style, const ShapeStyle& by) {
  for (std::size_t type = 0; type < style.colors.size(); ++type)
    if (by.colors[type]) style.colors[type] = by.colors[type];
  style.layers.insert(style.layers.end(), by.layers.begin(), by.layers.end());
  return style;
}

// Reads the labels of a document.
class DocumentReader {
 public:
  explicit DocumentReader(const Handle(TDocStd_Document) & document)
      : shapes_(XCAFDoc_DocumentTool::ShapeTool(document->Main())),
        colors_(XCAFDoc_DocumentTool::ColorTool(document->Main())),
        layers_(XCAFDoc_DocumentTool::LayerTool(document->Main())) {}

  [[nodiscard]] std::vector<CadNode> roots() const {
    TDF_LabelSequence free;
    shapes_->GetFreeShapes(free);
    std::vector<CadNode> nodes;
    for (Standard_Integer i = 1; i <= free.Length(); ++i) nodes.push_back(node(free(i), {}));
    return nodes;
  }

 private:
  [[nodiscard]] ShapeStyle style(const TDF_Label& label) const {
    ShapeStyle found;
    for (std::size_t type = 0; type < kColorTypes.size(); ++type)
      if (Quantity_ColorRGBA color; colors_->GetColor(label, kColorTypes[type], color))
        found.colors[type] = color;
    Handle(TColStd_HSequenceOfExtendedString) names;
    if (layers_->GetLayers(label, names) && !names.IsNull())
      for (Standard_Integer i = 1; i <= names->Length(); ++i) found.layers.push_back(names->Value(i));
    return found;
  }

  // What an assembly says of one use in another assembly inside it (a "specified higher usage occurrence"): `uses`, from
  // the outermost. That of the outermost assembly goes first.
  [[nodiscard]] ShapeStyle style_from_above(const std::vector<TDF_Label>& uses) const {
    for (std::size_t first = 0; first + 1 < uses.size(); ++first) {
      TDF_LabelSequence path;
      for (std::size_t i = first; i < uses.size(); ++i) path.Append(uses[i]);
      if (Handle(XCAFDoc_GraphNode) found; XCAFDoc_ShapeTool::FindSHUO(path, found) && !found.IsNull())
        return style(found->Label());
    }
    return {};
  }

  // Of a product, or of its use in an assembly; `uses`: of the assemblies above it, from the outermost.
  [[nodiscard]] CadNode node(const TDF_Label& label, std::vector<TDF_Label> uses) const {
    CadNode found;
    TDF_Label product = label;
    if (XCAFDoc_ShapeTool::IsReference(label)) {
      found.location = XCAFDoc_ShapeTool::GetLocation(label);
      found.instance_name = name_of(label);
      uses.push_back(label);
      found.instance_style = overridden(style(label), style_from_above(uses));
      XCAFDoc_ShapeTool::GetReferredShape(label, product);
    }
    found.name = name_of(product);
    found.style = style(product);
    if (XCAFDoc_ShapeTool::IsAssembly(product)) {
      TDF_LabelSequence components;
      XCAFDoc_ShapeTool::GetComponents(product, components);
      for (Standard_Integer i = 1; i <= components.Length(); ++i)
        found.children.push_back(node(components(i), uses));
      return found;
    }
    found.shape = XCAFDoc_ShapeTool::GetShape(product);
    TDF_LabelSequence parts;
    XCAFDoc_ShapeTool::GetSubShapes(product, parts);
    for (Standard_Integer i = 1; i <= parts.Length(); ++i)
      found.styled.push_back({XCAFDoc_ShapeTool::GetShape(parts(i)), name_of(parts(i)), style(parts(i))});
    return found;
  }

  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colors_;
  Handle(XCAFDoc_LayerTool) layers_;
};

// What writing calls the unit of a file's lengths; "MM" for one that it has no name for.
std::string length_unit(STEPControl_Reader& reader) {
  static const std::map<std::string, std::string> kNames = {
      {"metre", "M"},       {"meter", "M"},       {"millimetre", "MM"}, {"millimeter", "MM"},
      {"centimetre", "CM"}, {"centimeter", "CM"}, {"inch", "INCH"},     {"foot", "FT"},
      {"micrometre", "UM"}, {"kilometre", "KM"}};
  TColStd_SequenceOfAsciiString lengths, angles, solid_angles;
  reader.FileUnits(lengths, angles, solid_angles);
  if (lengths.IsEmpty()) return "MM";
  std::string name = lengths.First().ToCString();
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto found = kNames.find(name);
  return found == kNames.end() ? "MM" : found->second;
}

std::string text_of(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? "" : text->ToCString();
}

// What of a shape is in no solid: loose faces, edges in no face. Null: nothing.
TopoDS_Shape loose_of(const TopoDS_Shape& shape) {
  TopoDS_Compound loose;
  BRep_Builder builder;
  builder.MakeCompound(loose);
  bool any = false;
  for (const auto& [kind, avoid] :
       {std::pair(TopAbs_FACE, TopAbs_SOLID), std::pair(TopAbs_EDGE, TopAbs_FACE)})
    for (TopExp_Explorer each(shape, kind, avoid); each.More(); each.Next()) {
      builder.Add(loose, each.Current());
      any = true;
    }
  return any ? TopoDS_Shape(loose) : TopoDS_Shape();
}

// Several solids of one shape at different places cannot be deformed apart: they become children of their own.
void part_repeated(CadNode& node) {
  TopTools_MapOfShape seen;
  bool repeated = false;
  std::vector<TopoDS_Shape> solids;
  for (TopExp_Explorer each(node.shape, TopAbs_SOLID); each.More(); each.Next()) {
    solids.push_back(each.Current());
    repeated = !seen.Add(each.Current().Located(TopLoc_Location())) || repeated;
  }
  if (!repeated) return;
  for (const TopoDS_Shape& solid : solids) {
    CadNode child;
    child.location = solid.Location();
    child.shape = solid.Located(TopLoc_Location());
    child.name = node.name;
    child.style = node.style;
    TopTools_IndexedMapOfShape parts;
    TopExp::MapShapes(child.shape, parts);
    for (const StyledShape& styled : node.styled)
      for (Standard_Integer i = 1; i <= parts.Extent(); ++i)
        if (parts(i).TShape() == styled.shape.TShape())
          child.styled.push_back({parts(i), styled.name, styled.style});
    node.children.push_back(std::move(child));
  }
  if (const TopoDS_Shape loose = loose_of(node.shape); !loose.IsNull()) {
    CadNode child;
    child.shape = loose;
    child.name = node.name;
    node.children.push_back(std::move(child));
  }
  node.shape.Nullify();
  node.styled.clear();
}

void part_repeated(std::vector<CadNode>& nodes) {
  for (CadNode& node : nodes)
    if (node.children.empty())
      part_repeated(node);
    else
      part_repeated(node.children);
}

// Which solids of the file the nodes hold: those of the same shape, nearest in place, each once.
class SolidFinder {
 public:
  explicit SolidFinder(const std::vector<TopoDS_Shape>& solids)
      : solids_(solids), taken_(solids.size(), false) {}

  void find(std::vector<CadNode>& nodes, const TopLoc_Location& above) {
    for (CadNode& node : nodes) {
      const TopLoc_Location here = above * node.location;
      find(node.children, here);
      if (node.shape.IsNull()) continue;
      for (TopExp_Explorer each(node.shape.Moved(here), kind_of_solids(node.shape)); each.More(); each.Next())
        node.solids.push_back(take(each.Current()));
    }
  }
  [[nodiscard]] bool all() const {
    return std::all_of(taken_.begin(), taken_.end(), [](bool taken) { return taken; });
  }

 private:
  std::size_t take(const TopoDS_Shape& wanted) {
    std::size_t best = kNoSolid;
    double least = 1e300;
    const gp_Trsf there = wanted.Location().Transformation();
    for (std::size_t i = 0; i < solids_.size(); ++i) {
      if (taken_[i] || solids_[i].TShape() != wanted.TShape()) continue;
      const gp_Trsf here = solids_[i].Location().Transformation();
      double distance = (here.TranslationPart() - there.TranslationPart()).Modulus();
      for (int row = 1; row <= 3; ++row)
        for (int column = 1; column <= 3; ++column)
          distance += std::abs(here.Value(row, column) - there.Value(row, column));
      if (distance >= least) continue;
      least = distance;
      best = i;
    }
    if (best != kNoSolid) taken_[best] = true;
    return best;
  }
  const std::vector<TopoDS_Shape>& solids_;
  std::vector<bool> taken_;
};

void read_header(STEPControl_Reader& reader, CadTree& tree) {
  const APIHeaderSection_MakeHeader header(Handle(StepData_StepModel)::DownCast(reader.WS()->Model()));
  tree.time = text_of(header.TimeStamp());
  const Handle(HeaderSection_FileSchema) schema = header.FsValue();
  if (!schema.IsNull() && !schema->SchemaIdentifiers().IsNull() && schema->NbSchemaIdentifiers() > 0)
    tree.schema = text_of(schema->SchemaIdentifiersValue(1));
}

TopoDS_Shape read_step_tree(const CadReadJob& job, CadTree& tree) {
  STEPCAFControl_Reader reader;
  Interface_Static::SetIVal("read.stepcaf.subshapes.name", 1);  // known once there is a reader
  reader.SetColorMode(Standard_True);
  reader.SetNameMode(Standard_True);
  reader.SetLayerMode(Standard_True);
  reader.SetSHUOMode(Standard_True);
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("BinXCAF", document);
  const auto transfer = [&] {
    if (!reader.Transfer(document)) throw InputError(job.where, "holds no shape");
  };
  const TopoDS_Shape shape = transfer_step(reader.ChangeReader(), job, {}, transfer);
  tree.unit = kMillimetre;
  tree.roots = DocumentReader(document).roots();
  tree.length_unit = length_unit(reader.ChangeReader());
  read_header(reader.ChangeReader(), tree);
  return shape;
}

// OpenCASCADE moves what lies in a scaled place as if it had its own size.
void check_scales(const TopoDS_Shape& shape, const std::string& where) {
  for (TopExp_Explorer each(shape, TopAbs_FACE); each.More(); each.Next())
    if (std::abs(std::abs(each.Current().Location().Transformation().ScaleFactor()) - 1) > 1e-12)
      throw InputError(
          where, "has shapes in scaled places, which cannot be written again: write a mesh (STL, OBJ, ...)");
}

// What the labels say of a solid or face of a file without a tree.
StyledShape styled_by(const ShapeLabels& labels, const TopoDS_Shape& shape, const std::string& name) {
  StyledShape styled{shape, TCollection_ExtendedString(name.c_str(), Standard_True), {}};
  if (const std::optional<ShapeColor> color = labels.color(shape))
    styled.style.colors[1] = Quantity_ColorRGBA(  // of surfaces (kColorTypes)
        Quantity_Color((*color)[0], (*color)[1], (*color)[2], Quantity_TOC_sRGB));
  if (labels.layer)
    if (const std::string layer = labels.layer(shape); !layer.empty())
      styled.style.layers.emplace_back(layer.c_str());
  return styled;
}

bool says_something(const StyledShape& styled) {
  return !styled.name.IsEmpty() || styled.style.colors[1] || !styled.style.layers.empty();
}

TopoDS_Shape read_single(const CadReadJob& job, bool in_mm, CadTree& tree) {
  CadShape read = read_shape(job, {});
  check_scales(*read.shape, job.where);
  if (in_mm && read.unit != kMillimetre) {
    gp_Trsf scale;
    scale.SetScale(gp_Pnt(0, 0, 0), read.unit / kMillimetre);
    *read.shape = BRepBuilderAPI_Transform(*read.shape, scale, Standard_True).Shape();
    read.unit = kMillimetre;
  }
  CadNode node;
  node.shape = *read.shape;
  const auto add_styled = [&](TopAbs_ShapeEnum kind, const auto& name) {
    for (TopExp_Explorer each(node.shape, kind); each.More(); each.Next())
      if (const StyledShape styled = styled_by(read.labels, each.Current(), name(each.Current()));
          styled.shape.IsSame(node.shape)) {
        node.name = styled.name;
        node.style = styled.style;
      } else if (says_something(styled)) {
        node.styled.push_back(styled);
      }
  };
  add_styled(TopAbs_SOLID, read.labels.solid_name);
  add_styled(TopAbs_FACE, read.labels.face_name);
  tree.unit = read.unit;
  tree.roots.push_back(std::move(node));
  return *read.shape;
}

}  // namespace

TopAbs_ShapeEnum kind_of_solids(const TopoDS_Shape& shape) {
  return TopExp_Explorer(shape, TopAbs_SOLID).More() ? TopAbs_SOLID : TopAbs_SHELL;
}

CadTree read_tree(const CadReadJob& job, bool in_mm) {
  CadTree tree;
  const TopoDS_Shape shape = job.format == "step" ? read_step_tree(job, tree) : read_single(job, in_mm, tree);
  part_repeated(tree.roots);
  const std::vector<TopoDS_Shape> solids = solids_of(shape, job.where);
  tree.solids = solids.size();
  SolidFinder finder(solids);
  finder.find(tree.roots, TopLoc_Location());
  if (!finder.all())
    throw InputError(job.where, "its assemblies do not hold all its solids: write a mesh instead");
  return tree;
}

}  // namespace flexel::cad
