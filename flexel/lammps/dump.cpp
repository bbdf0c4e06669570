// ITEM: by ITEM:, as LAMMPS writes them.
#include "flexel/lammps/dump.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "base/stop.h"
#include "flexel/lammps/input_files.h"
#include "formats/part/surface.h"

namespace flexel::lammps {
namespace {

constexpr std::array<const char*, 7> kColumns = {"id", "x", "y", "z", "vx", "vy", "vz"};
constexpr std::size_t kBetweenChecks = 4096;  // lines
constexpr const char* kAtoms = "ITEM: ATOMS";

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> found;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(" \t\r", at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(" \t\r", at), text.size());
    found.push_back(text.substr(at, end - at));
    at = end;
  }
  return found;
}

}  // namespace

DumpReader::DumpReader(const std::string& path, std::size_t elements)
    : path_(path), elements_(elements), file_(path) {
  if (!file_) throw InputError(path, "cannot be read: is it there?");
}

void DumpReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}:{}", path_, line_), what);
}

void DumpReader::fail_cut(const char* at) const {
  fail(fmt::format(
      "the dump ends within a frame, at its {}: LAMMPS was stopped; remove line {} and those behind it", at,
      begin_ + 1));
}

std::string DumpReader::line(const char* of) {
  std::string text;
  if (!std::getline(file_, text) || file_.eof()) fail_cut(of);  // LAMMPS ends every line
  ++line_;
  return text;
}

std::uint64_t DumpReader::whole(const std::string& text, const char* what) const {
  char* end = nullptr;
  errno = 0;
  const std::uint64_t value = std::strtoull(text.c_str(), &end, 10);
  if (end == text.c_str() || *end != '\0' || text.front() == '-' || errno == ERANGE)
    fail(fmt::format("the {} is no whole number: \"{}\"", what, text));
  return value;
}

double DumpReader::number(const std::string& text, const char* what, double largest) const {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0') fail(fmt::format("{} is no number: \"{}\"", what, text));
  if (!(std::abs(value) <= largest))
    fail(fmt::format("{} is \"{}\": the run in LAMMPS broke down; give [run] a shorter step", what, text));
  return value;
}

void DumpReader::read_columns(const std::string& header) {
  const std::vector<std::string> names = words(header.substr(std::string(kAtoms).size()));
  const auto run = std::find_if(names.begin(), names.end(),
                                [](const std::string& name) { return name.starts_with(kRunPrefix); });
  run_ = run == names.end() ? "" : *run;
  columns_ = names.size();
  for (std::size_t c = 0; c < kColumns.size(); ++c) {
    const auto found = std::find(names.begin(), names.end(), kColumns[c]);
    column_[c] = found == names.end() ? -1 : static_cast<int>(found - names.begin());
    if (column_[c] < 0 && c < 4)
      fail(fmt::format("the dump has no column \"{}\": it needs id x y z, and vx vy vz for velocities",
                       kColumns[c]));
  }
  const auto velocities = std::count_if(column_.begin() + 4, column_.end(), [](int c) { return c >= 0; });
  if (velocities != 0 && velocities != 3) fail("of vx vy vz the dump needs all or none");
}

void DumpReader::read_atom(DumpFrame& frame, std::vector<bool>& seen) {
  const std::vector<std::string> values = words(line("atoms"));
  if (values.size() != columns_)
    fail(fmt::format("{} columns, not {}: the line is cut off or of another dump", values.size(), columns_));
  const auto at = [&](std::size_t c) -> const std::string& {
    return values[static_cast<std::size_t>(column_[c])];
  };
  const std::uint64_t id = whole(at(0), "id");
  if (id < 1 || id > elements_) fail(fmt::format("atom {} is none of the body's {} elements", id, elements_));
  if (seen[id - 1]) fail(fmt::format("atom {} is there twice", id));
  seen[id - 1] = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    frame.position[id - 1][i] = number(at(1 + axis), kColumns[1 + axis], kLargestCoordinate);
    if (!frame.velocity.empty()) frame.velocity[id - 1][i] = number(at(4 + axis), kColumns[4 + axis]);
  }
}

void DumpReader::read_atoms(DumpFrame& frame) {
  frame.position.assign(elements_, Vec3::Zero());
  if (column_[4] >= 0) frame.velocity.assign(elements_, Vec3::Zero());
  std::vector<bool> seen(elements_, false);
  for (std::size_t e = 0; e < elements_; ++e) {
    if (e % kBetweenChecks == 0) check_stop();
    read_atom(frame, seen);
  }
}

// What stands below a header "ITEM: NAME".
void DumpReader::read_item(const std::string& name, DumpFrame& frame, std::set<std::string>& items) {
  if (!items.insert(name).second) fail(fmt::format("\"{}\" is there twice in one frame", name));
  const auto only = [&](const char* what) {
    const std::vector<std::string> values = words(line(what));
    if (values.size() != 1) fail(fmt::format("one number is wanted below \"ITEM: {}\"", what));
    return values.front();
  };
  if (name == "ITEM: TIMESTEP") {
    frame.step = whole(only("TIMESTEP"), "TIMESTEP");
  } else if (name == "ITEM: TIME") {
    frame.time = number(only("TIME"), "TIME");
  } else if (name == "ITEM: NUMBER OF ATOMS") {
    if (const std::uint64_t count = whole(only("NUMBER OF ATOMS"), "number of atoms"); count != elements_)
      fail(fmt::format("{} atoms, but the body has {} elements: it is another one's, or LAMMPS lost some",
                       count, elements_));
  } else if (name.starts_with("ITEM: BOX BOUNDS")) {
    for (int axis = 0; axis < 3; ++axis) (void)line("BOX BOUNDS");
  } else if (name == "ITEM: UNITS") {
    if (const std::string units = only("UNITS"); units != "si")
      fail(fmt::format("the dump is in units {}: si is wanted", units));
  } else {
    fail("no line \"ITEM: ...\" that a text dump of LAMMPS has (dump custom)");
  }
}

std::optional<DumpFrame> DumpReader::next() {
  std::string item;
  do {
    begin_ = line_;
    if (!std::getline(file_, item)) {
      if (file_.bad()) throw InputError(path_, "cannot be read to its end");
      return std::nullopt;
    }
    ++line_;
  } while (words(item).empty());
  if (file_.eof()) fail_cut("header");
  DumpFrame frame;
  std::set<std::string> items;
  for (;; item = line("header")) {
    const std::string name = item.substr(0, item.find_last_not_of(" \t\r") + 1);
    if (name != kAtoms && !name.starts_with(std::string(kAtoms) + " ")) {
      read_item(name, frame, items);
      continue;
    }
    for (const char* wanted : {"ITEM: TIMESTEP", "ITEM: NUMBER OF ATOMS"})
      if (!items.contains(wanted)) fail(fmt::format("the frame has no \"{}\"", wanted));
    if (last_ && frame.step <= *last_)
      fail(fmt::format(
          "step {} is not later than step {} of the frame before: the dump holds two runs, or its "
          "frames are out of order",
          frame.step, *last_));
    const std::optional<std::string> before = last_ ? std::optional(run_) : std::nullopt;
    last_ = frame.step;
    read_columns(name);
    if (before && *before != run_) fail("the frame is of another run than the one before");
    read_atoms(frame);
    return frame;
  }
}

}  // namespace flexel::lammps
