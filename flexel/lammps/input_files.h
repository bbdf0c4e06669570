// The two files that LAMMPS reads: data (atoms, bonds, what each atom carries) and the input script.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "flexel/lammps/particles.h"

namespace flexel::lammps {

// What the script names; it finds them in the folder that LAMMPS runs in.
struct InputNames {
  std::string data, dump;
  std::string run;  // run_name(): a column of the dump; "": it has none
};

// Bonds of one type have the same stiffness, length and damping.
struct BondTypes {
  std::vector<Spring> types;      // ends 0
  std::vector<std::uint32_t> of;  // (springs) index into types
};
[[nodiscard]] BondTypes bond_types(const std::vector<Spring>& springs);

// Atom n + 1 is element n, its molecule 1 + the part, its type says which group of supports it is of, and
// whether loads act on it. Returns a hash of the text. Throws InputError: the disk.
std::uint64_t write_data(const Particles& particles, const BondTypes& types, const std::string& head,
                         const std::string& path);

// The script; lines of `head` become comments. Numbers have all of their digits.
[[nodiscard]] std::string input_script(const Particles& particles, const BondTypes& types,
                                       const std::vector<std::string>& head, const InputNames& names);

// Tells this run from others, also those on the same lattice: "v_flexel" and a hash of what LAMMPS reads. It travels to
// the dump as the name of a column.
constexpr const char* kRunPrefix = "v_flexel";
[[nodiscard]] std::string run_name(std::uint64_t data, const std::string& script);

}  // namespace flexel::lammps
