// Carving removes whole voxels, so the cut runs between voxels, not between elements. The cutting code is
// given a body whose elements are the voxels, with the carved ones as a fragment. An element of that body and
// an octant of it stand for a cell and its corner.
#include "mapping/crack/crack_carved.h"

#include <algorithm>
#include <sstream>

#include "base/error.h"
#include "mapping/crack/crack.h"
#include "mapping/crack/crack_pieces.h"

namespace flexel::mapping {
namespace {

struct Voxel {
  Index3 index{};
  std::uint32_t origin = kNoBox;  // cell, or element in centre placement; kNoBox: it went
};

// (parts) The voxels that went.
std::vector<std::vector<Voxel>> read_note(const Body& body) {
  std::vector<std::vector<Voxel>> carved(body.parts.size());
  std::istringstream text(body.notes.at(kCarvedNote));
  for (std::size_t part = 0; text >> part;) {
    Voxel voxel;
    if (!(text >> voxel.index[0] >> voxel.index[1] >> voxel.index[2]) || part >= carved.size())
      throw InputError("the body's note \"carved\" is no list of voxels: simulate it again");
    carved[part].push_back(voxel);
  }
  return carved;
}

std::vector<Voxel> voxels_left(const Body& body, const Part& part) {
  std::vector<Voxel> voxels;
  if (part.placement == Placement::centre)
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      voxels.push_back({body.lattice_index[e], e});
  else
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c)
      voxels.push_back({body.lattice_index[body.cell_elements[c][0]], c});
  return voxels;
}

// The body whose elements are the voxels.
struct VoxelBody {
  Body body;
  Components fragments;
  std::vector<std::uint32_t> origin;  // (elements) Voxel::origin
  std::vector<std::uint8_t> carved;   // (fragments)
};

void add_part(const Body& body, const Components& fragments, std::uint32_t p, std::vector<Voxel> voxels,
              VoxelBody& result) {
  const Part& of = body.parts[p];
  for (const Voxel& voxel : voxels_left(body, of)) voxels.push_back(voxel);
  // As elements are sorted.
  std::stable_sort(voxels.begin(), voxels.end(), [](const Voxel& a, const Voxel& b) {
    return std::array{a.index[2], a.index[1], a.index[0]} < std::array{b.index[2], b.index[1], b.index[0]};
  });
  Part& part = result.body.parts.emplace_back(of);
  part.placement = Placement::centre;
  part.cell_begin = part.cell_end = 0;
  part.element_begin = static_cast<std::uint32_t>(result.body.rest.size());
  const auto first = static_cast<std::uint32_t>(result.fragments.list.size());
  const std::uint32_t count = fragments.offset[p + 1] - fragments.offset[p];
  for (std::uint32_t f = 0; f < count; ++f) result.fragments.list.push_back({p, 0});
  bool any = false;
  for (const Voxel& voxel : voxels) {
    std::uint32_t fragment = first + count;
    if (voxel.origin != kNoBox) {
      const std::uint32_t element =
          of.placement == Placement::centre ? voxel.origin : body.cell_elements[voxel.origin][0];
      fragment = first + fragments.of[element] - fragments.offset[p];
    } else if (!any) {
      result.fragments.list.push_back({p, 0});
      any = true;
    }
    ++result.fragments.list[fragment].elements;
    result.fragments.of.push_back(fragment);
    result.origin.push_back(voxel.origin);
    result.body.lattice_index.push_back(voxel.index);
    result.body.rest.push_back(
        of.lattice.to_world(Vec3(voxel.index[0], voxel.index[1], voxel.index[2]) + Vec3::Constant(0.5)));
  }
  part.element_end = static_cast<std::uint32_t>(result.body.rest.size());
  result.fragments.offset.push_back(static_cast<std::uint32_t>(result.fragments.list.size()));
  result.carved.resize(result.fragments.list.size(), 0);
  if (any) result.carved.back() = 1;
}

VoxelBody voxel_body(const Body& body, const Components& fragments) {
  VoxelBody result;
  result.fragments.offset.push_back(0);
  std::vector<std::vector<Voxel>> carved = read_note(body);
  for (std::uint32_t part = 0; part < body.parts.size(); ++part)
    add_part(body, fragments, part, std::move(carved[part]), result);
  result.body.surface = body.surface;
  return result;
}

}  // namespace

bool is_carved_cleanly(const Body& body) {
  return body.notes.count(kCarvedNote) > 0 &&
         std::find(body.broken.begin(), body.broken.end(), 1) == body.broken.end();
}

Components whole_parts(const Body& body) {
  Components fragments;
  fragments.of = element_parts(body);
  fragments.offset.push_back(0);
  for (std::uint32_t part = 0; part < body.parts.size(); ++part) {
    fragments.list.push_back({part, body.parts[part].element_end - body.parts[part].element_begin});
    fragments.offset.push_back(part + 1);
  }
  return fragments;
}

CrackedSurface close_carved(const Body& body, const Components& fragments, CrackMode mode) {
  const VoxelBody voxels = voxel_body(body, fragments);
  CrackOptions options;
  options.mode = mode;
  const Adjacency none{std::vector<std::uint32_t>(voxels.body.element_count() + 1, 0), {}};
  const PartedPairs parted(voxels.body, voxels.fragments, none);
  CrackedSurface cracked = part_surface(voxels.body, voxels.fragments, parted, options);
  // The part's own vertices sit where they always do, others in the cell whose voxel they bound.
  const VertexAnchors own = locate_vertices(body);
  const std::vector<std::uint32_t> part_of = element_parts(voxels.body);
  for (std::size_t v = 0; v < cracked.anchors.anchor.size(); ++v) {
    VertexAnchor& anchor = cracked.anchors.anchor[v];
    const std::uint32_t element = anchor.owner;
    if (v < own.anchor.size())
      anchor = own.anchor[v];
    else if (voxels.origin[element] != kNoBox)  // else it goes
      anchor = {voxels.origin[element], body.parts[part_of[element]].placement == Placement::corner,
                anchor.octant};
  }
  for (CrackPiece& piece : cracked.pieces) piece.debris = voxels.carved[piece.fragment] != 0;
  drop_debris(cracked);
  for (std::size_t part = 0; part < cracked.part_piece.size(); ++part) {
    const std::uint32_t of = cracked.pieces[cracked.part_piece[part]].part;
    if (fragments.in_pieces(of)) continue;
    cracked.surface.parts[part].name = body.surface.parts[of].name;
    cracked.pieces[cracked.part_piece[part]].name = body.surface.parts[of].name;
  }
  return cracked;
}

}  // namespace flexel::mapping
