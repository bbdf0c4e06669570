// A piece's file is a body file with six arrays more: field data "pieces_run", "pieces_index" and "pieces_points",
// point data "GlobalPointIds", and "vtkGhostType" of points and cells.
#include "formats/pieces/pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "base/error.h"
#include "base/files/named_file.h"
#include "formats/lattice/body_file_names.h"
#include "formats/vtu/pvtu.h"

namespace flexel {
namespace {

using vtu::Section;

std::string without_extension(const std::string& list) {
  return (std::filesystem::path(list).parent_path() / stem(list)).string();
}

// A piece is damaged where its numbers do not fit together: `fail` tells it.
class NumbersChecker {
 public:
  NumbersChecker(const PieceBody& piece, const vtu::File& file) : piece_(piece), file_(file) {}

  void run(const std::vector<std::uint8_t>& ghost_points) const {
    const std::vector<std::int64_t>& first = piece_.numbers.first_point;
    if (first.size() < 2 || first.front() != 0 || !std::is_sorted(first.begin(), first.end()))
      file_.fail(fmt::format("damaged: field data \"{}\" does not ascend from 0", names::pieces_points));
    if (piece_.numbers.index >= piece_.numbers.count())
      file_.fail(fmt::format("damaged: it is piece {} of {}", piece_.numbers.index, piece_.numbers.count()));
    if (piece_.ghost_cells.size() != piece_.body.cell_count())
      file_.fail("damaged: a piece has corner placement, and this one has elements without cells");
    if (std::any_of(piece_.ghost_cells.begin(), piece_.ghost_cells.end(), [](auto g) { return g > 1; }))
      file_.fail(fmt::format("damaged: cell data \"{}\" is not 0 or 1", names::ghost));
    points(ghost_points);
  }

 private:
  // Each once, all of its own among them.
  void points(const std::vector<std::uint8_t>& ghost_points) const {
    const PieceNumbers& numbers = piece_.numbers;
    std::vector<std::int64_t> sorted = piece_.global_point;
    std::sort(sorted.begin(), sorted.end());
    if (!sorted.empty() && (sorted.front() < 0 || sorted.back() >= numbers.first_point.back()))
      file_.fail(fmt::format("damaged: point data \"{}\" has a number out of range", vtu::kGlobalPointIds));
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      file_.fail(fmt::format("damaged: point data \"{}\" has a number twice", vtu::kGlobalPointIds));
    std::int64_t own = 0;
    for (std::size_t e = 0; e < piece_.global_point.size(); ++e) {
      const bool owns = numbers.owns(piece_.global_point[e]);
      own += owns;
      if (ghost_points[e] != !owns)
        file_.fail(
            fmt::format("damaged: point data \"{}\" is not 0 for the points that the piece owns and 1 "
                        "for others",
                        names::ghost));
    }
    if (own != numbers.first_point[numbers.index + 1] - numbers.first_point[numbers.index])
      file_.fail("damaged: a point that the piece owns is not there");
  }

  const PieceBody& piece_;
  const vtu::File& file_;
};

template <class Value>
Value only(const vtu::File& file, const char* name) {
  const std::vector<Value> values = file.read<Value>(Section::field, name);
  if (values.size() != 1)
    file.fail(fmt::format("damaged: field data \"{}\" has {} entries", name, values.size()));
  return values.front();
}

// Whether it is the piece that the list means.
void require_piece(const vtu::File& file, const PieceFiles& files, std::uint32_t index,
                   PieceNumbers& numbers) {
  const std::string name = std::filesystem::path(files.files[index]).filename().string();
  const auto fail = [&](const std::string& what) {
    throw InputError(files.list, fmt::format("its piece {}, \"{}\", {}", index, name, what));
  };
  if (!file.has(Section::field, names::pieces_run))
    fail("is a body of its own and no piece: copy the run's here");
  numbers.run = static_cast<std::uint64_t>(only<std::int64_t>(file, names::pieces_run));
  const std::int32_t is = only<std::int32_t>(file, names::pieces_index);
  numbers.first_point = file.read<std::int64_t>(Section::field, names::pieces_points);
  if (numbers.first_point.size() != files.files.size() + 1)
    fail(fmt::format("is one of {} pieces, and the list has {}: take all files of one run",
                     numbers.first_point.empty() ? 0 : numbers.first_point.size() - 1, files.files.size()));
  if (numbers.run != files.run) fail("is of another run than the list: take all files of one run");
  if (is < 0 || static_cast<std::uint32_t>(is) != index)
    fail(fmt::format("is piece {}: was a file renamed?", is));
  numbers.index = index;
}

}  // namespace

std::uint32_t PieceNumbers::owner(std::int64_t point) const {
  const auto after = std::upper_bound(first_point.begin(), first_point.end(), point);
  return static_cast<std::uint32_t>(after - first_point.begin() - 1);
}

std::string piece_path(const std::string& list, std::uint32_t index) {
  return fmt::format("{}_{}.vtu", without_extension(list), index);
}

std::string shared_surface_path(const std::string& list) {
  return without_extension(list) + "_surface.vtu";
}

PieceFiles read_piece_list(const std::string& path) {
  const Bytes bytes = read_all(path);
  const vtu::PieceList list =
      vtu::parse_pvtu({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path);
  PieceFiles files{path, list.run, {}};
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  for (const std::string& name : list.files) files.files.push_back((folder / name).string());
  return files;
}

std::vector<std::string> files_of(const PieceFiles& files) {
  std::vector<std::string> all = files.files;
  all.push_back(files.list);
  all.push_back(shared_surface_path(files.list));
  // A list that was renamed: the surface has the name of its pieces.
  const std::string& first = files.files.front();
  if (constexpr std::string_view end = "_0.vtu"; first.ends_with(end))
    all.push_back(shared_surface_path(first.substr(0, first.size() - end.size()) + ".pvtu"));
  return all;
}

PieceBody read_piece(const PieceFiles& files, std::uint32_t index) {
  const std::string& path = files.files.at(index);
  refuse_device(path, files.list);
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw InputError(files.list,
                     fmt::format("its piece {} of {}, \"{}\", is missing: copy it beside the list", index,
                                 files.files.size(), std::filesystem::path(path).filename().string()));
  const vtu::File file(read_all(path), path);
  PieceBody piece;
  require_piece(file, files, index, piece.numbers);
  piece.body = read_piece_body(file, path);
  piece.ghost_cells = file.read<std::uint8_t>(Section::cell_data, names::ghost);
  piece.global_point = file.read<std::int64_t>(Section::point_data, vtu::kGlobalPointIds);
  NumbersChecker(piece, file).run(file.read<std::uint8_t>(Section::point_data, names::ghost));
  return piece;
}

SurfaceBeside write_shared_surface(Body& body, const std::string& list, bool compress) {
  const std::string path = shared_surface_path(list);
  Body alone;
  alone.parts = body.parts;
  for (Part& part : alone.parts) part.element_begin = part.element_end = part.cell_begin = part.cell_end = 0;
  alone.notes = body.notes;
  std::swap(alone.surface, body.surface);
  write_body(alone, path, {.compress = compress});
  std::swap(alone.surface, body.surface);
  return shared_surface(body, list);
}

SurfaceBeside shared_surface(const Body& body, const std::string& list) {
  return {std::filesystem::path(shared_surface_path(list)).filename().string(), surface_hash(body.surface)};
}

std::vector<vtu::HeadArray> write_piece(const PieceBody& piece, const std::string& list,
                                        const SurfaceBeside& surface, bool compress) {
  const PieceNumbers& numbers = piece.numbers;
  const std::vector<std::int64_t> run = {static_cast<std::int64_t>(numbers.run)};
  const std::vector<std::int32_t> index = {static_cast<std::int32_t>(numbers.index)};
  const std::vector<vtu::Array> more = {
      vtu::array_of(Section::field, names::pieces_run, run),
      vtu::array_of(Section::field, names::pieces_index, index),
      vtu::array_of(Section::field, names::pieces_points, numbers.first_point),
      vtu::array_of(Section::point_data, vtu::kGlobalPointIds, piece.global_point),
      vtu::made_array<std::uint8_t>(
          Section::point_data, names::ghost, piece.global_point.size(),
          [&piece](std::size_t e) -> std::uint8_t { return !piece.numbers.owns(piece.global_point[e]); }),
      vtu::array_of(Section::cell_data, names::ghost, piece.ghost_cells)};
  return write_piece_body(piece.body, piece_path(list, numbers.index), surface, more, compress);
}

void write_piece_list(const std::string& path, std::uint64_t run, std::uint32_t count,
                      const std::vector<vtu::HeadArray>& arrays) {
  vtu::PieceList list{run, {}};
  for (std::uint32_t index = 0; index < count; ++index)
    list.files.push_back(std::filesystem::path(piece_path(path, index)).filename().string());
  write_text(vtu::pvtu_text(list, arrays), path);
}

std::uint64_t run_number(std::span<const std::uint64_t> made_from) {
  return content_hash(std::as_bytes(made_from));
}

}  // namespace flexel
