// Meshes of OpenCASCADE's solids, whichever format they came in. Every solid is tessellated face by face; the
// nodes of neighbouring faces are merged by topology: the i-th node that two faces have on one edge is one
// vertex, and so are all nodes on one CAD vertex. No tolerance is involved, so thin walls cannot be welded to
// each other and the mesh is closed where the solid is. A flat face has nodes on its rim only; subdivide()
// then gives it some to bend by.
#include <fmt/format.h>

#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Eigen/Geometry>
#include <IMeshTools_Parameters.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/math/area_vector.h"
#include "cad/read/assembly_paths.h"
#include "cad/read/occt.h"
#include "cad/read/tells_share.h"

namespace flexel::cad {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// Every shape of a kind, in the order of exploration, locations applied; each once.
std::vector<TopoDS_Shape> shapes_of(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind,
                                    TopAbs_ShapeEnum avoid = TopAbs_SHAPE) {
  std::vector<TopoDS_Shape> found;
  for (TopExp_Explorer explorer(shape, kind, avoid); explorer.More(); explorer.Next())
    found.push_back(explorer.Current());
  return found;
}

// --- tessellation

void tessellate(const TopoDS_Shape& solid, double unit, const CadReadJob& job) {
  constexpr double kDefaultShare = 1e-3;  // of the diagonal
  Bnd_Box box;
  BRepBndLib::Add(solid, box, Standard_False);
  if (box.IsVoid()) throw InputError(job.where, "holds a solid without extent");
  IMeshTools_Parameters parameters;
  parameters.Deflection =
      job.deflection ? *job.deflection / unit : kDefaultShare * std::sqrt(box.SquareExtent());
  parameters.Angle = job.angular_deflection;
  parameters.InParallel = Standard_True;
  if (!(parameters.Deflection > 0) || !(parameters.Angle > 0))
    throw InputError(job.where, "the deflection of the tessellation must be positive");
  BRepMesh_IncrementalMesh mesher(solid, parameters, TellsShare::begin()->Start());
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

// In the unit of the shape.
Vec3 position(const SolidMesh& mesh, std::size_t f, Standard_Integer node) {
  const gp_Pnt point = mesh.triangulations[f]->Node(node).Transformed(mesh.locations[f].Transformation());
  return {point.X(), point.Y(), point.Z()};
}

// Adds the triangles of one face. `vertex_of` (nodes) is the vertex of each root, kNone until it has one.
void add_face(Surface& surface, const SolidMesh& mesh, std::size_t f, double unit, NodeMerger& merger,
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
        surface.vertices.push_back(position(mesh, f, nodes[i]) * unit);
      }
      surface.polygon_vertices.push_back(vertex);
    }
    surface.polygon_face.push_back(static_cast<std::uint32_t>(surface.faces.size() - 1));
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
  }
}

void add_solid(Surface& surface, const TopoDS_Shape& solid, double unit, const ShapeLabels& labels,
               std::vector<std::optional<ShapeColor>>& colors) {
  const SolidMesh mesh = collect(solid);
  const std::size_t faces = mesh.triangulations.size();
  NodeMerger merger(mesh);
  for (std::size_t f = 0; f < faces; ++f) merger.add_face(f);
  const auto part = static_cast<std::uint32_t>(surface.parts.size());
  surface.parts.push_back({labels.solid_name(solid)});
  const std::optional<ShapeColor> solid_color = labels.color(solid);
  std::vector<std::uint32_t> vertex_of(mesh.node_base.back(), kNone);
  for (std::size_t f = 0; f < faces; ++f) {
    const TopoDS_Shape& face = mesh.faces(static_cast<Standard_Integer>(f) + 1);
    surface.faces.push_back({labels.face_name(face), part});
    const std::optional<ShapeColor> color = labels.color(face);
    colors.push_back(color ? color : solid_color);
    add_face(surface, mesh, f, unit, merger, vertex_of);
  }
}

// White for a face that has none; empty where none has.
std::vector<double> numbers_of(const std::vector<std::optional<ShapeColor>>& colors) {
  std::vector<double> numbers;
  if (std::none_of(colors.begin(), colors.end(), [](const auto& color) { return color.has_value(); }))
    return numbers;
  for (const auto& color : colors)
    for (const double value : color.value_or(ShapeColor{1, 1, 1})) numbers.push_back(value);
  return numbers;
}

}  // namespace

std::vector<TopoDS_Shape> solids_of(const TopoDS_Shape& shape, const std::string& where) {
  if (shape.IsNull()) throw InputError(where, "holds no shape");
  std::vector<TopoDS_Shape> solids = shapes_of(shape, TopAbs_SOLID);
  if (!solids.empty()) return solids;
  std::vector<TopoDS_Shape> shells = shapes_of(shape, TopAbs_SHELL);
  const std::size_t faces = shapes_of(shape, TopAbs_FACE).size();
  for (const TopoDS_Shape& shell : shells)
    if (BRep_Tool::IsClosed(shell)) solids.push_back(shell);
  if (solids.empty())
    throw InputError(
        where, fmt::format("holds no solid, only {} open shells and {} faces: export the part as a solid",
                           shells.size(), faces));
  return solids;
}

CadMesh mesh_of(const CadShape& shape, const CadReadJob& job) {
  CadMesh mesh;
  mesh.surface.polygon_offsets.push_back(0);
  const std::vector<std::string> assemblies = assembly_paths(shape);
  std::vector<std::optional<ShapeColor>> colors;  // (faces)
  const std::vector<TopoDS_Shape> solids = solids_of(*shape.shape, job.where);
  for (const TopoDS_Shape& solid : solids) {
    const auto share = [&](std::size_t done) {
      return static_cast<double>(done) / static_cast<double>(solids.size());
    };
    const ShareScope scope(share(mesh.surface.parts.size()), share(mesh.surface.parts.size() + 1));
    tessellate(solid, shape.unit, job);
    const std::size_t part = mesh.surface.parts.size();
    add_solid(mesh.surface, solid, shape.unit, shape.labels, colors);
    if (part < assemblies.size()) mesh.surface.parts[part].assembly = assemblies[part];
  }
  mesh.face_colors = numbers_of(colors);
  return mesh;
}

}  // namespace flexel::cad
