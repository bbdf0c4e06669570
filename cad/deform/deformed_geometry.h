// The surfaces, curves and points of a shape, moved by a map; the topology and the parameters stay as they are.
#pragma once
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS_Shape.hxx>
#include <functional>
#include <gp_Pnt.hxx>
#include <gp_XYZ.hxx>
#include <optional>
#include <vector>

#include "cad/deform/face_domain.h"
#include "cad/fit/rigid_motion.h"

namespace flexel::cad {

using PointMap = std::function<gp_XYZ(const gp_XYZ&)>;

// How points go, in the coordinates of the shape. Each call makes a map of its own, for one thread.
struct ShapeMap {
  std::function<PointMap(std::size_t face)> of_face;  // index into DeformedGeometry::faces()
  std::function<PointMap()> elsewhere;                // points that no face has
};

struct FitOptions {
  double tolerance = 0;                  // of surfaces, in the unit of the shape
  double spacing = 0;                    // of the lattice: no span of knots is to be much longer
  std::function<void()> face_done = {};  // called, from any thread, as each is fitted
};

struct DeformedFace {
  Handle(Geom_Surface) surface;  // null: there is none
  FaceDomain domain;
  double u_length = 0, v_length = 0;  // through the middle of the domain
  double error = 0;
  bool kept = false;     // moved as a rigid body: a plane stays a plane
  bool reached = false;  // within the tolerance
};

struct DeformedEdge {
  Handle(Geom_Curve) curve;  // null: the edge has none (degenerated)
  double begin = 0, end = 0;
  double gap = 0;  // to the surfaces that meet in it, at most
  double tolerance = 1e-7;
  bool kept = false;
};

struct DeformedVertex {
  gp_Pnt point;
  double tolerance = 1e-7;
};

// What moves each face, edge and vertex of a shape. Surfaces are B-splines of phi(S(u, v)) in the parameters of S; curves
// follow the surfaces that meet in them, so that edges lie on both, and end in their vertices. Tolerances cover what gaps
// remain, and what those of the shape covered.
class DeformedGeometry {
 public:
  DeformedGeometry(const TopoDS_Shape& shape, const ShapeMap& map, const FitOptions& options);

  [[nodiscard]] const TopTools_IndexedMapOfShape& faces() const { return faces_; }
  [[nodiscard]] const DeformedFace& face(std::size_t i) const { return face_[i]; }
  // The largest distance of an edge from the surfaces that meet in it.
  [[nodiscard]] double widest_gap() const;
  // nullptr: the shape does not have it
  [[nodiscard]] const DeformedFace* find_face(const TopoDS_Shape& face) const;
  [[nodiscard]] const DeformedEdge* find_edge(const TopoDS_Shape& edge) const;
  [[nodiscard]] const DeformedVertex* find_vertex(const TopoDS_Shape& vertex) const;

 private:
  [[nodiscard]] std::optional<RigidMotion> motion_of(const Handle(Geom_Surface) & surface,
                                                     const DeformedFace& face, const PointMap& map) const;
  void fit_face(std::size_t i);
  void fit_edge(std::size_t i);
  void move_vertex(std::size_t i);
  void join_ends();
  void widen_tolerances();
  // A point of an edge on one of the faces that meet in it.
  struct OnFace;
  [[nodiscard]] std::vector<OnFace> on_faces(const TopoDS_Shape& edge) const;

  const ShapeMap& map_;
  FitOptions options_;
  TopTools_IndexedMapOfShape faces_, edges_, vertices_;
  TopTools_IndexedDataMapOfShapeListOfShape faces_of_edge_, faces_of_vertex_;
  std::vector<DeformedFace> face_;
  std::vector<DeformedEdge> edge_;
  std::vector<DeformedVertex> vertex_;
};

}  // namespace flexel::cad
