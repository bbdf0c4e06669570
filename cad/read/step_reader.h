// What reading a STEP file for its solids and for its assemblies share. OpenCASCADE's types are only declared.
#pragma once
#include <functional>

#include "cad/read/occt.h"

class STEPControl_Reader;

namespace flexel::cad {

// Loads the file, has `transfer_roots` make shapes of it, and checks them. Throws InputError: damaged.
[[nodiscard]] TopoDS_Shape transfer_step(STEPControl_Reader& reader, const CadReadJob& job, const Warn& warn,
                                         const std::function<void()>& transfer_roots);

}  // namespace flexel::cad
