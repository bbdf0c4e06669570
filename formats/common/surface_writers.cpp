// Text of coordinates and lines in a source's text: what several writers need.
#include "formats/common/surface_writers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>

#include "base/files/append_text.h"

namespace flexel {
namespace {

// Decimal of 15 digits that, read in `unit`, gives exactly `metres`; "" where there is none.
std::string rest_text(double metres, double unit) {
  std::string text = fmt::format("{:.15g}", metres / unit);
  double back = 0;
  std::from_chars(text.data(), text.data() + text.size(), back);
  if (back * unit != metres) text.clear();
  return text;
}

}  // namespace

void append_coordinate(std::string& text, const DeformedSurface& deformed, std::size_t v, Eigen::Index i) {
  const double rest = deformed.surface.vertices[v][i], displacement = deformed.displacement[v][i];
  const std::string own = displacement == 0 ? rest_text(rest, deformed.unit) : "";
  if (own.empty())
    append_text(text, "{}", (rest + displacement) / deformed.unit);
  else
    text += own;
}

void append_position(std::string& text, const DeformedSurface& deformed, std::size_t v) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    text += ' ';
    append_coordinate(text, deformed, v, i);
  }
}

void add_source_line(Surface& surface, std::string_view format, const std::string& line, int skip) {
  const std::string text = line + "\n";
  for (SurfaceSource& source : surface.sources) {
    if (source.format.substr(0, source.format.find('-')) != format) continue;
    auto at = source.bytes.begin();
    for (int i = 0; i < skip && at != source.bytes.end(); ++i) {
      at = std::find(at, source.bytes.end(), std::byte{'\n'});
      if (at != source.bytes.end()) ++at;
    }
    if (at == source.bytes.end()) continue;  // no such line
    const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
    source.bytes.insert(at, bytes, bytes + text.size());
  }
}

}  // namespace flexel
