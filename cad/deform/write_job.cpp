// The faces of a CAD file and those of the body's surface are in one order: both come from solids_of().
#include "cad/deform/write_job.h"

#include <fmt/format.h>

#include <BRepCheck_Analyzer.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <BRep_Tool.hxx>
#include <Geom_Surface.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/human.h"
#include "base/parallel.h"
#include "cad/deform/cad_tree.h"
#include "cad/deform/deform_shape.h"
#include "cad/deform/deformed_geometry.h"
#include "cad/deform/face_polygons.h"
#include "cad/deform/losses.h"
#include "cad/deform/solid_volume.h"
#include "cad/deform/sphere_frames.h"
#include "cad/deform/write_tree.h"
#include "formats/lattice/body_file.h"
#include "formats/part/surface.h"
#include "mapping/space/space_field.h"
#include "mapping/types/options.h"

namespace flexel::cad {
namespace {

constexpr std::uint32_t kNoFace = 0xffffffffu;
// Of the tolerance: between the points that a fit looks at its error is larger.
constexpr double kFitShare = 0.75;
constexpr int kManyPoints =
    5000;  // of a face: those that a FaceMask finds in it are not looked for in its edges

// What one job works on.
struct Work {
  Body body;
  mapping::SpaceField field;
  FacePolygons polygons;
  std::vector<std::uint32_t> first_face;  // (parts) of Surface::faces
  double tolerance = 0;                   // m
  double expected_volume = 1;             // of the mapped triangles, beside that at rest
  std::size_t loose_faces = 0;            // of no solid
  CadWritten written;

  Work(Body deformed, const CadWriteJob& job)
      : body(std::move(deformed)),
        field(body, mapping::map_method(job.method), job.scale),
        polygons(body),
        first_face(body.parts.size(), kNoFace) {
    for (std::uint32_t f = 0; f < body.surface.faces.size(); ++f) {
      std::uint32_t& first = first_face[body.surface.faces[f].part];
      if (first == kNoFace) first = f;
    }
    tolerance = job.tolerance;
    expected_volume = job.volume;
    written.tolerance = tolerance;
  }
};

// Where a face of a shape is in the body.
struct FacePlace {
  std::uint32_t part = 0, face = kNoFace;
};

// The deformation in the coordinates of one node's shape.
class NodeMap {
 public:
  NodeMap(const Work& work, const gp_Trsf& to_world, double unit)
      : work_(work), to_world_(to_world), from_world_(to_world.Inverted()), unit_(unit) {}
  void set_places(std::vector<FacePlace> places, std::uint32_t loose_part) {
    places_ = std::move(places);
    loose_part_ = loose_part;
  }
  // m
  [[nodiscard]] Vec3 at_rest(const gp_XYZ& point) const {
    gp_XYZ world = point;
    to_world_.Transforms(world);
    return Vec3(world.X() * unit_, world.Y() * unit_, world.Z() * unit_);
  }
  [[nodiscard]] PointMap of_face(std::size_t face) const { return of(places_[face]); }
  [[nodiscard]] PointMap elsewhere() const { return of({loose_part_, kNoFace}); }
  [[nodiscard]] const FacePlace& place(std::size_t face) const { return places_[face]; }

 private:
  [[nodiscard]] PointMap of(const FacePlace& place) const {
    return [this, place,
            probe = std::make_shared<mapping::SpaceField::Probe>(work_.field)](const gp_XYZ& point) {
      const Vec3 x = at_rest(point);
      const Vec3 moved = probe->at(x, place.part, work_.polygons.nearest(place.face, x)) / unit_;
      if (!moved.allFinite())
        throw InputError("the deformation is not finite at a point of a face: its numbers are too large");
      gp_XYZ back(moved.x(), moved.y(), moved.z());
      from_world_.Transforms(back);
      return back;
    };
  }
  const Work& work_;
  gp_Trsf to_world_, from_world_;
  double unit_;
  std::vector<FacePlace> places_;
  std::uint32_t loose_part_ = 0;
};

// The part that has the element nearest to a point (m, at rest).
std::uint32_t nearest_part(const Work& work, const Vec3& x) {
  std::uint32_t best = 0;
  double least = 1e300;
  for (std::uint32_t part = 0; part < work.body.parts.size(); ++part)
    for (std::uint32_t e = work.body.parts[part].element_begin; e < work.body.parts[part].element_end; ++e)
      if (const double distance = (work.body.rest[e] - x).squaredNorm(); distance < least) {
        least = distance;
        best = part;
      }
  return best;
}

// That of a shape's first vertex.
std::uint32_t nearest_part(const Work& work, const NodeMap& map, const TopoDS_Shape& shape) {
  const TopExp_Explorer vertex(shape, TopAbs_VERTEX);
  return vertex.More()
             ? nearest_part(work, map.at_rest(BRep_Tool::Pnt(TopoDS::Vertex(vertex.Current())).XYZ()))
             : 0;
}

// (faces of the shape) Where each is in the body.
std::vector<FacePlace> places_of(Work& work, const CadNode& node, const NodeMap& map,
                                 const std::vector<std::uint32_t>& part_of_solid, const std::string& where) {
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(node.shape, TopAbs_FACE, faces);
  std::vector<FacePlace> places(faces.Extent());
  std::size_t n = 0;
  for (TopExp_Explorer each(node.shape, kind_of_solids(node.shape)); each.More(); each.Next(), ++n) {
    if (node.solids[n] == kNoSolid) continue;
    const std::uint32_t part = part_of_solid[node.solids[n]];
    TopTools_IndexedMapOfShape own;
    TopExp::MapShapes(each.Current(), TopAbs_FACE, own);
    const auto in_body = static_cast<Standard_Integer>(
        std::count_if(work.body.surface.faces.begin(), work.body.surface.faces.end(),
                      [&](const SurfaceFace& face) { return face.part == part; }));
    if (own.Extent() != in_body)
      throw InputError(
          where, fmt::format("has {} faces where part \"{}\" of the body has {}: the body was made from "
                             "another file",
                             own.Extent(), work.body.parts[part].name, in_body));
    for (Standard_Integer f = 1; f <= own.Extent(); ++f)
      places[faces.FindIndex(own(f)) - 1] = {part, work.first_face[part] + static_cast<std::uint32_t>(f) - 1};
  }
  for (std::size_t f = 0; f < places.size(); ++f) {
    if (places[f].face != kNoFace) continue;
    places[f].part = nearest_part(work, map, faces(static_cast<Standard_Integer>(f) + 1));
    ++work.loose_faces;
  }
  return places;
}

std::string face_name(const Work& work, const FacePlace& place) {
  const std::string& part = work.body.parts[place.part].name;
  return place.face == kNoFace ? part
                               : fmt::format("{}/{}", part, place.face - work.first_face[place.part] + 1);
}

struct FaceCheck {
  double deviation = 0;  // m
  bool folded = false;
};

// Distance from the deformation, at points inside the face that the fit did not use; and whether the deformation
// turns space inside out there.
FaceCheck check_face(const DeformedGeometry& geometry, std::size_t i, const NodeMap& node, double unit,
                     double spacing) {
  FaceCheck found;
  const DeformedFace& moved = geometry.face(i);
  const TopoDS_Face face =
      TopoDS::Face(geometry.faces()(static_cast<Standard_Integer>(i) + 1).Oriented(TopAbs_FORWARD));
  const Handle(Geom_Surface) before = BRep_Tool::Surface(face);
  const PointMap map = node.of_face(i);
  const FaceDomain& d = moved.domain;
  const double step = 1e-3 * spacing;
  const auto difference = [&](const gp_XYZ& x, const gp_XYZ& by) { return map(x + by) - map(x - by); };
  // Two a spacing, in a sequence that fills the face evenly (M. Roberts' R2, from the plastic number).
  const double wanted = 4 * moved.u_length * moved.v_length / (spacing * spacing);
  const int points = static_cast<int>(std::clamp(wanted, 200.0, 50'000.0));
  BRepTopAdaptor_FClass2d trimmed(face, 1e-6);
  std::optional<FaceMask> mask;
  if (points > kManyPoints) mask.emplace(face, d);
  // The mask does not know what is thinner than its cells, and the fit asked the same mask: where it says "outside", the
  // edges themselves decide.
  const auto is_inside = [&](double u, double v) {
    return (mask && mask->has(u, v)) || trimmed.Perform(gp_Pnt2d(u, v)) == TopAbs_IN;
  };
  for (int n = 1; n <= points; ++n) {
    const double u = d.u_begin + (d.u_end - d.u_begin) * std::fmod(0.5 + 0.7548776662466927 * n, 1.0);
    const double v = d.v_begin + (d.v_end - d.v_begin) * std::fmod(0.5 + 0.5698402909980532 * n, 1.0);
    if (!is_inside(u, v)) continue;
    const gp_XYZ x = before->Value(u, v).XYZ();
    found.deviation = std::max(found.deviation, unit * (moved.surface->Value(u, v).XYZ() - map(x)).Modulus());
    if (n % 4 != 0) continue;
    const gp_XYZ dx = difference(x, gp_XYZ(step, 0, 0)), dy = difference(x, gp_XYZ(0, step, 0)),
                 dz = difference(x, gp_XYZ(0, 0, step));
    found.folded = found.folded || !(dx.DotCross(dy, dz) > 0);
  }
  return found;
}

// Faces without a surface, misses, folds.
void judge_faces(Work& work, const DeformedGeometry& geometry, const NodeMap& map, double unit,
                 double spacing) {
  const auto count = static_cast<std::size_t>(geometry.faces().Extent());
  std::vector<FaceCheck> checks(count);
  for (std::size_t i = 0; i < count; ++i)
    if (geometry.face(i).surface.IsNull())
      throw InputError(fmt::format("face {} cannot be deformed: no surface goes through its points",
                                   face_name(work, map.place(i))));
  parallel_for_each(
      count, [&](std::size_t i) { checks[i] = check_face(geometry, i, map, unit, spacing); }, 1);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = face_name(work, map.place(i));
    const double deviation = std::max(checks[i].deviation, unit * geometry.face(i).error);
    ++work.written.faces;
    work.written.kept += geometry.face(i).kept;
    if (deviation > work.written.deviation) {
      work.written.deviation = deviation;
      work.written.deviation_face = name;
    }
    if (deviation > work.tolerance) work.written.missed.push_back({name, deviation});
    if (checks[i].folded) work.written.folded.push_back(name);
  }
}

// Solids before and after are in one order.
void judge_solids(Work& work, const CadNode& node, const TopoDS_Shape& after,
                  const std::vector<std::uint32_t>& part_of_solid, double unit) {
  TopExp_Explorer old_solid(node.shape, kind_of_solids(node.shape)), new_solid(after, kind_of_solids(after));
  for (std::size_t n = 0; n < node.solids.size() && old_solid.More(); ++n, old_solid.Next()) {
    if (node.solids[n] == kNoSolid) {
      if (new_solid.More()) new_solid.Next();
      continue;
    }
    const std::string& name = work.body.parts[part_of_solid[node.solids[n]]].name;
    ++work.written.solids;
    if (!new_solid.More()) {
      work.written.invalid.push_back(name);
      continue;
    }
    if (!BRepCheck_Analyzer(new_solid.Current()).IsValid()) {
      work.written.invalid.push_back(name);
      if (!BRepCheck_Analyzer(old_solid.Current()).IsValid()) work.written.invalid_before.push_back(name);
    }
    const Volumes volumes = volumes_of(old_solid.Current(), new_solid.Current(), work.expected_volume);
    work.written.volume += unit * unit * unit * std::abs(volumes.after);
    work.written.volume_before += unit * unit * unit * std::abs(volumes.before);
    if (!(volumes.after * volumes.before > 0) &&
        (work.written.invalid.empty() || work.written.invalid.back() != name))
      work.written.invalid.push_back(name);  // inside out
    new_solid.Next();
  }
}

// No pole of a sphere is left at a corner of a face.
void turn_spheres_of(CadNode& node) {
  const TurnedShape turned = turn_spheres(node.shape);
  for (StyledShape& styled : node.styled) styled.shape = turned.image(styled.shape);
  node.shape = turned.shape;
}

void deform_node(Work& work, CadNode& node, const TopLoc_Location& here, double unit,
                 const std::vector<std::uint32_t>& part_of_solid, const std::string& where) {
  turn_spheres_of(node);
  NodeMap map(work, here.Transformation(), unit);
  const std::uint32_t part = nearest_part(work, map, node.shape);
  map.set_places(places_of(work, node, map, part_of_solid, where), part);
  FitOptions options;
  options.tolerance = kFitShare * work.tolerance / unit;
  options.spacing = work.body.parts[part].lattice.spacing.minCoeff() / unit;
  const ShapeMap shape_map{[&](std::size_t face) { return map.of_face(face); },
                           [&] { return map.elsewhere(); }};
  const DeformedGeometry geometry(node.shape, shape_map, options);
  judge_faces(work, geometry, map, unit, options.spacing);
  work.written.gap = std::max(work.written.gap, unit * geometry.widest_gap());
  DeformedShape deformed = deform_shape(node.shape, geometry);
  judge_solids(work, node, deformed.shape, part_of_solid, unit);
  for (StyledShape& styled : node.styled) styled.shape = deformed.image(styled.shape);
  std::erase_if(node.styled, [](const StyledShape& styled) { return styled.shape.IsNull(); });
  node.shape = deformed.shape;
}

void deform_nodes(Work& work, std::vector<CadNode>& nodes, const TopLoc_Location& above, double unit,
                  const std::vector<std::uint32_t>& part_of_solid, const std::string& where) {
  for (CadNode& node : nodes) {
    const TopLoc_Location here = above * node.location;
    if (node.shape.IsNull())
      deform_nodes(work, node.children, here, unit, part_of_solid, where);
    else
      deform_node(work, node, here, unit, part_of_solid, where);
  }
}

// What of a source does not come out.
void tell_losses(const CadTree& tree, const SurfaceSource& source, const std::vector<std::string>& formats,
                 const Warn& warn) {
  if (source.format == "step")
    if (const std::string pmi = pmi_of(source.bytes); !pmi.empty())
      warn(fmt::format("{} of {} do not come along: they are of the shape as it was", pmi, source.file));
  for (const std::string& format : formats)
    if (const std::string lost = no_room_for(tree, format); !lost.empty())
      warn(fmt::format("{} of {} do not come along: {} has no room for them; STEP has", lost, source.file,
                       format == "brep" ? "BREP" : "IGES"));
}

CadTree deformed_source(Work& work, std::uint32_t index, const std::vector<std::string>& formats,
                        const Warn& warn) {
  const SurfaceSource& source = work.body.surface.sources[index];
  if (source.bytes.empty() || (source.format != "step" && source.format != "iges" && source.format != "brep"))
    throw InputError(source.file,
                     fmt::format("has no CAD faces to be deformed (it is {}): write a mesh (STL, OBJ, "
                                 "...), or start from a CAD file",
                                 source.format));
  CadReadJob job;
  job.format = source.format;
  job.bytes = source.bytes;
  job.where = job.file = source.file;
  job.unit = source.unit;
  const bool has_unit =
      std::any_of(formats.begin(), formats.end(), [](const std::string& format) { return format != "brep"; });
  CadTree tree = read_tree(job, has_unit);
  std::vector<std::uint32_t> part_of_solid;
  for (std::uint32_t part = 0; part < work.body.parts.size(); ++part)
    if (work.body.surface.part_source[part] == index) part_of_solid.push_back(part);
  if (part_of_solid.size() != tree.solids)
    throw InputError(source.file,
                     fmt::format("holds {} solids where the body has {} parts of it: write a mesh instead",
                                 tree.solids, part_of_solid.size()));
  tell_losses(tree, source, formats, warn);
  deform_nodes(work, tree.roots, TopLoc_Location(), tree.unit, part_of_solid, source.file);
  return tree;
}

// What was written has to be what was meant: as many solids, valid ones.
void read_again(const CadWritten& written, CadFile& file, const std::string& format, double unit) {
  CadReadJob job;
  job.format = format;
  job.bytes = file.bytes;
  job.where = job.file = "the file written";
  job.unit = unit;
  const CadShape back = read_shape(job, {});
  const std::vector<TopoDS_Shape> solids = solids_of(*back.shape, job.where);
  if (solids.size() != written.solids)
    throw InputError(
        fmt::format("the {} file, read again, holds {} solids instead of {}: write another format", format,
                    solids.size(), written.solids));
  const auto sum = [&](double (*volume)(const TopoDS_Shape&)) {  // m^3
    double found = 0;
    for (const TopoDS_Shape& solid : solids)
      found += back.unit * back.unit * back.unit * std::abs(volume(solid));
    return found;
  };
  const auto is_right = [&](double volume) {
    return std::abs(volume - written.volume) <= 5e-3 * written.volume;
  };
  for (const TopoDS_Shape& solid : solids) file.invalid_again += !BRepCheck_Analyzer(solid).IsValid();
  if (is_right(sum(quick_volume))) return;
  if (const double volume = sum(mesh_volume); !is_right(volume))
    throw InputError(
        fmt::format("the {} file, read again, encloses {:.6g} m^3 instead of {:.6g}: write another format",
                    format, volume, written.volume));
}

}  // namespace

CadWritten write_deformed(const CadWriteJob& job, const Warn& warn) {
  Work work(read_body(job.body, "the body"), job);
  std::vector<CadTree> trees;
  for (std::uint32_t s = 0; s < work.body.surface.sources.size(); ++s)
    trees.push_back(deformed_source(work, s, job.formats, warn));
  if (trees.empty()) throw InputError("the body carries no surface: its part is not known");
  for (const CadTree& tree : trees)
    if (tree.unit != trees.front().unit)
      throw InputError("its parts come in different units, and BREP has none of its own: write STEP");
  if (work.loose_faces > 0)
    warn(fmt::format("{} in no solid {} along with the part that is nearest",
                     counted(work.loose_faces, "face"), work.loose_faces == 1 ? "goes" : "go"));
  for (const std::string& format : job.formats) {
    CadFile file{write_tree(trees, format)};
    read_again(work.written, file, format, trees.front().unit);
    work.written.files.push_back(std::move(file));
  }
  return std::move(work.written);
}

}  // namespace flexel::cad
