// An analysis as an input file of CalculiX (.inp), which Abaqus reads too but for *NODE FILE and *EL FILE.
#pragma once
#include <string>
#include <vector>

#include "flexel/export/analysis.h"

namespace flexel::mesh_export {

struct CalculixOptions {
  std::string element = "C3D8I";  // of hexahedra: "C3D8I" (incompatible modes) or "C3D8"
  std::vector<std::string> head;  // lines of comment at the top
};

// What sets and surfaces are called: "bracket/12" -> N_BRACKET_12 (nodes) and S_BRACKET_12 (element sides).
struct CalculixNames {
  std::vector<std::string> parts, faces, supports, loads, probes;  // without their letter
};
[[nodiscard]] CalculixNames calculix_names(const Analysis& analysis);

// The file's text. Units: mm, N, s, tonne, MPa.
[[nodiscard]] std::string calculix_file(const Analysis& analysis, const CalculixOptions& options);

}  // namespace flexel::mesh_export
