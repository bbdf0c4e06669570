// CAD files are meshed from their own geometry, all in one run of gmsh; a mesh is written part by part as
// STL, which gmsh cuts into faces and parametrises. A surface of gmsh is identified with the CAD face whose
// polygons, with normals on the same side, are nearest to most of its triangles' centres.
#include "flexel/export/tet_mesh.h"
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/files/temporary_folder.h"
#include "base/math/distance.h"
#include "base/program/progress_stretch.h"
#include "flexel/export/gmsh.h"
#include "flexel/export/mesh.h"
#include "formats/common/file_formats.h"
#include "formats/exchange/surface_file.h"

namespace flexel::mesh_export {
namespace {

constexpr double kRegionAngle = 30;   // degrees, as for the faces of meshes (formats/part/surface.h)
constexpr std::size_t kSamples = 25;  // triangles of a surface that decide which face it is
constexpr double kTetFacing = 0.3;    // cosine
constexpr double kBoxTolerance = 0.02;

std::string settings(const TetrahedraOptions& options, double unit) {
  return fmt::format(
      "Mesh.MeshSizeMax = {:.12g};\nMesh.MeshSizeExtendFromBoundary = 1;\nMesh.ElementOrder = 2;\n"
      "Mesh.HighOrderOptimize = 1;\nMesh.SaveAll = 1;\nGeneral.NumThreads = {};\n",
      options.size / unit, std::max(1, options.threads));
}

// The polygons of one part as a surface of its own.
Surface part_surface(const Surface& surface, std::uint32_t part) {
  Surface one;
  one.vertices = surface.vertices;
  one.parts = {surface.parts[part]};
  one.faces = {{"", 0}};
  one.part_source = {0};
  one.sources = {surface.sources[surface.part_source[part]]};
  one.sources[0].bytes.clear();
  one.polygon_offsets = {0};
  for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
    if (surface.polygon_part(p) != part) continue;
    const auto corners = surface.polygon(p);
    one.polygon_vertices.insert(one.polygon_vertices.end(), corners.begin(), corners.end());
    one.polygon_offsets.push_back(static_cast<std::uint32_t>(one.polygon_vertices.size()));
    one.polygon_face.push_back(0);
  }
  return one;
}

// Meshes from gmsh in metres, one after the other.
void append(GmshMesh& all, const GmshMesh& one, double unit) {
  const auto nodes = static_cast<std::uint32_t>(all.nodes.size());
  int surfaces = 0, volumes = 0;
  for (const GmshTriangle& each : all.triangles) surfaces = std::max(surfaces, each.surface);
  for (const GmshTetrahedron& each : all.tetrahedra) volumes = std::max(volumes, each.volume);
  for (const Vec3& each : one.nodes) all.nodes.push_back(unit * each);
  for (GmshTriangle each : one.triangles) {
    for (std::uint32_t& node : each.nodes) node += nodes;
    each.surface += surfaces;
    all.triangles.push_back(each);
  }
  for (GmshTetrahedron each : one.tetrahedra) {
    for (std::uint32_t& node : each.nodes) node += nodes;
    each.volume += volumes;
    all.tetrahedra.push_back(each);
  }
}

// Of the parts that gmsh meshes one after another: a CAD file is one, a mesh has its own.
std::size_t gmsh_runs(const Surface& surface) {
  std::size_t runs = 0;
  for (const SurfaceSource& source : surface.sources) runs += is_cad(source) ? 1 : 0;
  for (const std::uint32_t source : surface.part_source) runs += is_cad(surface.sources[source]) ? 0 : 1;
  return runs;
}

GmshMesh mesh_all(const std::vector<std::string>& paths, const Surface& surface,
                  const TetrahedraOptions& options, Progress& progress) {
  GmshMesh all;
  const double runs = static_cast<double>(gmsh_runs(surface));
  double run = 0;
  const auto mesh = [&](const TemporaryFolder& folder, const std::string& script, const std::string& part) {
    ProgressStretch stretch(progress, run / runs, (run + 1) / runs);
    ++run;
    return mesh_with_gmsh(folder.path().string(), script, part, stretch.inner());
  };
  for (std::size_t s = 0; s < surface.sources.size(); ++s) {
    const SurfaceSource& source = surface.sources[s];
    if (is_cad(source)) {
      if (paths[s] == "-")
        throw InputError("--mesh tet: gmsh reads the part's file itself; give the file, not stdin");
      const TemporaryFolder folder;
      const std::string name = "part." + source.format;
      std::filesystem::create_symlink(std::filesystem::absolute(paths[s]), folder.path() / name);
      // gmsh reads STEP and IGES in millimetres, BREP as it is
      const double unit = carries_unit(source) ? 1e-3 : source.unit;
      append(
          all,
          mesh(folder,
               fmt::format("SetFactory(\"OpenCASCADE\");\nMerge \"{}\";\n{}", name, settings(options, unit)),
               source.file),
          unit);
      continue;
    }
    for (std::uint32_t part = 0; part < surface.parts.size(); ++part) {
      if (surface.part_source[part] != s) continue;
      const TemporaryFolder folder;
      const Surface one = part_surface(surface, part);
      write_surface(one, std::vector<Vec3>(one.vertices.size(), Vec3::Zero()), surface_format("stl"), 1e-3,
                    (folder.path() / "part.stl").string());
      append(all,
             mesh(folder,
                  fmt::format("Merge \"part.stl\";\nClassifySurfaces{{{0} * Pi / 180, 1, 1, {0} * Pi "
                              "/ 180}};\nCreateGeometry;\nSurface Loop(1) = Surface{{:}};\nVolume(1) "
                              "= {{1}};\n{1}",
                              kRegionAngle, settings(options, 1e-3)),
                  fmt::format("{}, part \"{}\"", source.file, surface.parts[part].name)),
             1e-3);
    }
  }
  return all;
}

void check_size(const Surface& surface, const GmshMesh& mesh) {
  const Box ours = bounding_box(surface.vertices), theirs = bounding_box(mesh.nodes);
  const double off = std::max((ours.min - theirs.min).norm(), (ours.max - theirs.max).norm());
  if (off > kBoxTolerance * ours.diagonal())
    throw InputError(surface.sources.front().file,
                     fmt::format("gmsh reads it in another place or unit than Flexel: {:.4g} m across, not "
                                 "{:.4g} m; use --mesh hex",
                                 theirs.diagonal(), ours.diagonal()));
}

Vec3 normal_of(const std::vector<Vec3>& at, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return (at[b] - at[a]).cross(at[c] - at[a]).normalized();
}

// The CAD face nearest to the middle of a triangle (outward corners).
std::uint32_t nearest_face(const Surface& surface, const Triangles& triangles, const GmshMesh& mesh,
                           const std::array<std::uint32_t, 3>& corners) {
  const Vec3 middle = (mesh.nodes[corners[0]] + mesh.nodes[corners[1]] + mesh.nodes[corners[2]]) / 3;
  const Vec3 normal = normal_of(mesh.nodes, corners[0], corners[1], corners[2]);
  double least = 1e300;
  std::uint32_t face = 0;
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    const auto& [a, b, c] = triangles.corners[t];
    const auto& x = surface.vertices;
    double away = distance_to_triangle(middle, x[a], x[b], x[c]);
    if (!(away < least)) continue;
    if (normal.dot(normal_of(x, a, b, c)) < kTetFacing) continue;
    least = away;
    face = surface.polygon_face[triangles.polygon[t]];
  }
  return face;
}

// The sides of the tetrahedra that are triangles of the surface, by triangle.
struct SkinSide {
  ElementSide at;
  std::array<std::uint32_t, 3> corners{};  // outward
};

std::vector<SkinSide> find_skin(const GmshMesh& mesh) {
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> triangle_of;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> key;
    std::copy_n(mesh.triangles[t].nodes.begin(), 3, key.begin());
    std::sort(key.begin(), key.end());
    triangle_of[key] = t;
  }
  std::vector<SkinSide> skin(mesh.triangles.size(), SkinSide{{0xffffffffu, 0}, {}});
  for (std::uint32_t e = 0; e < mesh.tetrahedra.size(); ++e)
    for (std::uint8_t s = 0; s < 4; ++s) {
      std::array<std::uint32_t, 3> corners;
      for (std::size_t c = 0; c < 3; ++c) corners[c] = mesh.tetrahedra[e].nodes[kTetrahedronSides[s][c]];
      auto key = corners;
      std::sort(key.begin(), key.end());
      const auto found = triangle_of.find(key);
      if (found != triangle_of.end()) skin[found->second] = {{e, s}, corners};
    }
  return skin;
}

// gmsh's surfaces -> index of the CAD face.
std::map<int, std::uint32_t> name_surfaces(const Surface& surface, const GmshMesh& mesh,
                                           const std::vector<SkinSide>& skin) {
  std::map<int, std::vector<std::uint32_t>> of_surface;
  for (std::uint32_t t = 0; t < skin.size(); ++t)
    if (skin[t].at.element != 0xffffffffu) of_surface[mesh.triangles[t].surface].push_back(t);
  const Triangles triangles = triangulate(surface);
  std::map<int, std::uint32_t> face_of;
  for (const auto& [tag, list] : of_surface) {
    std::map<std::uint32_t, std::size_t> votes;
    const std::size_t stride = std::max<std::size_t>(1, list.size() / kSamples);
    for (std::size_t i = 0; i < list.size(); i += stride)
      ++votes[nearest_face(surface, triangles, mesh, skin[list[i]].corners)];
    face_of[tag] = std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) {
                     return a.second < b.second;
                   })->first;
  }
  return face_of;
}

// The part of each of gmsh's volumes: that of most of its sides.
std::map<int, std::uint32_t> parts_of_volumes(const Surface& surface, const GmshMesh& from,
                                              const std::vector<SkinSide>& skin,
                                              const std::map<int, std::uint32_t>& face_of) {
  std::map<int, std::map<std::uint32_t, std::size_t>> votes;  // volume -> part
  for (std::size_t t = 0; t < skin.size(); ++t)
    if (skin[t].at.element != 0xffffffffu)
      ++votes[from.tetrahedra[skin[t].at.element].volume]
             [surface.faces[face_of.at(from.triangles[t].surface)].part];
  std::map<int, std::uint32_t> part_of;
  for (const auto& [volume, count] : votes)
    part_of[volume] = std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) {
                        return a.second < b.second;
                      })->first;
  return part_of;
}

// The body that selections resolve on, nodes by part; fills the mesh's elements in the same order.
void make_body(const Surface& surface, const GmshMesh& from, AnalysisMesh& mesh) {
  const std::vector<SkinSide> skin = find_skin(from);
  const std::map<int, std::uint32_t> face_of = name_surfaces(surface, from, skin);
  const std::map<int, std::uint32_t> part_of = parts_of_volumes(surface, from, skin, face_of);
  Body& body = mesh.body;
  std::vector<std::uint32_t> number(from.nodes.size(), 0xffffffffu), element(from.tetrahedra.size());
  for (std::uint32_t p = 0; p < surface.parts.size(); ++p) {
    Part part;
    part.name = surface.parts[p].name;
    part.element_begin = static_cast<std::uint32_t>(body.rest.size());
    std::size_t count = 0;
    for (std::uint32_t e = 0; e < from.tetrahedra.size(); ++e) {
      const GmshTetrahedron& each = from.tetrahedra[e];
      const auto found = part_of.find(each.volume);
      if (found == part_of.end() || found->second != p) continue;
      element[e] = static_cast<std::uint32_t>(mesh.section.size());
      for (const std::uint32_t node : each.nodes) {
        if (number[node] == 0xffffffffu) {
          number[node] = static_cast<std::uint32_t>(body.rest.size());
          body.rest.push_back(from.nodes[node]);
        }
        mesh.nodes.push_back(number[node]);
      }
      mesh.section.push_back(static_cast<std::uint32_t>(mesh.sections.size()));
      ++count;
    }
    part.element_end = static_cast<std::uint32_t>(body.rest.size());
    body.parts.push_back(part);
    if (count == 0)
      throw InputError(surface.sources[surface.part_source[p]].file,
                       fmt::format("gmsh's mesh has nothing of part \"{}\"; use --mesh hex", part.name));
    mesh.sections.push_back({p, 1, count});
  }
  body.position = body.rest;
  body.surface.vertices = body.rest;
  body.surface.faces = surface.faces;
  body.surface.parts = surface.parts;
  body.surface.sources = surface.sources;
  body.surface.part_source = surface.part_source;
  body.surface.polygon_offsets = {0};
  mesh.sides.resize(surface.faces.size());
  for (std::size_t t = 0; t < skin.size(); ++t) {
    if (skin[t].at.element == 0xffffffffu) continue;
    const std::uint32_t face = face_of.at(from.triangles[t].surface);
    const ElementSide at{element[skin[t].at.element], skin[t].at.side};
    for (const std::uint32_t node : skin[t].corners) body.surface.polygon_vertices.push_back(number[node]);
    body.surface.polygon_offsets.push_back(static_cast<std::uint32_t>(body.surface.polygon_vertices.size()));
    body.surface.polygon_face.push_back(face);
    mesh.polygon_side.push_back(at);
    mesh.sides[face].push_back(at);
  }
}

}  // namespace

AnalysisMesh tetrahedra(const std::vector<std::string>& paths, const Surface& surface,
                        const TetrahedraOptions& options, Progress& progress) {
  const GmshMesh from = mesh_all(paths, surface, options, progress);
  check_size(surface, from);
  AnalysisMesh mesh;
  mesh.kind = AnalysisMesh::Kind::tetrahedra;
  mesh.nodes_per_element = 10;
  make_body(surface, from, mesh);
  for (std::size_t f = 0; f < mesh.sides.size(); ++f)
    if (mesh.sides[f].empty())
      mesh.notes.push_back(
          fmt::format("face {} of part \"{}\" has no triangle of the mesh: gmsh merged it "
                      "with a neighbour",
                      face_numbers(surface)[f], surface.parts[surface.faces[f].part].name));
  return mesh;
}

}  // namespace flexel::mesh_export
