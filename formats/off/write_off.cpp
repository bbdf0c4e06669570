// Writes OFF. From OFF: the same text with other numbers for the positions and normals.
#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/output_file.h"
#include "base/parallel.h"
#include "base/version.h"
#include "formats/common/normal_change.h"
#include "formats/common/surface_writers.h"
#include "formats/off/off_text.h"

namespace flexel {
namespace {

void rewrite_normal(const NormalChange& change, const OffTriple& words, const std::string& file,
                    Rewriter& rewriter) {
  const std::optional<Eigen::Quaterniond> rotation = turn(change);
  if (!rotation) return;
  const Vec3 normal =
      *rotation * Vec3(off_number(words[0], file), off_number(words[1], file), off_number(words[2], file));
  for (std::size_t i = 0; i < 3; ++i)
    rewriter.replace(words[i], fmt::format("{:.9g}", normal[static_cast<Eigen::Index>(i)]));
}

// " r g b" of one entry, opacity too where there is one, 0 to 255.
std::string color_text(const Column& column, std::size_t i) {
  std::string text;
  const auto components = static_cast<std::size_t>(column.components);
  for (std::size_t c = 0; c < components; ++c)
    text += fmt::format(" {}", static_cast<int>(std::round(255 * column.values[i * components + c])));
  return text;
}

const Column* color_of(const Columns& columns) {
  const auto found = columns.find(kColorColumn);
  return found == columns.end() ? nullptr : &found->second;
}

// Puts out lines [0, n), each made by add(text, i), in parallel.
template <class Add>
void write_lines(std::size_t n, OutputFile& out, const Add& add) {
  constexpr std::size_t kGrain = 4096;
  std::vector<std::string> chunks(n / kGrain + 1);
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    std::string& text = chunks[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      add(text, i);
      text += '\n';
    }
  });
  for (const std::string& text : chunks) out.write(text);
}

}  // namespace

void rewrite_off(const DeformedSurface& deformed, OutputFile& out) {
  const SurfaceSource& source = deformed.surface.sources[0];
  const std::string_view text(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size());
  const OffFile file = parse_off(text, source.file);
  if (file.positions.size() != deformed.displacement.size())
    throw InputError(source.file, "the embedded OFF has another number of vertices than the surface");
  const std::vector<NormalChange> changes =
      file.normals.empty() ? std::vector<NormalChange>() : vertex_normal_changes(deformed);
  Rewriter rewriter(text, out);
  for (std::size_t v = 0; v < file.positions.size(); ++v) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string_view word = file.positions[v][i];
      if (const auto value =
              deformed.rewritten(v, static_cast<Eigen::Index>(i), off_number(word, source.file)))
        rewriter.replace(word, fmt::format("{}", *value));
    }
    if (!file.normals.empty()) rewrite_normal(changes[v], file.normals[v], source.file, rewriter);
  }
  rewriter.copy_rest();
}

void write_new_off(const DeformedSurface& deformed, OutputFile& out) {
  const Surface& surface = deformed.surface;
  const Column* vertex_color = color_of(surface.vertex_columns);
  const Column* polygon_color = color_of(surface.polygon_columns);
  out.write(fmt::format("{}OFF\n# Flexel {}\n", vertex_color != nullptr ? "C" : "", version()));
  out.write(fmt::format("{} {} 0\n", surface.vertices.size(), surface.polygon_count()));
  write_lines(surface.vertices.size(), out, [&](std::string& text, std::size_t v) {
    const std::size_t begin = text.size();
    append_position(text, deformed, v);
    text.erase(begin, 1);
    if (vertex_color != nullptr) text += color_text(*vertex_color, v);
  });
  write_lines(surface.polygon_count(), out, [&](std::string& text, std::size_t p) {
    const auto polygon = surface.polygon(p);
    text += std::to_string(polygon.size());
    for (const std::uint32_t v : polygon) append_text(text, " {}", v);
    if (polygon_color != nullptr) text += color_text(*polygon_color, p);
  });
}

}  // namespace flexel
