// One piece is in memory at a time.
#include "flexel/measure/pieces_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/files/json.h"
#include "base/human.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/pieces/pieces.h"

namespace flexel::commands {
namespace {

struct PieceInfo {
  std::string file;
  std::size_t cells = 0, ghost_cells = 0;  // its own, and those of its neighbours
  std::int64_t points = 0;                 // that it owns
};

struct ListInfo {
  std::string run;
  std::vector<PieceInfo> pieces;
  std::vector<Part> parts;
  double displacement = 0;  // m, the largest
};

ListInfo look_at(const std::string& list) {
  const PieceFiles files = read_piece_list(list);
  ListInfo info{fmt::format("{:016x}", files.run), {}, {}, 0};
  for (std::uint32_t index = 0; index < files.files.size(); ++index) {
    check_stop();
    const PieceBody piece = read_piece(files, index);
    PieceInfo each{std::filesystem::path(files.files[index]).filename().string()};
    each.ghost_cells = static_cast<std::size_t>(
        std::count(piece.ghost_cells.begin(), piece.ghost_cells.end(), std::uint8_t{1}));
    each.cells = piece.ghost_cells.size() - each.ghost_cells;
    each.points = piece.numbers.first_point[index + 1] - piece.numbers.first_point[index];
    for (std::size_t e = 0; e < piece.body.element_count(); ++e)
      info.displacement = std::max(info.displacement, (piece.body.position[e] - piece.body.rest[e]).norm());
    info.pieces.push_back(std::move(each));
    if (index == 0) info.parts = piece.body.parts;
  }
  return info;
}

std::string to_json(const ListInfo& info) {
  nlohmann::ordered_json pieces = nlohmann::ordered_json::array(), parts = nlohmann::ordered_json::array();
  for (const PieceInfo& each : info.pieces)
    pieces.push_back({{"file", each.file},
                      {"cells", each.cells},
                      {"ghost_cells", each.ghost_cells},
                      {"points", each.points}});
  for (const Part& part : info.parts) {
    const Vec3& spacing = part.lattice.spacing;
    parts.push_back({{"name", part.name}, {"spacing", {spacing.x(), spacing.y(), spacing.z()}}});
  }
  const nlohmann::ordered_json json = {
      {"run", info.run}, {"largest_displacement", info.displacement}, {"parts", parts}, {"pieces", pieces}};
  return json_text(json, 2) + "\n";
}

std::string to_text(const ListInfo& info, const std::string& list) {
  std::size_t cells = 0;
  std::int64_t points = 0;
  for (const PieceInfo& each : info.pieces) {
    cells += each.cells;
    points += each.points;
  }
  std::string text =
      fmt::format("{}: {} of run {}: {} and {}, displaced by up to {}\n", list,
                  counted(info.pieces.size(), "piece"), info.run, counted(cells, "cell"),
                  counted(static_cast<std::size_t>(points), "element"), human_length(info.displacement));
  for (const Part& part : info.parts)
    text += fmt::format("  part \"{}\": cells of {} x {} x {}\n", part.name,
                        human_length(part.lattice.spacing.x()), human_length(part.lattice.spacing.y()),
                        human_length(part.lattice.spacing.z()));
  for (const PieceInfo& each : info.pieces)
    text +=
        fmt::format("  {}: {}, and {} of its neighbours; {}\n", each.file, counted(each.cells, "cell"),
                    human_count(each.ghost_cells), counted(static_cast<std::size_t>(each.points), "element"));
  return text;
}

}  // namespace

std::string pieces_info(const std::string& list, bool json) {
  const ListInfo info = look_at(list);
  return json ? to_json(info) : to_text(info, list);
}

}  // namespace flexel::commands
