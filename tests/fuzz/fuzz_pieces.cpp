// Mutated lists of pieces, and the piece of a list of one, raw and compressed, put together. The surface beside it is sound.
#include <numeric>

#include "formats/pieces/join.h"
#include "tests/fuzz/small_body.h"

namespace {

using namespace flexel;

PieceBody small_piece() {
  PieceBody piece;
  piece.body = fuzz::small_body();
  const auto points = static_cast<std::int64_t>(piece.body.element_count());
  piece.numbers = {1, 0, {0, points}};
  piece.global_point.resize(piece.body.element_count());
  std::iota(piece.global_point.begin(), piece.global_point.end(), 0);
  piece.ghost_cells.assign(piece.body.cell_count(), 0);
  return piece;
}

Bytes taken(const std::string& path) {
  const Bytes bytes = read_all(path);
  std::filesystem::remove(path);
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  // Where the mutants lie (trial.cpp), for they name the surface beside them.
  const std::filesystem::path memory = "/dev/shm";
  const std::filesystem::path folder =
      std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
  const std::string list = folder / ("fuzz-pieces-" + std::to_string(getpid()) + ".pvtu");
  PieceBody piece = small_piece();
  const SurfaceBeside surface = write_shared_surface(piece.body, list);
  std::vector<Bytes> corpus;
  for (const bool compress : {false, true}) {
    write_piece_list(list, 1, 1, write_piece(piece, list, surface, compress));
    corpus.push_back(taken(piece_path(list, 0)));
    if (!compress) corpus.push_back(taken(list));
  }
  std::filesystem::remove(list);
  const int code = fuzz::run(argc, argv, "fuzz_pieces", corpus, [&](const std::string& path) {
    const Bytes bytes = read_all(path);
    if (vtu::is_file_of(bytes, "PUnstructuredGrid"))
      (void)read_piece_list(path);
    else
      (void)join_pieces({path, 1, {path}});
  });
  std::filesystem::remove(shared_surface_path(list));
  return code;
}
