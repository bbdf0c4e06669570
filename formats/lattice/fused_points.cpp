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

}  // namespace

std::vector<FusedPoint> fused_points(const Body& body) {
  std::vector<FusedPoint> points;
  const auto note = body.notes.find(kFusedNote);
  if (note == body.notes.end()) return points;
  std::string_view text = note->second;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (!parse(text.substr(0, end), body.element_count(), points.emplace_back()))
      throw InputError(
          fmt::format("the body's note \"{}\" is damaged in line {}", kFusedNote, points.size()));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
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

}  // namespace flexel
