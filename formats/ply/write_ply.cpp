// Writes PLY. From PLY: the source's bytes, header and all, with other numbers for the positions, and for the
// normals, each in the encoding and type that the file has; a number that did not change keeps its bytes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/output_file.h"
#include "base/parallel.h"
#include "base/version.h"
#include "formats/common/file_formats.h"
#include "formats/common/normal_change.h"
#include "formats/common/surface_writers.h"
#include "formats/ply/ply_text.h"

namespace flexel {
namespace {

// The rewriting of one source.
class PlyRewrite {
 public:
  PlyRewrite(const DeformedSurface& deformed, OutputFile& out)
      : deformed_(deformed),
        source_(deformed.surface.sources[0]),
        text_(reinterpret_cast<const char*>(source_.bytes.data()), source_.bytes.size()),
        header_(parse_ply_header(source_.bytes, source_.file)),
        values_(source_.bytes, header_, source_.file),
        rewriter_(text_, out) {}

  void run() {
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") {
        vertices(element);
        break;
      }
      pass(element);
    }
    rewriter_.copy_rest();
  }

 private:
  void pass(const PlyElement& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t i = 0; i < element.count; ++i)
      for (const PlyProperty& property : element.properties)
        for (std::size_t left = property.list ? values_.next_count(property) : 1; left > 0; --left)
          static_cast<void>(values_.next(property.type));
  }

  struct Read {
    double value = 0;
    std::size_t begin = 0, end = 0;
  };

  void vertices(const PlyElement& element) {
    if (element.count != deformed_.displacement.size())
      throw InputError(source_.file, "the embedded PLY has another number of vertices than the surface");
    const PlyVertexLayout layout = vertex_layout(element);
    const std::vector<NormalChange> changes =
        layout.has_normal() ? vertex_normal_changes(deformed_) : std::vector<NormalChange>();
    std::vector<Read> entry(element.properties.size());
    for (std::uint64_t v = 0; v < element.count; ++v) {
      values_.at(element, v);
      for (std::size_t i = 0; i < entry.size(); ++i) {
        const PlyProperty& property = element.properties[i];
        for (std::size_t left = property.list ? values_.next_count(property) : 1; left > 0; --left)
          entry[i].value = values_.next(property.type);
        entry[i].begin = values_.begin();
        entry[i].end = values_.end();
      }
      std::vector<std::optional<double>> changed(entry.size());
      for (Eigen::Index i = 0; i < 3; ++i) {
        const std::size_t property = layout.position[static_cast<std::size_t>(i)];
        changed[property] = deformed_.rewritten(v, i, entry[property].value);
      }
      if (layout.has_normal()) turn_normal(changes[v], layout, entry, changed);
      for (std::size_t i = 0; i < entry.size(); ++i)
        if (changed[i]) put(entry[i], *changed[i], element.properties[i].type, v);
    }
  }

  static void turn_normal(const NormalChange& change, const PlyVertexLayout& layout,
                          const std::vector<Read>& entry, std::vector<std::optional<double>>& changed) {
    const std::optional<Eigen::Quaterniond> rotation = turn(change);
    if (!rotation) return;
    Vec3 normal;
    for (std::size_t i = 0; i < 3; ++i) normal[static_cast<Eigen::Index>(i)] = entry[layout.normal[i]].value;
    if (!normal.allFinite()) return;
    normal = *rotation * normal;
    for (std::size_t i = 0; i < 3; ++i) changed[layout.normal[i]] = normal[static_cast<Eigen::Index>(i)];
  }

  void put(const Read& read, double value, PlyType type, std::size_t vertex) {
    const std::string_view word = text_.substr(read.begin, read.end - read.begin);
    if (header_.encoding == PlyEncoding::ascii) {
      rewriter_.replace(word, type == PlyType::float32 ? fmt::format("{}", static_cast<float>(value))
                                                       : fmt::format("{}", value));
      return;
    }
    if (type == PlyType::float32 && !std::isfinite(static_cast<float>(value)))
      throw InputError(
          fmt::format("vertex {} does not fit the single precision of the PLY file that it came "
                      "from: write in a larger unit, or in another format",
                      vertex + 1));
    rewriter_.replace(word, ply_bytes(value, type, header_.encoding));
  }

  const DeformedSurface& deformed_;
  const SurfaceSource& source_;
  std::string_view text_;
  PlyHeader header_;
  PlyValues values_;
  Rewriter rewriter_;
};

// --- new files

// One number of every entry of an element: its line in the header and its values.
struct NewProperty {
  std::string name;
  PlyType type = PlyType::float64;
  const Column* column = nullptr;
  std::size_t component = 0;
  [[nodiscard]] double value(std::size_t i) const {
    const double value = column->values[i * static_cast<std::size_t>(column->components) + component];
    return type == PlyType::uint8 ? std::round(255 * value) : value;
  }
};

// A colour becomes red, green, blue (alpha) of 8 bits, which every program reads; a column of several
// components NAME_0, NAME_1 ..., of three NAME_x, NAME_y, NAME_z. Columns of a name that is taken are left
// out.
std::vector<NewProperty> new_properties(const Columns& columns, const std::vector<std::string>& taken) {
  static constexpr std::array<const char*, 4> kChannels = {"red", "green", "blue", "alpha"};
  static constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  std::vector<NewProperty> properties;
  for (const auto& [name, column] : columns) {
    if (std::find(taken.begin(), taken.end(), name) != taken.end()) continue;
    for (std::size_t c = 0; c < static_cast<std::size_t>(column.components); ++c) {
      if (name == kColorColumn)
        properties.push_back({kChannels.at(c), PlyType::uint8, &column, c});
      else if (column.components == 1)
        properties.push_back({name, PlyType::float64, &column, c});
      else
        properties.push_back(
            {column.components == 3 ? fmt::format("{}_{}", name, kAxes.at(c)) : fmt::format("{}_{}", name, c),
             PlyType::float64, &column, c});
    }
  }
  return properties;
}

std::string header_lines(const std::vector<NewProperty>& properties) {
  std::string text;
  for (const NewProperty& property : properties)
    text +=
        fmt::format("property {} {}\n", property.type == PlyType::uint8 ? "uchar" : "double", property.name);
  return text;
}

// Which numbers of parts and faces a new file has: of parts where there are several, of faces where they came
// with the file. Simple readers (meshio 5) take no face with more than its corners.
struct Numbered {
  explicit Numbered(const Surface& surface) : parts(surface.parts.size() > 1) {
    for (const SurfaceFace& face : surface.faces) faces = faces || !face.name.empty();
    for (const SurfaceSource& source : surface.sources) faces = faces || is_cad(source);
  }
  bool parts, faces = false;
};

std::string new_header(const Surface& surface, bool ascii, const std::vector<NewProperty>& of_vertices,
                       const std::vector<NewProperty>& of_polygons) {
  std::string text = fmt::format("ply\nformat {} 1.0\ncomment Flexel {}\n",
                                 ascii ? "ascii" : "binary_little_endian", version());
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  for (std::size_t p = 0; p < surface.parts.size(); ++p)
    text += fmt::format("comment part {} is {}\n", p, surface.parts[p].name);
  for (std::size_t f = 0; f < surface.faces.size(); ++f)
    if (!surface.faces[f].name.empty())
      text += fmt::format("comment face {} of part {} is {}\n", numbers[f], surface.faces[f].part,
                          surface.faces[f].name);
  text += fmt::format("element vertex {}\nproperty double x\nproperty double y\nproperty double z\n{}",
                      surface.vertices.size(), header_lines(of_vertices));
  const Numbered numbered(surface);
  text += fmt::format("element face {}\nproperty list uint uint vertex_indices\n{}{}{}end_header\n",
                      surface.polygon_count(), numbered.parts ? "property uint part\n" : "",
                      numbered.faces ? "property uint face\n" : "", header_lines(of_polygons));
  return text;
}

// Appends numbers in one of the two encodings.
class Numbers {
 public:
  explicit Numbers(bool ascii) : ascii_(ascii) {}
  void add(double value, PlyType type) {
    if (!ascii_)
      text_ += ply_bytes(value, type, PlyEncoding::little_endian);
    else
      append_text(text_, "{} ", value);
  }
  void add_position(const DeformedSurface& deformed, std::size_t v) {
    if (!ascii_) {
      for (const double value : deformed.at(v)) add(value, PlyType::float64);
      return;
    }
    const std::size_t begin = text_.size();
    append_position(text_, deformed, v);
    text_.erase(begin, 1);
    text_ += ' ';
  }
  void add(const std::vector<NewProperty>& properties, std::size_t i) {
    for (const NewProperty& property : properties) add(property.value(i), property.type);
  }
  void end_entry() {
    if (ascii_) text_.back() = '\n';
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  bool ascii_;
  std::string text_;
};

// Puts out entries [0, n), made in parallel by add(numbers, i).
template <class Add>
void write_entries(std::size_t n, bool ascii, OutputFile& out, const Add& add) {
  constexpr std::size_t kGrain = 4096;
  std::vector<Numbers> chunks(n / kGrain + 1, Numbers(ascii));
  parallel_chunks(n, kGrain, [&](std::size_t begin, std::size_t end) {
    Numbers& numbers = chunks[begin / kGrain];
    for (std::size_t i = begin; i < end; ++i) {
      add(numbers, i);
      numbers.end_entry();
    }
  });
  for (const Numbers& numbers : chunks) out.write(numbers.text());
}

}  // namespace

void rewrite_ply(const DeformedSurface& deformed, OutputFile& out) {
  const SurfaceSource& source = deformed.surface.sources[0];
  const PlyHeader header = parse_ply_header(source.bytes, source.file);
  for (const PlyElement& element : header.elements)
    for (const PlyProperty& property : element.properties)
      if (element.name == "vertex" && !is_float(property.type) &&
          (property.name == "x" || property.name == "y" || property.name == "z"))
        return write_new_ply(deformed, header.encoding == PlyEncoding::ascii, out);  // no room for fractions
  PlyRewrite(deformed, out).run();
}

void write_new_ply(const DeformedSurface& deformed, bool ascii, OutputFile& out) {
  const Surface& surface = deformed.surface;
  const std::vector<NewProperty> of_vertices = new_properties(surface.vertex_columns, {"x", "y", "z"}),
                                 of_polygons = new_properties(surface.polygon_columns, {"part", "face"});
  const std::vector<std::uint32_t> numbers = face_numbers(surface);
  const Numbered numbered(surface);
  out.write(new_header(surface, ascii, of_vertices, of_polygons));
  write_entries(surface.vertices.size(), ascii, out, [&](Numbers& entry, std::size_t v) {
    entry.add_position(deformed, v);
    entry.add(of_vertices, v);
  });
  write_entries(surface.polygon_count(), ascii, out, [&](Numbers& entry, std::size_t p) {
    const auto polygon = surface.polygon(p);
    entry.add(static_cast<double>(polygon.size()), PlyType::uint32);
    for (const std::uint32_t v : polygon) entry.add(v, PlyType::uint32);
    if (numbered.parts) entry.add(surface.polygon_part(p), PlyType::uint32);
    if (numbered.faces) entry.add(numbers[surface.polygon_face[p]], PlyType::uint32);
    entry.add(of_polygons, p);
  });
}

}  // namespace flexel
