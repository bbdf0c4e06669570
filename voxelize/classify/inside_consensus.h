// Inside and outside of a surface that could not be closed: three classifiers, and how far they agree.
#pragma once
#include <string>

#include "voxelize/classify/voxels.h"
#include "voxelize/mesh/part_mesh.h"

namespace flexel::voxelize {

// How far three independent classifiers agree, at samples spread over the lattice. Vote: parity along the
// axes (ignores orientation). Flood: OpenVDB's flood from outside (ignores orientation and cavities).
// Winding: generalised winding number above 1/2 (needs orientation, tolerates gaps).
struct Agreement {
  double vote = 0, flood = 0, winding = 0;  // volumes, in voxels
  // Samples on which two classifiers differ, but for those within 3/4 sample of a triangle, as a share of the
  // smaller volume
  double vote_flood = 0, vote_winding = 0, flood_winding = 0;
  double unsure = 0;  // share of the volume where the winding number is over 0.3 from a whole one, 1.5
                      // samples or more from any triangle
};

struct Sampled {
  Voxels voxels;
  Agreement agreement;  // on the lattice, or on the finer one where no two agreed on it
  enum class By { vote, flood, nobody } by = By::nobody;  // nobody: no two agree, voxels are empty
};

// Two classifiers agree when their volumes differ by at most kVolumesDiffer and their samples by at most
// kSamplesDiffer. Winding numbers count only where they are nearly whole numbers (`unsure` at most
// kMostUnsure).
constexpr double kVolumesDiffer = .01, kSamplesDiffer = .02, kMostUnsure = .03;

// `mesh` is placed on the lattice; its orientation may be wrong. `unanimous`: all three have to agree (needed
// beside a large hole, where classifiers that follow straight lines err together).
[[nodiscard]] Sampled classify_sampled(const PartMesh& mesh, bool unanimous);

}  // namespace flexel::voxelize
