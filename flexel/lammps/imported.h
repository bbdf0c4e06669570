// A frame of LAMMPS's dump in the body that it came from.
#pragma once
#include <string>

#include "flexel/lammps/dump.h"
#include "formats/lattice/body.h"

namespace flexel::lammps {

constexpr const char* kRunNote = "lammps";  // of a body that goes to LAMMPS: run_name()

// For people, what cannot be told of where a dump comes from, by its name of the run and the body's note; "" where
// nothing is open. Throws InputError(where, ...) where the dump is of another run.
[[nodiscard]] std::string unsure_origin(const std::string& run, const Body& body, const std::string& where);

// Throws InputError(where, ...) where the frame is the start of another run than that of `body`.
void refuse_other_start(const DumpFrame& frame, const Body& body, const std::string& where);

// Positions, and the column "velocity" or none.
void take_frame(const DumpFrame& frame, Body& body);

// Whether matter has turned inside out: by the mean gradient of each cell, or that of an element's neighbours
// in parts of centre placement. Flexel's own run ends there.
[[nodiscard]] bool inside_out(const Body& body);

}  // namespace flexel::lammps
