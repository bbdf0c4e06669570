// Lattices as OpenVDB files.
#pragma once
#include <string>

#include "formats/lattice/body.h"

namespace flexel {

// Writes fill and distances of a body with cells (meshes/vdb_writer.h); flexel-meshes makes the file. Throws InputError for
// a body without cells, and for the disk.
void write_vdb(const Body& body, const std::string& path);

}  // namespace flexel
