// `flexel study --against calculix`: the same part and scene meshed by gmsh and solved by CalculiX, through
// `flexel export --calculix --mesh tet`.
#pragma once
#include <string>
#include <vector>

#include "flexel/study/runs/runner.h"

namespace flexel::study {

// The result of a first, coarse export.
struct CalculixLook {
  std::string refused;            // why CalculiX cannot run this scene here; "": it can
  std::string versions;           // "CalculiX 2.20, gmsh 4.8.4"
  bool large_deflection = false;  // the step gets NLGEOM
  std::string why_deflection;
  std::vector<std::string> warnings;  // what is not exactly as in the scene
};

// Whether the programs are there and the scene has a translation (docs/guide/export.md). Throws Interrupted.
[[nodiscard]] CalculixLook look_at_calculix(const Case& study, const RunOptions& options);

// Exports, and runs ccx, at tetrahedra (C3D10) with edges up to `size` [m], on `threads`. The result's
// quantities are named as those of Flexel's own runs: probes, "largest displacement", "reaction NAME"; cells
// are tetrahedra, elements are nodes. wall and cpu hold both programs; the stages are "voxelize" (export with
// gmsh's meshing) and "solve" (ccx). A run that fails is a result with `failure`. Throws Interrupted.
[[nodiscard]] RunResult run_calculix(const Case& study, double size, bool large_deflection, int threads,
                                     const RunOptions& options);

}  // namespace flexel::study
