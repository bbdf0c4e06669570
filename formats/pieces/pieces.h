// Lattices in pieces: a list (.pvtu) and a body file (.vtu) for each slab of cells along each part's longest axis, with
// one layer of cells of the slabs beside it. docs/reference/pieces.md describes the files.
//
// Points (elements) are numbered over the whole: piece r owns those from first_point[r] to first_point[r + 1] - 1, and
// holds every cell around each of them. Cells of other pieces are ghosts, and so are points that others own.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/lattice/body.h"
#include "formats/lattice/body_file.h"
#include "formats/vtu/vtu_head.h"

namespace flexel {

struct PieceNumbers {
  std::uint64_t run = 0;    // the same in all pieces of one run of a program
  std::uint32_t index = 0;  // of this piece, from 0
  std::vector<std::int64_t>
      first_point;  // (pieces + 1) the first that each piece owns; at the end their number
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(first_point.size() - 1); }
  [[nodiscard]] bool owns(std::int64_t point) const {
    return point >= first_point[index] && point < first_point[index + 1];
  }
  // The piece that owns the point.
  [[nodiscard]] std::uint32_t owner(std::int64_t point) const;
};

struct PieceBody {
  Body body;  // own cells and ghosts, in the order of every body; corner placement
  PieceNumbers numbers;
  std::vector<std::uint8_t> ghost_cells;   // (cells) 1: another piece's
  std::vector<std::int64_t> global_point;  // (elements) its number over the whole
};

// The list and where it lies.
struct PieceFiles {
  std::string list;                // path of the .pvtu
  std::uint64_t run = 0;           // that all pieces carry
  std::vector<std::string> files;  // paths of the pieces
};

// "parts/body.pvtu" -> "parts/body_3.vtu"; "parts/body_surface.vtu", of the surface that all pieces share.
[[nodiscard]] std::string piece_path(const std::string& list, std::uint32_t index);
[[nodiscard]] std::string shared_surface_path(const std::string& list);

// Reads the list alone. Throws InputError: missing, no such list.
[[nodiscard]] PieceFiles read_piece_list(const std::string& path);

// Reads one piece, with the surface. Throws InputError naming list and piece: it is missing, of another run, of another
// number of pieces, another's; or as read_body does.
[[nodiscard]] PieceBody read_piece(const PieceFiles& files, std::uint32_t index);

// Writes the file of the surface of `body`, a body file without elements, under shared_surface_path(list).
[[nodiscard]] SurfaceBeside write_shared_surface(Body& body, const std::string& list, bool compress = false);

// What that returns, of a surface that another process writes.
[[nodiscard]] SurfaceBeside shared_surface(const Body& body, const std::string& list);

// Writes a piece under piece_path(list, its index). `surface`: the file that has the surface, in the same folder.
// Returned are its arrays, which the list declares.
std::vector<vtu::HeadArray> write_piece(const PieceBody& piece, const std::string& list,
                                        const SurfaceBeside& surface, bool compress = false);

// Every file of the run: list, pieces, surface.
[[nodiscard]] std::vector<std::string> files_of(const PieceFiles& files);

// Writes the list of `count` pieces of a run, whose arrays are those of one of them.
void write_piece_list(const std::string& path, std::uint64_t run, std::uint32_t count,
                      const std::vector<vtu::HeadArray>& arrays);

// A run's number from what it is made from.
[[nodiscard]] std::uint64_t run_number(std::span<const std::uint64_t> made_from);

}  // namespace flexel
