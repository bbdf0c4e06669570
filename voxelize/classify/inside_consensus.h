// Inside and outside of a surface that could not be closed: three ways to tell, and how far they agree.
#pragma once
#include <string>

#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// How far three independent classifiers agree, from samples spread over the lattice. V votes of lines along
// the axes (parity; blind to orientation), D OpenVDB's flood from outside (blind to orientation and to
// cavities), W winding numbers above 1/2 (need orientation, blind to gaps).
struct Agreement {
  double vote = 0, flood = 0, winding = 0;  // volumes, in voxels
  // Shares of the least of the two volumes: samples judged differently, but for those within 3/4 sample of a
  // triangle
  double vote_flood = 0, vote_winding = 0, flood_winding = 0;
  double unsure = 0;  // share of the volume where the winding number is over 0.3 from a whole one, 1.5
                      // samples or more from any triangle
};

struct Sampled {
  Voxels voxels;
  Agreement agreement;  // on the lattice, or on the finer one that was asked where nobody agreed
  enum class By { vote, flood, nobody } by = By::nobody;  // nobody: no two agree, voxels are empty
};

// Two agree when their volumes differ by at most kVolumesDiffer and their samples by at most kSamplesDiffer;
// the winding numbers count as a judge only where they are whole nearly everywhere (`unsure` at most
// kMostUnsure).
constexpr double kVolumesDiffer = .01, kSamplesDiffer = .02, kMostUnsure = .03;

// `mesh` is placed on the lattice; its orientation is what it is. `unanimous`: all three have to agree (where
// a large hole is known: what lies behind it is missed by all that look along straight lines).
[[nodiscard]] Sampled classify_sampled(const PartMesh& mesh, bool unanimous);

}  // namespace flexel::voxelize
