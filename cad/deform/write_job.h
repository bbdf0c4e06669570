// A deformed body's CAD files, deformed: the job of flexel-cad that writes.
#pragma once
#include "cad/read/occt.h"
#include "formats/cad/cad_job.h"

namespace flexel::cad {

// Every face of the sources follows the mapped deformation; their topology, names, colours, layers and assemblies stay.
// What was made is measured at points that the fit did not use, checked, and read again. Throws InputError: a source
// that is no CAD file or is not the one that the body was made from; a method that is not smooth. `tell`: how much is
// done, from any thread.
[[nodiscard]] CadWritten write_deformed(const CadWriteJob& job, const Warn& warn, const TellShare& tell = {});

}  // namespace flexel::cad
