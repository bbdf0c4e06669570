// A surface whose points all moved with one rigid motion, to a tenth of the tolerance, is moved by it and stays what it
// is. All others become B-splines.
#include "cad/deform/deformed_geometry.h"

#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomAdaptor_Curve.hxx>
#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Standard_Failure.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_ListIteratorOfListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "cad/fit/fit.h"
#include "cad/fit/rigid_motion.h"

namespace flexel::cad {
namespace {

constexpr double kRigidShare = 0.1;   // of the tolerance
constexpr double kCurveShare = 0.25;  // of the tolerance, for curves
constexpr double kPoleShare = 1e-4;   // likewise, for curves that end in a pole
constexpr double kLeastTolerance = 1e-7;
constexpr double kAngle = 1.05;        // rad: no span of a turned surface is longer
constexpr double kLongestSpan = 3;     // lattice spacings
constexpr double kShortestSpan = 0.1;  // tolerances: a break so near to another may be a little beside it
constexpr std::size_t kMostFirstSpans = 200;
constexpr double kStep = 1e-3;  // lattice spacings, of differences
constexpr double kLooks = 2;    // a lattice spacing: what moves a single cell is seen

// The intervals on which an adaptor is continuous of each order, as breaks.
template <class Count, class Intervals>
std::vector<Break> breaks_of(const Count& count, const Intervals& intervals) {
  // Intervals of C(k + 1) end where only C(k) is sure.
  constexpr std::pair<GeomAbs_Shape, int> kOrders[] = {
      {GeomAbs_CN, 3}, {GeomAbs_C3, 2}, {GeomAbs_C2, 1}, {GeomAbs_C1, 0}};
  std::vector<Break> breaks;
  for (const auto& [order, continuity] : kOrders) {
    try {
      const Standard_Integer n = count(order);
      if (n <= 1) continue;
      TColStd_Array1OfReal ends(1, n + 1);
      intervals(ends, order);
      for (Standard_Integer i = 2; i <= n; ++i) breaks.push_back({ends(i), continuity});
    } catch (const Standard_Failure&) {  // some surfaces do not know
    }
  }
  return breaks;
}

std::size_t least_spans(double length, double angle, double spacing) {
  const double by_length = spacing > 0 ? length / (kLongestSpan * spacing) : 0, by_angle = angle / kAngle;
  return static_cast<std::size_t>(
      std::clamp(std::ceil(std::max(by_length, by_angle)), 2.0, static_cast<double>(kMostFirstSpans)));
}

// For what is `length` long from parameter `begin` to `end`; `turns`: the parameter is an angle.
template <class Count, class Intervals>
Knots first_knots(double begin, double end, double length, bool turns, const FitOptions& options,
                  const Count& count, const Intervals& intervals) {
  const double width = end - begin,
               shortest = length > 0 ? kShortestSpan * options.tolerance / length * width : 0;
  return make_knots(begin, end, breaks_of(count, intervals),
                    least_spans(length, turns ? width : 0, options.spacing), shortest);
}

bool turns_in_u(GeomAbs_SurfaceType type) {
  return type == GeomAbs_Cylinder || type == GeomAbs_Cone || type == GeomAbs_Sphere ||
         type == GeomAbs_Torus || type == GeomAbs_SurfaceOfRevolution;
}
bool turns_in_v(GeomAbs_SurfaceType type) {
  return type == GeomAbs_Sphere || type == GeomAbs_Torus;
}

// Points to look at along u and v: kLooks a spacing, fewer where they would be very many.
std::pair<int, int> looks_at(const DeformedFace& face, double spacing) {
  constexpr double kLeast = 25, kMost = 100'000;  // in a direction; in all
  double u = std::max(kLeast, kLooks * face.u_length / spacing),
         v = std::max(kLeast, kLooks * face.v_length / spacing);
  if (const double many = u * v / kMost; many > 1) {
    u = std::max(kLeast, u / std::sqrt(many));
    v = std::max(kLeast, std::min(v, kMost / u));
  }
  return {static_cast<int>(std::min(u, kMost / kLeast)), static_cast<int>(std::min(v, kMost / kLeast))};
}

struct Moved {
  std::vector<gp_XYZ> from, to;
  void add(const gp_Pnt& point, const PointMap& map) {
    from.push_back(point.XYZ());
    to.push_back(map(point.XYZ()));
  }
};

// By how much the deformation lengthens what is short and near a point, at most: a bound on the spectral norm of its
// gradient F, from the row sums of F^T F.
double stretch_at(const PointMap& map, const gp_XYZ& at, double step) {
  const gp_XYZ by[3] = {gp_XYZ(step, 0, 0), gp_XYZ(0, step, 0), gp_XYZ(0, 0, step)};
  gp_XYZ column[3];
  for (int i = 0; i < 3; ++i) column[i] = (map(at + by[i]) - map(at - by[i])) / (2 * step);
  double largest = 0;
  for (const gp_XYZ& a : column)
    largest = std::max(largest,
                       std::abs(a.Dot(column[0])) + std::abs(a.Dot(column[1])) + std::abs(a.Dot(column[2])));
  return std::sqrt(largest);
}

TopoDS_Face forward(const TopoDS_Shape& face) {
  return TopoDS::Face(face.Oriented(TopAbs_FORWARD));
}

}  // namespace

struct DeformedGeometry::OnFace {
  Handle(Geom2d_Curve) curve;
  double begin = 0, end = 0;  // of its parameter
  GeomAdaptor_Surface surface;
  [[nodiscard]] gp_XYZ at(double share) const {
    const gp_Pnt2d uv = curve->Value(begin + share * (end - begin));
    return surface.Value(uv.X(), uv.Y()).XYZ();
  }
  // Whether one end is where the surface has no extent along one of its parameters.
  [[nodiscard]] bool ends_in_pole() const {
    constexpr double kNone = 1e-6;  // of the extent along the other
    for (const double t : {begin, end}) {
      const gp_Pnt2d uv = curve->Value(t);
      gp_Pnt point;
      gp_Vec by_u, by_v;
      surface.D1(uv.X(), uv.Y(), point, by_u, by_v);
      const double u = by_u.Magnitude(), v = by_v.Magnitude();
      if (std::min(u, v) < kNone * std::max(u, v)) return true;
    }
    return false;
  }
};

DeformedGeometry::DeformedGeometry(const TopoDS_Shape& shape, const ShapeMap& map, const FitOptions& options)
    : map_(map), options_(options) {
  TopExp::MapShapes(shape, TopAbs_FACE, faces_);
  TopExp::MapShapes(shape, TopAbs_EDGE, edges_);
  TopExp::MapShapes(shape, TopAbs_VERTEX, vertices_);
  TopExp::MapShapesAndAncestors(shape, TopAbs_EDGE, TopAbs_FACE, faces_of_edge_);
  TopExp::MapShapesAndAncestors(shape, TopAbs_VERTEX, TopAbs_FACE, faces_of_vertex_);
  face_.resize(faces_.Extent());
  edge_.resize(edges_.Extent());
  vertex_.resize(vertices_.Extent());
  parallel_for_each(
      face_.size(),
      [&](std::size_t i) {
        fit_face(i);
        if (options_.face_done) options_.face_done();
      },
      1);
  parallel_for_each(
      edge_.size(), [&](std::size_t i) { fit_edge(i); }, 4);
  for (std::size_t i = 0; i < vertex_.size(); ++i) move_vertex(i);
  join_ends();
  widen_tolerances();
}

// That of all points of a face's domain, within kRigidShare of the tolerance; nothing: there is none. A few points tell it
// of most faces: no motion leaves less than their mean.
std::optional<RigidMotion> DeformedGeometry::motion_of(const Handle(Geom_Surface) & surface,
                                                       const DeformedFace& face, const PointMap& map) const {
  constexpr int kFew = 5;
  const FaceDomain& d = face.domain;
  const auto motion = [&](int u_looks, int v_looks) {
    Moved moved;
    for (int p = 0; p <= u_looks; ++p)
      for (int q = 0; q <= v_looks; ++q)
        moved.add(surface->Value(d.u_begin + (d.u_end - d.u_begin) * p / u_looks,
                                 d.v_begin + (d.v_end - d.v_begin) * q / v_looks),
                  map);
    return rigid_motion(moved.from, moved.to, kLeastTolerance);
  };
  const double most = kRigidShare * options_.tolerance;
  if (motion(kFew, kFew).mean > most) return {};
  const auto [u_looks, v_looks] = looks_at(face, options_.spacing);
  const RigidMotion rigid = motion(u_looks, v_looks);
  return rigid.error <= most ? std::optional(rigid) : std::nullopt;
}

void DeformedGeometry::fit_face(std::size_t i) {
  DeformedFace& result = face_[i];
  const TopoDS_Face face = forward(faces_(static_cast<Standard_Integer>(i) + 1));
  const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
  if (surface.IsNull()) return;
  const PointMap map = map_.of_face(i);
  result.domain = face_domain(face);
  const FaceDomain& d = result.domain;
  result.u_length = length_of(surface, d, true);
  result.v_length = length_of(surface, d, false);
  if (const std::optional<RigidMotion> rigid = motion_of(surface, result, map)) {
    result.surface =
        rigid->none ? surface : Handle(Geom_Surface)::DownCast(surface->Transformed(rigid->motion));
    result.error = rigid->error;
    result.kept = result.reached = true;
    return;
  }
  const GeomAdaptor_Surface adaptor(surface, d.u_begin, d.u_end, d.v_begin, d.v_end);
  const GeomAbs_SurfaceType type = adaptor.GetType();
  const Knots u = first_knots(
      d.u_begin, d.u_end, result.u_length, turns_in_u(type), options_,
      [&](GeomAbs_Shape order) { return adaptor.NbUIntervals(order); },
      [&](TColStd_Array1OfReal& ends, GeomAbs_Shape order) { adaptor.UIntervals(ends, order); });
  const Knots v = first_knots(
      d.v_begin, d.v_end, result.v_length, turns_in_v(type), options_,
      [&](GeomAbs_Shape order) { return adaptor.NbVIntervals(order); },
      [&](TColStd_Array1OfReal& ends, GeomAbs_Shape order) { adaptor.VIntervals(ends, order); });
  const FaceMask mask(face, d);
  SurfaceMap fitted;
  fitted.point = [&](double at_u, double at_v) { return map(adaptor.Value(at_u, at_v).XYZ()); };
  fitted.counts = [&](double at_u, double at_v, double du, double dv) {
    return mask.has_near(at_u, at_v, du, dv);
  };
  fitted.u_closed = d.u_closed;
  fitted.v_closed = d.v_closed;
  const SurfaceFit fit = fit_surface(fitted, u, v, options_.tolerance);
  result.surface = fit.surface;
  result.error = fit.error;
  result.reached = fit.reached;
}

// A seam lies on its face twice.
std::vector<DeformedGeometry::OnFace> DeformedGeometry::on_faces(const TopoDS_Shape& shape) const {
  const TopoDS_Edge edge = TopoDS::Edge(shape.Oriented(TopAbs_FORWARD));
  std::vector<OnFace> found;
  if (!faces_of_edge_.Contains(edge)) return found;
  TopTools_IndexedMapOfShape seen;
  for (TopTools_ListIteratorOfListOfShape each(faces_of_edge_.FindFromKey(edge)); each.More(); each.Next()) {
    const TopoDS_Face face = forward(each.Value());
    if (seen.Contains(face)) continue;
    seen.Add(face);
    const DeformedFace* moved = find_face(face);
    if (moved == nullptr || moved->surface.IsNull()) continue;
    for (const TopAbs_Orientation orientation : {TopAbs_FORWARD, TopAbs_REVERSED}) {
      const TopoDS_Edge oriented = TopoDS::Edge(edge.Oriented(orientation));
      if (orientation == TopAbs_REVERSED && !BRep_Tool::IsClosed(oriented, face)) break;
      OnFace on;
      on.curve = BRep_Tool::CurveOnSurface(oriented, face, on.begin, on.end);
      if (on.curve.IsNull()) continue;
      on.surface.Load(moved->surface);
      found.push_back(on);
    }
  }
  return found;
}

// Beside a pole parameters turn about, and however narrow the gap of a curve that ends in it is, it is wider than the
// surface around the pole: meshers (gmsh), which go down to a nanometre there, find faces that pass each other. Such a
// curve lies on the pole's surface alone.
void DeformedGeometry::fit_edge(std::size_t i) {
  DeformedEdge& result = edge_[i];
  const TopoDS_Edge edge =
      TopoDS::Edge(edges_(static_cast<Standard_Integer>(i) + 1).Oriented(TopAbs_FORWARD));
  BRep_Tool::Range(edge, result.begin, result.end);
  if (BRep_Tool::Degenerated(edge)) return;
  double begin = 0, end = 0;
  Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, begin, end);
  if (curve.IsNull()) return;
  result.begin = begin;
  result.end = end;
  const std::vector<OnFace> faces = on_faces(edge);
  const PointMap map = faces_of_edge_.Contains(edge) && !faces_of_edge_.FindFromKey(edge).IsEmpty()
                           ? map_.of_face(faces_.FindIndex(faces_of_edge_.FindFromKey(edge).First()) - 1)
                           : map_.elsewhere();
  // As those of vertices.
  result.tolerance = BRep_Tool::Tolerance(edge) *
                     stretch_at(map, curve->Value((begin + end) / 2).XYZ(), kStep * options_.spacing);
  const int looks =
      static_cast<int>(std::clamp(kLooks * length_of(curve, begin, end) / options_.spacing, 60.0, 10'000.0));
  Moved moved;
  for (int p = 0; p <= looks; ++p) moved.add(curve->Value(begin + (end - begin) * p / looks), map);
  if (const RigidMotion rigid = rigid_motion(moved.from, moved.to, kLeastTolerance);
      rigid.error <= kRigidShare * options_.tolerance) {
    if (!rigid.none) curve = Handle(Geom_Curve)::DownCast(curve->Transformed(rigid.motion));
    if (const auto trimmed = Handle(Geom_TrimmedCurve)::DownCast(curve); !trimmed.IsNull())
      curve = trimmed->BasisCurve();
    result.curve = curve;
    result.kept = true;
    return;
  }
  const GeomAdaptor_Curve adaptor(curve, begin, end);
  const bool turns = adaptor.GetType() == GeomAbs_Circle || adaptor.GetType() == GeomAbs_Ellipse;
  const Knots knots = first_knots(
      begin, end, length_of(curve, begin, end), turns, options_,
      [&](GeomAbs_Shape order) { return adaptor.NbIntervals(order); },
      [&](TColStd_Array1OfReal& ends, GeomAbs_Shape order) { adaptor.Intervals(ends, order); });
  const auto at_pole =
      std::find_if(faces.begin(), faces.end(), [](const OnFace& face) { return face.ends_in_pole(); });
  const auto mean = [&](double t) {
    if (faces.empty()) return map(curve->Value(t).XYZ());
    if (at_pole != faces.end()) return at_pole->at((t - begin) / (end - begin));
    gp_XYZ sum(0, 0, 0);
    for (const OnFace& face : faces) sum += face.at((t - begin) / (end - begin));
    return sum / static_cast<double>(faces.size());
  };
  const bool closed = moved.from.front().IsEqual(moved.from.back(), kLeastTolerance);
  const double share = at_pole != faces.end() ? kPoleShare : kCurveShare;
  result.curve = fit_curve(mean, knots, closed, share * options_.tolerance).curve;
  if (result.curve.IsNull()) throw InputError("an edge cannot be deformed: no curve goes through its points");
}

void DeformedGeometry::move_vertex(std::size_t i) {
  const TopoDS_Vertex vertex = TopoDS::Vertex(vertices_(static_cast<Standard_Integer>(i) + 1));
  const bool on_face = faces_of_vertex_.Contains(vertex) && !faces_of_vertex_.FindFromKey(vertex).IsEmpty();
  const PointMap map = on_face
                           ? map_.of_face(faces_.FindIndex(faces_of_vertex_.FindFromKey(vertex).First()) - 1)
                           : map_.elsewhere();
  const gp_XYZ at = BRep_Tool::Pnt(vertex).XYZ();
  vertex_[i].point = gp_Pnt(map(at));
  // The pcurves of its edges stay as they are, and so does what its tolerance covers: where they cross beside it.
  vertex_[i].tolerance = BRep_Tool::Tolerance(vertex) * stretch_at(map, at, kStep * options_.spacing);
}

// A vertex is where its edges end: in the mean of those that were fitted, or of those that stayed what they were. At a pole
// of a surface it is the pole: edges that end beside it pass it, where parameters turn about, and meshers (gmsh) do not come
// to an end there. Fitted ones then end in it, to the last digit: readers of STEP look for a vertex along its curves, and
// one beside the seam of a closed curve cuts that curve there, which OpenCASCADE takes for no length at all.
void DeformedGeometry::join_ends() {
  struct Ends {
    gp_XYZ kept{0, 0, 0}, pole{0, 0, 0}, fitted{0, 0, 0};
    int kept_count = 0, pole_count = 0, fitted_count = 0;
  };
  std::vector<Ends> ends(vertex_.size());
  const auto for_ends = [&](std::size_t i, const auto& act) {
    TopoDS_Vertex vertices[2];
    TopExp::Vertices(TopoDS::Edge(edges_(static_cast<Standard_Integer>(i) + 1).Oriented(TopAbs_FORWARD)),
                     vertices[0], vertices[1]);
    for (int end = 0; end < 2; ++end)
      if (!vertices[end].IsNull())
        act(static_cast<std::size_t>(vertices_.FindIndex(vertices[end]) - 1), end == 0);
  };
  for (std::size_t i = 0; i < edge_.size(); ++i) {
    const TopoDS_Shape& shape = edges_(static_cast<Standard_Integer>(i) + 1);
    const bool pole = BRep_Tool::Degenerated(TopoDS::Edge(shape));
    const std::vector<OnFace> faces = pole ? on_faces(shape) : std::vector<OnFace>();
    for_ends(i, [&](std::size_t v, bool first) {
      for (const OnFace& face : faces) {
        ends[v].pole += face.at(first ? 0 : 1);
        ++ends[v].pole_count;
      }
      if (edge_[i].curve.IsNull()) return;
      const gp_XYZ at = edge_[i].curve->Value(first ? edge_[i].begin : edge_[i].end).XYZ();
      (edge_[i].kept ? ends[v].kept : ends[v].fitted) += at;
      ++(edge_[i].kept ? ends[v].kept_count : ends[v].fitted_count);
    });
  }
  for (std::size_t v = 0; v < vertex_.size(); ++v)
    if (ends[v].kept_count > 0)
      vertex_[v].point = gp_Pnt(ends[v].kept / ends[v].kept_count);
    else if (ends[v].pole_count > 0)
      vertex_[v].point = gp_Pnt(ends[v].pole / ends[v].pole_count);
    else if (ends[v].fitted_count > 0)
      vertex_[v].point = gp_Pnt(ends[v].fitted / ends[v].fitted_count);
  for (std::size_t i = 0; i < edge_.size(); ++i)
    if (const auto spline = Handle(Geom_BSplineCurve)::DownCast(edge_[i].curve);
        !edge_[i].kept && !spline.IsNull())
      for_ends(i, [&](std::size_t v, bool first) {
        spline->SetPole(first ? 1 : spline->NbPoles(), vertex_[v].point);
      });
}

// An edge's covers the gaps to the surfaces that meet in it, a vertex's those of its edges. Looked at in every span of
// knots, where the gaps have their maxima.
void DeformedGeometry::widen_tolerances() {
  constexpr double kMargin = 1.1;
  constexpr int kLeastPoints = 64, kPointsASpan = 8;
  for (std::size_t i = 0; i < edge_.size(); ++i) {
    DeformedEdge& edge = edge_[i];
    const TopoDS_Shape shape = edges_(static_cast<Standard_Integer>(i) + 1).Oriented(TopAbs_FORWARD);
    TopoDS_Vertex ends[2];
    TopExp::Vertices(TopoDS::Edge(shape), ends[0], ends[1]);
    const auto widen = [&](int end, double distance) {
      if (ends[end].IsNull()) return;
      DeformedVertex& vertex = vertex_[vertices_.FindIndex(ends[end]) - 1];
      vertex.tolerance = std::max(vertex.tolerance, kMargin * distance + 1e-9);
    };
    for (const OnFace& face : on_faces(shape)) {
      int points = kLeastPoints;
      if (const auto spline = Handle(Geom_BSplineSurface)::DownCast(face.surface.Surface()); !spline.IsNull())
        points = std::max(points, kPointsASpan * std::max(spline->NbUKnots(), spline->NbVKnots()));
      for (int p = 0; p <= points; ++p) {
        const double share = static_cast<double>(p) / points;
        const gp_Pnt on(face.at(share));
        if (edge.curve.IsNull()) {  // all of it is at its vertex
          if (!ends[0].IsNull()) {
            const double distance = on.Distance(vertex_[vertices_.FindIndex(ends[0]) - 1].point);
            widen(0, distance);
            edge.gap = std::max(edge.gap, kMargin * distance);
          }
          continue;
        }
        const gp_Pnt along = edge.curve->Value(edge.begin + share * (edge.end - edge.begin));
        edge.gap = std::max(edge.gap, kMargin * along.Distance(on) + 1e-9);
        if (p != 0 && p != points) continue;
        const int end = p == 0 ? 0 : 1;
        if (ends[end].IsNull()) continue;
        const gp_Pnt& point = vertex_[vertices_.FindIndex(ends[end]) - 1].point;
        widen(end, std::max(along.Distance(point), on.Distance(point)));
      }
    }
  }
  for (std::size_t i = 0; i < edge_.size(); ++i) {
    edge_[i].tolerance = std::max(edge_[i].tolerance, edge_[i].gap);
    TopoDS_Vertex ends[2];
    TopExp::Vertices(TopoDS::Edge(edges_(static_cast<Standard_Integer>(i) + 1)), ends[0], ends[1]);
    for (const TopoDS_Vertex& end : ends) {
      if (end.IsNull()) continue;
      DeformedVertex& vertex = vertex_[vertices_.FindIndex(end) - 1];
      vertex.tolerance = std::max(vertex.tolerance, edge_[i].tolerance);
    }
  }
}

double DeformedGeometry::widest_gap() const {
  double widest = 0;
  for (const DeformedEdge& edge : edge_) widest = std::max(widest, edge.gap);
  return widest;
}

const DeformedFace* DeformedGeometry::find_face(const TopoDS_Shape& face) const {
  const Standard_Integer i = faces_.FindIndex(face);
  return i == 0 ? nullptr : &face_[i - 1];
}
const DeformedEdge* DeformedGeometry::find_edge(const TopoDS_Shape& edge) const {
  const Standard_Integer i = edges_.FindIndex(edge);
  return i == 0 ? nullptr : &edge_[i - 1];
}
const DeformedVertex* DeformedGeometry::find_vertex(const TopoDS_Shape& vertex) const {
  const Standard_Integer i = vertices_.FindIndex(vertex);
  return i == 0 ? nullptr : &vertex_[i - 1];
}

}  // namespace flexel::cad
