// What users would pick instead: the same part and scene meshed by gmsh and run
// by CalculiX, through `flexel export --calculix --mesh tet`. For `flexel study
// --against calculix`.
#pragma once
#include <string>

#include "flexel/study/runner.h"

namespace flexel::study {

// The path of a program on PATH; "" where it is not there.
[[nodiscard]] std::string find_program(const std::string& name);

// Exports, and runs ccx at tetrahedra with edges up to `size` [m], on one
// thread. The result's quantities are named as those of Flexel's own runs:
// probes, "largest displacement", "reaction NAME"; cells are tetrahedra,
// elements are nodes, memory is the larger of the two programs'. wall and cpu
// hold both; the stages are "voxelize" (export with gmsh's meshing) and "solve"
// (ccx). A run that fails, a program that is not installed too, is a result
// with `failure`. Throws Interrupted.
[[nodiscard]] RunResult run_calculix(const Case& study, double size, const RunOptions& options);

}  // namespace flexel::study
