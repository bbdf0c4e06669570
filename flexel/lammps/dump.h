// LAMMPS's text dumps (dump custom) of what write_data() wrote.
#pragma once
#include <array>
#include <cstdint>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "base/number_range.h"

namespace flexel::lammps {

struct DumpFrame {
  std::uint64_t step = 0;
  std::optional<double> time;  // s; nothing: the dump does not say (dump_modify time yes)
  std::vector<Vec3> position;  // (elements) m
  std::vector<Vec3> velocity;  // (elements) m/s; empty: the dump has none
};

class DumpReader {
 public:
  // Throws InputError: it cannot be read, or is no such dump.
  DumpReader(const std::string& path, std::size_t elements);
  // The next frame; nothing at the end. Throws InputError("FILE:LINE", ...): another number of atoms, an atom
  // twice or not at all, a column that is missing, a number that is none, not finite or beyond kLargestCoordinate, a frame
  // without its step or number of atoms, that ends early or is not later than the one before.
  [[nodiscard]] std::optional<DumpFrame> next();
  // The column that names the run (run_name()) in the last frame; "": none.
  [[nodiscard]] const std::string& run() const { return run_; }

 private:
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_cut(const char* at) const;
  [[nodiscard]] std::string line(const char* of);
  [[nodiscard]] std::uint64_t whole(const std::string& text, const char* what) const;
  [[nodiscard]] double number(const std::string& text, const char* what,
                              double largest = kLargestNumber) const;
  void read_item(const std::string& name, DumpFrame& frame, std::set<std::string>& items);
  void read_columns(const std::string& header);
  void read_atoms(DumpFrame& frame);
  void read_atom(DumpFrame& frame, std::vector<bool>& seen);

  std::string path_;
  std::size_t elements_, line_ = 0, begin_ = 0;  // begin_: the line before the frame's first
  std::optional<std::uint64_t> last_;            // the step of the frame before
  std::ifstream file_;
  // Places of id, x, y, z, vx, vy, vz in a line; -1: it is not there
  std::array<int, 7> column_{};
  std::size_t columns_ = 0;
  std::string run_;
};

}  // namespace flexel::lammps
