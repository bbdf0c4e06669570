// Numbers are written so that they come back to the bit.
#include "formats/lattice/fused_points.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "base/error.h"
#include "base/files/append_text.h"

namespace flexel {
namespace {

// Takes a number off the front of `text`, and `end` after it.
template <class Number>
bool take(std::string_view& text, Number& number, char end) {
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
  if (error != std::errc() || text.empty() || text.front() != end) return false;
  text.remove_prefix(1);
  return true;
}

bool parse(std::string_view line, std::size_t elements, FusedPoint& point) {
  if (!take(line, point.stiffness, ' ') || !take(line, point.length, ' ')) return false;
  double sum = 0;
  while (!line.empty()) {
    std::uint32_t element = 0;
    double weight = 0;
    if (!take(line, element, ':') || !take(line, weight, ' ') || element >= elements) return false;
    point.elements.push_back(element);
    point.weights.push_back(weight);
    sum += weight;
  }
  return point.elements.size() > 1 && std::abs(sum) < 1e-6 && std::isfinite(point.stiffness) &&
         point.stiffness > 0 && std::isfinite(point.length) && point.length >= 0;
}

bool is_part(double number, const Body& body) {
  return number >= 0 && number < static_cast<double>(body.parts.size()) && number == std::floor(number);
}

bool parse_places(std::string_view line, const Body& body, StuckPlaces& places) {
  for (double& value : places)
    if (!take(line, value, ' ') || !std::isfinite(value)) return false;
  const double phase = places[18];
  return line.empty() && is_part(places[0], body) && (places[7] == -1 || is_part(places[7], body)) &&
         (phase == 0 || phase == 1 || phase == 2);
}

// Calls parse(line, number) for each line of a note; throws InputError where it returns false.
template <class Parse>
void for_each_line(const Body& body, const char* name, const Parse& parse) {
  const auto note = body.notes.find(name);
  if (note == body.notes.end()) return;
  std::string_view text = note->second;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (!parse(text.substr(0, end)))
      throw InputError(fmt::format("the body's note \"{}\" is damaged in line {}", name, number));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

std::vector<FusedPoint> fused_points(const Body& body) {
  std::vector<FusedPoint> points;
  for_each_line(body, kFusedNote, [&](std::string_view line) {
    return parse(line, body.element_count(), points.emplace_back());
  });
  return points;
}

void set_fused_points(Body& body, const std::vector<FusedPoint>& points) {
  body.notes.erase(kFusedNote);
  if (points.empty()) return;
  std::string& note = body.notes[kFusedNote];
  for (const FusedPoint& point : points) {
    append_text(note, "{:.17g} {:.17g} ", point.stiffness, point.length);
    for (std::size_t i = 0; i < point.elements.size(); ++i)
      append_text(note, "{}:{:.17g} ", point.elements[i], point.weights[i]);
    note += '\n';
  }
}

std::vector<StuckPlaces> stuck_places(const Body& body) {
  std::vector<StuckPlaces> all;
  for_each_line(body, kStuckNote,
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

}  // namespace flexel
