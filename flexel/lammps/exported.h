// A timed run in three files: OUT.in, which LAMMPS runs, OUT.data, which that reads, and OUT.vtu, the body
// for flexel import-lammps.
#pragma once
#include <string>
#include <vector>

#include "base/program/progress.h"
#include "flexel/lammps/particles.h"

namespace flexel::lammps {

struct ExportNames {
  std::string script, data, body, dump;  // the dump is LAMMPS's to write
};

// Of "folder/OUT.in". Throws InputError: another ending, or a name that a script cannot hold.
[[nodiscard]] ExportNames export_names(const std::string& script);

// Writes all three, and returns what was written as JSON (docs/guide/export.md). `head` begins the script.
// Throws InputError: see particles_of(); the disk.
[[nodiscard]] std::string export_run(Body& body, const simulate::Scene& scene, const ExportNames& names,
                                     std::vector<std::string> head, Progress& progress);

}  // namespace flexel::lammps
