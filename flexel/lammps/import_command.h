// flexel import-lammps: what LAMMPS made of an exported run, as a body or a series.
#pragma once

namespace flexel::commands {

int import_lammps_command(int argc, char** argv);

}  // namespace flexel::commands
