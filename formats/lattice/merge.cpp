// Appends body to body: every index of the second is shifted by what the first already holds.
#include "formats/lattice/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "base/error.h"
#include "formats/lattice/body_moments.h"
#include "formats/lattice/column_names.h"
#include "formats/lattice/fused_points.h"

namespace flexel {
namespace {

void append_columns(std::map<std::string, Column>& columns, std::map<std::string, Column>& others,
                    const char* of) {
  for (const auto& [name, column] : others)
    if (!columns.contains(name) || columns[name].components != column.components)
      throw InputError(
          fmt::format("the bodies cannot be merged: only one has the {} attribute \"{}\"", of, name));
  for (auto& [name, column] : columns) {
    if (!others.contains(name))
      throw InputError(
          fmt::format("the bodies cannot be merged: only one has the {} attribute \"{}\"", of, name));
    column.values.insert(column.values.end(), others[name].values.begin(), others[name].values.end());
  }
}

template <class T>
void append_all(std::vector<T>& all, const std::vector<T>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

// Notes whose lines name parts by their numbers, at these places among what blanks separate.
const std::map<std::string, std::set<std::size_t>> kNotesOfParts = {
    {"carved", {0}}, {"joined", {0}}, {"stuck", {0, 7}}};

// `note`, with parts numbered from `first` on. What is no number of a part stays: -1, or what is damaged.
std::string with_parts_from(const std::string& note, const std::set<std::size_t>& places, std::size_t first) {
  std::string result;
  std::size_t place = 0;
  for (std::size_t at = 0; at < note.size();) {
    const std::size_t end = std::min(note.find_first_of(" \n", at), note.size());
    const std::string word = note.substr(at, end - at);
    std::size_t part = 0;
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), part);
    const bool number = error == std::errc() && rest == word.data() + word.size();
    result += number && places.contains(place) ? std::to_string(part + first) : word;
    if (end < note.size()) result += note[end];
    place = end < note.size() && note[end] == '\n' ? 0 : place + 1;
    at = end + 1;
  }
  return result;
}

void append_surface_cells(Body& body, const Body& other, std::uint32_t cells) {
  // Either may have none (centre placement): its polygons then bound no cell.
  body.surface_cell_offsets.resize(body.surface.polygon_count() + 1,
                                   static_cast<std::uint32_t>(body.surface_cells.size()));
  const std::uint32_t first = body.surface_cell_offsets.back();
  for (std::size_t p = 0; p < other.surface.polygon_count(); ++p)
    body.surface_cell_offsets.push_back(
        first + (p + 1 < other.surface_cell_offsets.size() ? other.surface_cell_offsets[p + 1] : 0));
  for (const std::uint32_t cell : other.surface_cells) body.surface_cells.push_back(cell + cells);
}

}  // namespace

void append(Body& body, Body other) {
  const auto elements = static_cast<std::uint32_t>(body.element_count());
  const auto cells = static_cast<std::uint32_t>(body.cell_count());
  const std::size_t parts = body.parts.size();
  std::vector<FusedPoint> fused = fused_points(body), others_fused = fused_points(other);
  for (FusedPoint& point : others_fused)
    for (std::uint32_t& e : point.elements) e += elements;
  append_columns(body.element_columns, other.element_columns, "element");
  append_columns(body.cell_columns, other.cell_columns, "cell");
  for (Part part : other.parts) {
    part.element_begin += elements;
    part.element_end += elements;
    part.cell_begin += cells;
    part.cell_end += cells;
    body.parts.push_back(part);
  }
  append_moments(body, other);
  append_all(body.lattice_index, other.lattice_index);
  append_all(body.piece, other.piece);
  append_all(body.rest, other.rest);
  append_all(body.position, other.position);
  append_all(body.connections, other.connections);
  for (auto corners : other.cell_elements) {
    for (std::uint32_t& corner : corners) corner += elements;
    body.cell_elements.push_back(corners);
  }
  append_all(body.fill, other.fill);
  append_all(body.broken, other.broken);
  append_surface_cells(body, other, cells);
  append(body.surface, std::move(other.surface));
  for (std::size_t p = parts; p < body.parts.size(); ++p) body.parts[p].name = body.surface.parts[p].name;
  fused.insert(fused.end(), others_fused.begin(), others_fused.end());
  for (const auto& [key, places] : kNotesOfParts)
    if (other.notes.contains(key)) body.notes[key] += with_parts_from(other.notes[key], places, parts);
  for (const char* key : {kLostWallsNote, kJoinedPiecesNote})
    if (other.notes.contains(key)) body.notes[key] += other.notes[key];
  for (const auto& [key, note] : other.notes) body.notes.try_emplace(key, note);
  set_fused_points(body, fused);
}

}  // namespace flexel
