// STEP through OpenCASCADE, which only this file and step_reader_names.cpp see. Every solid is tessellated
// face by face; the nodes of neighbouring faces are merged by topology: the i-th node that two faces have on
// one edge is one vertex, and so are all nodes on one CAD vertex. No tolerance is involved, so thin walls
// cannot be welded to each other and the mesh is closed where the solid is. A flat face has nodes on its rim
// only; subdivide() then gives it some to bend by.
#include <fmt/format.h>

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <IMeshTools_Parameters.hxx>
#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepGeom_GeometricRepresentationItem.hxx>
#include <StepRepr_Representation.hxx>
#include <StepShape_TopologicalRepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <utility>

#include "formats/disjoint_sets.h"
#include "formats/error.h"
#include "formats/import/crash_guard.h"
#include "formats/import/readers.h"
#include "formats/import/step_help.h"
#include "formats/import/step_names.h"
#include "formats/import/subdivide.h"
#include "formats/topology.h"

namespace flexel {
namespace {

constexpr double kMillimetre = 1e-3;
constexpr std::uint32_t kNone = 0xffffffffu;

// --- reading

std::string damage(const std::string& what) {
  return fmt::format("is damaged: OpenCASCADE says \"{}\"", clean_name(what));
}

bool is_geometry(const Handle(Standard_Transient) & entity) {
  const bool representation = entity->IsKind(STANDARD_TYPE(StepRepr_Representation)) &&
                              !std::string_view(entity->DynamicType()->Name()).starts_with("StepVisual_");
  return representation || entity->IsKind(STANDARD_TYPE(StepGeom_GeometricRepresentationItem)) ||
         entity->IsKind(STANDARD_TYPE(StepShape_TopologicalRepresentationItem));
}

// "#176" of "Unresolved Reference, Ent.Id.#176 Param.n0 4 (Id.#225)", or "".
std::string label_in(std::string_view message) {
  constexpr std::string_view kBefore = "Ent.Id.";
  const std::size_t at = message.find(kBefore);
  if (at == std::string_view::npos) return "";
  const std::string_view label = message.substr(at + kBefore.size());
  return std::string(label.substr(0, label.find(' ')));
}

// A reference from a solid to something that is not in the file. OpenCASCADE keeps these apart, as messages
// on the whole.
void check_references(const Handle(Interface_InterfaceModel) & model, const ImportInput& input) {
  const Handle(Interface_Check) check = model->GlobalCheck();
  const auto examine = [&](Standard_CString message) {
    const std::string label = label_in(message);
    const Standard_Integer number = label.empty() ? 0 : model->NextNumberForLabel(label.c_str());
    if (number > 0 && is_geometry(model->Value(number))) throw InputError(input.where, damage(message));
  };
  for (Standard_Integer i = 1; i <= check->NbFails(); ++i) examine(check->CFail(i));
  for (Standard_Integer i = 1; i <= check->NbWarnings(); ++i) examine(check->CWarning(i));
}

// OpenCASCADE loads what it can and later follows the references that are missing, so a solid of which a part
// did not load is refused here. Damage elsewhere in the file (drawings, tolerances, colours) does no harm.
void check_loaded(const STEPControl_Reader& reader, const ImportInput& input) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  check_references(model, input);
  const Interface_CheckIterator checks = reader.WS()->ModelCheckList(Standard_False);
  for (checks.Start(); checks.More(); checks.Next()) {
    if (!checks.Value()->HasFailed() || checks.Number() < 1) continue;
    const Handle(Standard_Transient) entity = model->Value(checks.Number());
    if (is_geometry(entity))
      throw InputError(input.where, damage(fmt::format("{}: {}", model->StringLabel(entity)->ToCString(),
                                                       checks.Value()->CFail(1))));
  }
}

TopoDS_Shape transfer(STEPControl_Reader& reader, ImportInput& input) {
  // OpenCASCADE reports on stdout, which belongs to the result.
  Message::DefaultMessenger()->ChangePrinters().Clear();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  MemoryStream stream(input.bytes);
  if (reader.ReadStream(input.file.c_str(), stream) != IFSelect_RetDone)
    throw InputError(input.where, "is damaged: OpenCASCADE cannot make sense of it as STEP");
  check_loaded(reader, input);
  reader.TransferRoots();
  return reader.OneShape();
}

// Every shape of a kind, in the order of exploration, locations applied; each once.
std::vector<TopoDS_Shape> shapes_of(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind,
                                    TopAbs_ShapeEnum avoid = TopAbs_SHAPE) {
  std::vector<TopoDS_Shape> found;
  for (TopExp_Explorer explorer(shape, kind, avoid); explorer.More(); explorer.Next())
    found.push_back(explorer.Current());
  return found;
}

// The solids; where there are none, closed shells stand for solids.
std::vector<TopoDS_Shape> solids_of(const TopoDS_Shape& shape, const ImportInput& input) {
  if (shape.IsNull()) throw InputError(input.where, "holds no shape");
  std::vector<TopoDS_Shape> solids = shapes_of(shape, TopAbs_SOLID);
  if (!solids.empty()) return solids;
  std::vector<TopoDS_Shape> shells = shapes_of(shape, TopAbs_SHELL);
  const std::size_t faces = shapes_of(shape, TopAbs_FACE).size();
  for (const TopoDS_Shape& shell : shells)
    if (BRep_Tool::IsClosed(shell)) solids.push_back(shell);
  if (solids.empty())
    throw InputError(
        input.where,
        fmt::format("holds no solid, only {} open shells and {} faces: export the part as a solid",
                    shells.size(), faces));
  return solids;
}

// --- tessellation

void tessellate(const TopoDS_Shape& solid, const ImportOptions& options, const ImportInput& input) {
  constexpr double kDefaultShare = 1e-3;  // of the diagonal
  Bnd_Box box;
  BRepBndLib::Add(solid, box, Standard_False);
  if (box.IsVoid()) throw InputError(input.where, "holds a solid without extent");
  IMeshTools_Parameters parameters;
  parameters.Deflection =
      options.deflection ? *options.deflection / kMillimetre : kDefaultShare * std::sqrt(box.SquareExtent());
  parameters.Angle = options.angular_deflection;
  parameters.InParallel = Standard_True;
  if (!(parameters.Deflection > 0) || !(parameters.Angle > 0))
    throw InputError(input.where, "the deflection of the tessellation must be positive");
  BRepMesh_IncrementalMesh mesher(solid, parameters);
}

// The triangulated faces of one solid. Node i (from 1) of face f is node_base[f] + i - 1.
struct SolidMesh {
  TopTools_IndexedMapOfShape faces, edges, vertices;
  std::vector<Handle(Poly_Triangulation)> triangulations;  // (faces) null where OpenCASCADE made none
  std::vector<TopLoc_Location> locations;
  std::vector<std::uint32_t> node_base;  // (faces + 1)
};

SolidMesh collect(const TopoDS_Shape& solid) {
  SolidMesh mesh;
  TopExp::MapShapes(solid, TopAbs_FACE, mesh.faces);
  TopExp::MapShapes(solid, TopAbs_EDGE, mesh.edges);
  TopExp::MapShapes(solid, TopAbs_VERTEX, mesh.vertices);
  mesh.node_base.push_back(0);
  for (Standard_Integer f = 1; f <= mesh.faces.Extent(); ++f) {
    TopLoc_Location location;
    mesh.triangulations.push_back(BRep_Tool::Triangulation(TopoDS::Face(mesh.faces(f)), location));
    mesh.locations.push_back(location);
    const auto& triangulation = mesh.triangulations.back();
    mesh.node_base.push_back(
        mesh.node_base.back() +
        (triangulation.IsNull() ? 0u : static_cast<std::uint32_t>(triangulation->NbNodes())));
  }
  return mesh;
}

// Merges the nodes that faces have in common, through the edges of face f.
class NodeMerger {
 public:
  explicit NodeMerger(const SolidMesh& mesh)
      : mesh_(mesh),
        sets_(mesh.node_base.back()),
        on_edge_(mesh.edges.Extent()),
        on_vertex_(mesh.vertices.Extent(), kNone) {}

  void add_face(std::size_t f) {
    if (mesh_.triangulations[f].IsNull()) return;
    const TopoDS_Shape face = mesh_.faces(static_cast<Standard_Integer>(f) + 1).Oriented(TopAbs_FORWARD);
    for (TopExp_Explorer explorer(face, TopAbs_EDGE); explorer.More(); explorer.Next())
      add_edge(f, TopoDS::Edge(explorer.Current()));
  }
  std::uint32_t root(std::uint32_t node) { return sets_.root(node); }

 private:
  void add_edge(std::size_t f, const TopoDS_Edge& edge) {
    const Handle(Poly_PolygonOnTriangulation) polygon =
        BRep_Tool::PolygonOnTriangulation(edge, mesh_.triangulations[f], mesh_.locations[f]);
    if (polygon.IsNull()) return;
    const auto node = [&](Standard_Integer i) {
      return mesh_.node_base[f] + static_cast<std::uint32_t>(polygon->Node(i)) - 1;
    };
    const Standard_Integer count = polygon->NbNodes();
    add_vertex(TopExp::FirstVertex(TopoDS::Edge(edge.Oriented(TopAbs_FORWARD))), node(1));
    add_vertex(TopExp::LastVertex(TopoDS::Edge(edge.Oriented(TopAbs_FORWARD))), node(count));
    if (BRep_Tool::Degenerated(edge)) {
      for (Standard_Integer i = 2; i <= count; ++i) sets_.unite(node(1), node(i));
      return;
    }
    std::vector<std::uint32_t>& first = on_edge_[mesh_.edges.FindIndex(edge) - 1];
    if (first.empty())
      for (Standard_Integer i = 1; i <= count; ++i) first.push_back(node(i));
    if (first.size() != static_cast<std::size_t>(count)) return;
    for (Standard_Integer i = 1; i <= count; ++i) sets_.unite(first[i - 1], node(i));
  }
  void add_vertex(const TopoDS_Vertex& vertex, std::uint32_t node) {
    if (vertex.IsNull()) return;
    std::uint32_t& first = on_vertex_[mesh_.vertices.FindIndex(vertex) - 1];
    if (first == kNone) first = node;
    sets_.unite(first, node);
  }

  const SolidMesh& mesh_;
  DisjointSets sets_;
  std::vector<std::vector<std::uint32_t>>
      on_edge_;                           // (edges) nodes along each, of the first face that has it
  std::vector<std::uint32_t> on_vertex_;  // (vertices)
};

Vec3 position(const SolidMesh& mesh, std::size_t f, Standard_Integer node) {
  const gp_Pnt point = mesh.triangulations[f]->Node(node).Transformed(mesh.locations[f].Transformation());
  return Vec3(point.X(), point.Y(), point.Z()) * kMillimetre;
}

// Adds the triangles of one face. `vertex_of` (nodes) is the vertex of each root, kNone until it has one.
void add_face(Surface& surface, const SolidMesh& mesh, std::size_t f, NodeMerger& merger,
              std::vector<std::uint32_t>& vertex_of) {
  const auto& triangulation = mesh.triangulations[f];
  if (triangulation.IsNull()) return;
  const bool reversed = mesh.faces(static_cast<Standard_Integer>(f) + 1).Orientation() == TopAbs_REVERSED;
  const bool mirrored = mesh.locations[f].Transformation().IsNegative();
  for (Standard_Integer t = 1; t <= triangulation->NbTriangles(); ++t) {
    std::array<Standard_Integer, 3> nodes{};
    triangulation->Triangle(t).Get(nodes[0], nodes[1], nodes[2]);
    if (reversed != mirrored) std::swap(nodes[1], nodes[2]);
    std::array<std::uint32_t, 3> roots{};
    for (std::size_t i = 0; i < 3; ++i)
      roots[i] = merger.root(mesh.node_base[f] + static_cast<std::uint32_t>(nodes[i]) - 1);
    if (roots[0] == roots[1] || roots[1] == roots[2] || roots[2] == roots[0]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      std::uint32_t& vertex = vertex_of[roots[i]];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(surface.vertices.size());
        surface.vertices.push_back(position(mesh, f, nodes[i]));
      }
      surface.polygon_vertices.push_back(vertex);
    }
    surface.polygon_face.push_back(static_cast<std::uint32_t>(surface.faces.size() - 1));
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  }
}

void add_solid(Surface& surface, const TopoDS_Shape& solid, const StepNames& names) {
  const SolidMesh mesh = collect(solid);
  const std::size_t faces = mesh.triangulations.size(), first_polygon = surface.polygon_count();
  NodeMerger merger(mesh);
  for (std::size_t f = 0; f < faces; ++f) merger.add_face(f);
  const auto part = static_cast<std::uint32_t>(surface.parts.size());
  surface.parts.push_back({names.solid(solid)});
  std::vector<std::uint32_t> vertex_of(mesh.node_base.back(), kNone);
  for (std::size_t f = 0; f < faces; ++f) {
    surface.faces.push_back({names.own(mesh.faces(static_cast<Standard_Integer>(f) + 1)), part});
    add_face(surface, mesh, f, merger, vertex_of);
  }
  orient_outward(surface, first_polygon);
}

// Default for the largest edge: a share of the solid's diagonal.
constexpr double kDefaultEdges = 64;
// No file becomes more triangles by subdivision.
constexpr std::size_t kMostTriangles = 2'000'000;

// Subdivides the last solid. Without a limit of the user's it gets its share of the triangles and what edges
// they allow.
void refine(Surface& surface, std::size_t first_polygon, std::size_t solids, const ImportOptions& options,
            const ImportInput& input) {
  if (options.largest_edge) {
    const std::size_t left = kMostTriangles - std::min(kMostTriangles, first_polygon);
    if (!subdivide(surface, first_polygon, *options.largest_edge, left))
      throw InputError(input.where, fmt::format("edges of at most {:g} mm would take more than {} triangles: "
                                                "give a larger --edge",
                                                *options.largest_edge / kMillimetre, kMostTriangles));
    return;
  }
  Box box;
  for (std::size_t i = surface.polygon_offsets[first_polygon]; i < surface.polygon_vertices.size(); ++i)
    box.add(surface.vertices[surface.polygon_vertices[i]]);
  const double largest = box.size().norm() / kDefaultEdges;
  if (largest > 0) static_cast<void>(subdivide(surface, first_polygon, largest, kMostTriangles / solids));
}

Surface read_solids(ImportInput& input, const ImportOptions& options) {
  STEPControl_Reader reader;
  const std::vector<TopoDS_Shape> solids = solids_of(transfer(reader, input), input);
  const StepNames names(reader);
  Surface surface;
  surface.polygon_offsets.push_back(0);
  for (const TopoDS_Shape& solid : solids) {
    const std::size_t first_polygon = surface.polygon_count();
    tessellate(solid, options, input);
    add_solid(surface, solid, names);
    if (surface.polygon_count() > first_polygon)
      refine(surface, first_polygon, solids.size(), options, input);
  }
  return surface;
}

}  // namespace

Surface read_step(ImportInput& input, const ImportOptions& options) {
  if (options.unit) throw InputError(input.where, "a STEP file carries its own unit: leave out --unit");
  if (options.largest_edge && !(*options.largest_edge > 0))
    throw InputError(input.where, "the largest edge of the mesh must be above zero");
  check_step_complete(input);
  try {
    Surface surface;
    guarded([&] { surface = read_solids(input, options); });
    SurfaceSource source;
    source.format = "step";
    source.unit = kMillimetre;
    source.unit_given = true;
    surface.sources.push_back(std::move(source));
    return surface;
  } catch (const LibraryCrashed&) {
    throw InputError(input.where, "is damaged: OpenCASCADE cannot read it");
  } catch (const Standard_Failure& failure) {
    throw InputError(input.where,
                     damage(failure.GetMessageString() ? failure.GetMessageString() : "no reason"));
  }
}

}  // namespace flexel
