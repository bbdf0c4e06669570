// The run: meshes of the parts, a spacing that fits the request and the memory, then part by part lattice,
// classification and assembly.
#include "voxelize/voxelize.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/program.h"
#include "formats/units.h"
#include "voxelize/align.h"
#include "voxelize/assemble.h"
#include "voxelize/classify.h"
#include "voxelize/memory.h"
#include "voxelize/overlap.h"
#include "voxelize/part_mesh.h"
#include "voxelize/vote.h"
#include "voxelize/walls.h"

namespace flexel {
namespace {

constexpr std::size_t kDefaultCount = 20000;

std::vector<PartExtent> extents_of(const std::vector<PartMesh>& meshes) {
  std::vector<PartExtent> extents;
  for (const PartMesh& mesh : meshes)
    extents.push_back({std::abs(enclosed_volume(mesh)), surface_area(mesh)});
  return extents;
}

// Spacing asked for, or that for the count asked for.
double choose_spacing(const VoxelizeOptions& options, const std::vector<PartExtent>& extents) {
  if (options.size) return *options.size;
  return spacing_for_cells(extents, static_cast<double>(options.count.value_or(kDefaultCount)),
                           options.placement);
}

void check_spacing(double spacing, const std::vector<PartMesh>& meshes, const Surface& surface) {
  if (!(spacing > 0) || !std::isfinite(spacing)) throw InputError("the size must be a length above zero");
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    const double longest = bounding_box(meshes[p].world).size().maxCoeff();
    if (spacing > longest)
      throw InputError(fmt::format("size {} is larger than part \"{}\" ({} long); choose a smaller size",
                                   human_length(spacing), surface.parts[p].name, human_length(longest)));
    if (longest / spacing > 1e6)
      throw InputError(fmt::format(
          "size {} would cut part \"{}\" into more than a million cells along one side; choose a larger size",
          human_length(spacing), surface.parts[p].name));
  }
}

void check_memory(double cells, double limit, const std::vector<PartExtent>& extents, Placement placement) {
  const double needed = simulation_memory(cells, placement);
  if (needed <= limit) return;
  const double fitting = spacing_for_cells(extents, limit / simulation_memory(1, placement), placement);
  throw InputError(
      fmt::format("about {} cells need {} to simulate, more than the limit of {}; --size {} would fit, or "
                  "raise --max-memory",
                  human_count(static_cast<std::size_t>(std::min(cells, 1e18))), human_bytes(needed),
                  human_bytes(limit), human_length(1.05 * fitting)));
}

void check_meshes(const std::vector<PartMesh>& meshes, const Surface& surface) {
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    if (meshes[p].corners.empty())
      throw InputError(fmt::format("part \"{}\" has no triangle with an area", surface.parts[p].name));
  }
}

VoxelizedPart describe(const PartMesh& mesh, const Voxels& voxels, const AssembledPart& assembled,
                       const Part& part) {
  VoxelizedPart found;
  const double voxel = part.lattice.spacing.prod();
  found.closed = mesh.balanced();
  found.shells = mesh.shell_count;
  found.lattice_volume = assembled.volume * voxel;
  found.dropped_volume = assembled.dropped_volume * voxel;
  found.cells = assembled.cells;
  found.elements = assembled.elements;
  found.dropped_cells = assembled.dropped_cells;
  found.spacing = part.lattice.spacing;
  found.flipped_triangles = mesh.flipped_triangles;
  found.inverted_shells = mesh.inverted_shells;
  found.cracks_closed = mesh.cracks_closed;
  for (const Slab& slab : voxels.slabs) {
    found.split_voxels += slab.split_voxels;
    found.overlapping_voxels += slab.overlapping_voxels;
    found.undecided_voxels += slab.undecided_voxels;
    found.disagreements += slab.disagreements;
  }
  return found;
}

// Walls of a part: the thinnest, and how many samples are thinner than two cells.
void measure_walls(const PartMesh& mesh, std::uint32_t part, VoxelizedPart& found) {
  constexpr int kLines = 128;
  if (!mesh.balanced()) return;
  const std::vector<WallSample> samples = wall_samples(mesh, kLines);
  if (samples.empty()) return;
  const WallSample& least = samples[thinnest_sample(samples)];
  found.thinnest = ThinWall{least.thickness, least.where, part};
  const double two_cells = 2 * found.spacing.maxCoeff();
  found.thin_walls = static_cast<std::size_t>(std::count_if(
      samples.begin(), samples.end(), [&](const WallSample& s) { return s.thickness < two_cells; }));
}

// What does not depend on the lattice but where shells interpenetrate: volumes and walls.
void measure(const std::vector<PartMesh>& meshes, VoxelizeResult& result) {
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    VoxelizedPart& found = result.parts[p];
    if (found.closed)
      found.surface_volume =
          found.overlapping_voxels > 0 ? union_volume(meshes[p]) : enclosed_volume(meshes[p]);
    result.body.parts[p].surface_volume = found.surface_volume;
    measure_walls(meshes[p], static_cast<std::uint32_t>(p), found);
  }
}

// One part onto the body.
VoxelizedPart voxelize_part(PartMesh& mesh, double spacing, const VoxelizeOptions& options,
                            const std::string& name, Body& body, PolygonCells& polygon_cells) {
  const bool centre = options.placement == Placement::centre;
  Part part;
  part.name = name;
  part.material = options.material;
  part.placement = options.placement;
  part.lattice = align_lattice(mesh, spacing, options.align, centre);
  place_on_lattice(mesh, part.lattice);
  const Voxels voxels =
      mesh.balanced() ? classify_closed(mesh, {.with_centres = centre}) : classify_open(mesh);
  const AssembledPart assembled = assemble_part(voxels, part, body, polygon_cells);
  if (assembled.elements == 0 && !mesh.balanced())
    throw InputError(
        fmt::format("part \"{}\" encloses no volume: its surface is open ({} open edges); close it first",
                    name, human_count(mesh.open_edges)));
  if (assembled.elements == 0)
    throw InputError(fmt::format("nothing of part \"{}\" is left at size {}; choose a smaller size", name,
                                 human_length(spacing)));
  return describe(mesh, voxels, assembled, part);
}

// All parts at one spacing.
VoxelizeResult build(Surface& surface, std::vector<PartMesh>& meshes, double spacing,
                     const VoxelizeOptions& options, Progress& progress) {
  VoxelizeResult result;
  PolygonCells polygon_cells;
  for (std::size_t p = 0; p < meshes.size(); ++p) {
    throw_if_interrupted();
    progress.update(static_cast<double>(p) / static_cast<double>(meshes.size()), surface.parts[p].name);
    result.parts.push_back(
        voxelize_part(meshes[p], spacing, options, surface.parts[p].name, result.body, polygon_cells));
  }
  Body& body = result.body;
  std::swap(body.surface, surface);
  if (options.placement == Placement::corner) {
    set_surface_cells(polygon_cells, body);
    derive_connections(body);
  }
  return result;
}

double total_cells(const VoxelizeResult& result, Placement placement) {
  double total = 0;
  for (const VoxelizedPart& part : result.parts)
    total += static_cast<double>(placement == Placement::corner ? part.cells : part.elements);
  return total;
}

}  // namespace

VoxelizeResult voxelize(Surface surface, const VoxelizeOptions& options, Progress& progress) {
  progress.stage("voxelize");
  std::vector<PartMesh> meshes = part_meshes(surface);
  for (PartMesh& mesh : meshes) repair_orientation(mesh);
  check_meshes(meshes, surface);
  const std::vector<PartExtent> extents = extents_of(meshes);
  const double limit = options.max_memory.value_or(.8 * available_memory());
  double spacing = choose_spacing(options, extents);
  const auto admit = [&] {
    check_spacing(spacing, meshes, surface);
    double cells = 0;
    for (const PartExtent& extent : extents) cells += estimate_cells(extent, spacing, options.placement);
    check_memory(cells, limit, extents, options.placement);
  };
  admit();
  VoxelizeResult result = build(surface, meshes, spacing, options, progress);
  if (!options.size) {
    // The estimate of the count is rough for thin parts: correct it once by what came out.
    const double wanted = static_cast<double>(options.count.value_or(kDefaultCount)),
                 got = total_cells(result, options.placement);
    if (std::abs(got / wanted - 1) > .1) {
      std::swap(surface, result.body.surface);
      spacing = spacing_for_cells(extents, wanted * wanted / got, options.placement);
      admit();
      result = build(surface, meshes, spacing, options, progress);
    }
  }
  const double cells = total_cells(result, options.placement);
  check_memory(cells, limit, extents, options.placement);
  measure(meshes, result);
  result.simulation_memory = simulation_memory(cells, options.placement);
  progress.finish();
  return result;
}

}  // namespace flexel
