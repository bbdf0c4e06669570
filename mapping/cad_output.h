// Writes the part's own CAD file, deformed: exact faces, not triangles.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "formats/lattice/body.h"
#include "mapping/crack/crack.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "mapping/types/result.h"

namespace flexel::mapping {

// Throws InputError: an option that is for meshes, a --tolerance that is none or without a CAD file. Before anything is
// read.
void check_cad_output(const MapArguments& arguments, const CrackOptions& crack, bool any_cad);

// Of a file that was written.
struct CadAnswer {
  std::string line;  // as the programs say it
  std::string json;  // an object (docs/guide/deform.md)
};

// STEP, IGES or BREP of `body`, whose sources hold its CAD files, a file for each of `outputs`: each face is fitted to
// the deformation that `options` name, once for all of them, and what was made is measured, checked, read again and
// told. Throws InputError: a part that is a mesh, or that broke; InvalidMappingError, and nothing is written: a face or
// solid is not as it should be, with --strict. Returns (outputs) what there is to say.
std::vector<CadAnswer> write_cad(const Body& body, const MapReport& found, const MapArguments& arguments,
                                 const MapOptions& options, const std::vector<MapOutput>& outputs,
                                 Progress& progress);

}  // namespace flexel::mapping
