// Numbers are written so that they come back to the bit.
#include "simulate/contact/pairs/stuck_places.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "base/files/append_text.h"
#include "formats/common/note_text.h"
#include "simulate/contact/pairs/pair_memory.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kOnePart = 0, kOtherPart = 7, kAdhesion = 17, kPhase = 18;  // places in the row

bool names_part(double number, const Body& body) {
  return number >= 0 && number < static_cast<double>(body.parts.size()) && number == std::floor(number);
}

bool parse_places(std::string_view line, const Body& body, StuckPlaces& places) {
  for (double& value : places)
    if (!take_number(line, value, ' ') || !std::isfinite(value)) return false;
  const double phase = places[kPhase];
  return line.empty() && names_part(places[kOnePart], body) &&
         (places[kOtherPart] == -1 || names_part(places[kOtherPart], body)) &&
         (phase == 0 || phase == 1 || phase == 2);
}

}  // namespace

std::vector<StuckPlaces> stuck_places(const Body& body) {
  std::vector<StuckPlaces> all;
  const auto note = body.notes.find(kStuckNote);
  if (note == body.notes.end()) return all;
  read_note_rows(note->second, kStuckNote,
                 [&](std::string_view line) { return parse_places(line, body, all.emplace_back()); });
  return all;
}

void set_stuck_places(Body& body, const std::vector<StuckPlaces>& places) {
  body.notes.erase(kStuckNote);
  if (places.empty()) return;
  std::string& note = body.notes[kStuckNote];
  for (const StuckPlaces& each : places) {
    for (const double value : each) append_text(note, "{:.17g} ", value);
    note += '\n';
  }
}

std::vector<StuckPlaces> stuck_in(const std::vector<double>& transfer_state) {
  std::vector<StuckPlaces> places;
  if (transfer_state.empty()) return places;
  std::span<const double> values(transfer_state);
  values = values.subspan(1 + static_cast<std::size_t>(values[0]));
  StuckPlaces each{};
  for (; values.size() >= each.size(); values = values.subspan(each.size())) {
    std::copy_n(values.begin(), each.size(), each.begin());
    if (each[kAdhesion] != PairRecord::kFree) places.push_back(each);
  }
  return places;
}

std::vector<double> transfer_of(const std::vector<StuckPlaces>& places) {
  std::vector<double> values{0};  // no part is known: all are looked at for overlap
  for (const StuckPlaces& each : places) values.insert(values.end(), each.begin(), each.end());
  return values;
}

}  // namespace flexel::simulate
