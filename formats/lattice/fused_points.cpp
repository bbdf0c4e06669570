// Numbers are written so that they come back to the bit.
#include "formats/lattice/fused_points.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/files/append_text.h"
#include "formats/common/note_text.h"

namespace flexel {
namespace {

bool parse(std::string_view line, std::size_t elements, FusedPoint& point) {
  if (!take_number(line, point.stiffness, ' ') || !take_number(line, point.length, ' ')) return false;
  double sum = 0;
  while (!line.empty()) {
    std::uint32_t element = 0;
    double weight = 0;
    if (!take_number(line, element, ':') || !take_number(line, weight, ' ') || element >= elements)
      return false;
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
  read_note_rows(note->second, kFusedNote, [&](std::string_view line) {
    return parse(line, body.element_count(), points.emplace_back());
  });
  return points;
}

bool are_fused(const Body& body, const std::vector<FusedPoint>& points, std::uint32_t one,
               std::uint32_t other) {
  const auto is_of = [&](const FusedPoint& point, std::uint32_t number) {
    const Part& part = body.parts[number];
    return std::any_of(point.elements.begin(), point.elements.end(),
                       [&](std::uint32_t e) { return e >= part.element_begin && e < part.element_end; });
  };
  return std::any_of(points.begin(), points.end(),
                     [&](const FusedPoint& point) { return is_of(point, one) && is_of(point, other); });
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
