// Splits the polygons of a PLY file of any encoding: other counts in the header, new vertices after the last one, the
// pieces of a polygon in its place. Entries that stay keep their bytes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "formats/common/refine_files.h"
#include "formats/ply/ply_text.h"

namespace flexel {
namespace {

// The numbers of one entry by property; single numbers are lists of one.
using Entry = std::vector<std::vector<double>>;

bool is_corners(const PlyProperty& property) {
  return property.list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

constexpr std::string_view kColorWords[] = {"red", "green", "blue", "alpha"};

double largest_of(PlyType type) {
  const auto bits = static_cast<int>(8 * size_of(type));
  const bool is_signed = type == PlyType::int8 || type == PlyType::int16 || type == PlyType::int32;
  return is_float(type) ? 1e300 : std::ldexp(1.0, is_signed ? bits - 1 : bits) - 1;
}

class PlyRefinement {
 public:
  PlyRefinement(const SurfaceSource& source, const Refinement& refinement)
      : source_(source),
        refinement_(refinement),
        first_piece_(first_pieces(refinement)),
        text_(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size()),
        header_(parse_ply_header(source.bytes, source.file)),
        values_(source.bytes, header_, source.file) {}

  std::string run(Bytes& result) {
    out_ = new_header();
    done_ = header_.size;
    bool vertices = false, faces = false;
    for (const PlyElement& element : header_.elements) {
      std::string held;
      if (element.name == "vertex" && !std::exchange(vertices, true))
        held = add_vertices(element);
      else if (element.name == "face" && !std::exchange(faces, true))
        held = split_faces(element);
      else
        held = pass_over(element);
      if (!held.empty()) return held;
    }
    copy_to(text_.size());
    result.resize(out_.size());
    std::copy_n(reinterpret_cast<const std::byte*>(out_.data()), out_.size(), result.begin());
    return "";
  }

 private:
  bool ascii() const { return header_.encoding == PlyEncoding::ascii; }

  void copy_to(std::size_t end) {
    out_ += text_.substr(done_, end - done_);
    done_ = end;
  }

  // The header with the numbers of vertices and faces after.
  std::string new_header() {
    std::string text;
    bool vertices = false, faces = false;
    for (std::size_t at = 0; at < header_.size;) {
      const std::size_t end = std::min(text_.find('\n', at) + 1, header_.size);
      const std::string_view line = text_.substr(at, end - at);
      const std::string_view ending = line.ends_with("\r\n") ? "\r\n" : "\n";
      at = end;
      const std::vector<std::string_view> words = words_of(line);
      const std::string_view element = words.size() > 1 && words[0] == "element" ? words[1] : "";
      if (element == "vertex" && !std::exchange(vertices, true))
        text += fmt::format("element vertex {}{}", refinement_.vertices + refinement_.ends.size(), ending);
      else if (element == "face" && !std::exchange(faces, true))
        text += fmt::format("element face {}{}", refinement_.polygon_count(), ending);
      else
        text += line;
    }
    if (!vertices || !faces) throw InputError(source_.file, "the embedded PLY has another header");
    return text;
  }

  // Faces get other numbers; what names them by number would name others.
  std::string pass_over(const PlyElement& element) {
    for (const PlyProperty& property : element.properties)
      for (const char* word : {"face", "tri"})
        if (element.count > 0 && !is_float(property.type) && property.name.find(word) != std::string::npos)
          return fmt::format("numbers of faces (\"{}\" of its element \"{}\")", property.name, element.name);
    for (std::uint64_t i = 0; i < element.count; ++i) static_cast<void>(next_entry(element, i));
    return "";
  }

  // Its place is [begin_, values_.end()).
  Entry next_entry(const PlyElement& element, std::uint64_t number) {
    values_.at(element, number);
    Entry entry;
    bool first = true;
    for (const PlyProperty& property : element.properties) {
      std::vector<double>& numbers = entry.emplace_back();
      std::size_t left = 1;
      if (property.list) {
        left = values_.next_count(property);
        if (std::exchange(first, false)) begin_ = values_.begin();
      }
      for (; left > 0; --left) {
        numbers.push_back(values_.next(property.type));
        if (std::exchange(first, false)) begin_ = values_.begin();
      }
    }
    return entry;
  }

  void add(double value, PlyType type) {
    if (!ascii())
      out_ += ply_bytes(value, type, header_.encoding);
    else if (!is_float(type))
      out_ += fmt::format("{} ", static_cast<long long>(std::round(value)));
    else if (type == PlyType::float32)
      out_ += fmt::format("{} ", static_cast<float>(value));
    else
      out_ += fmt::format("{} ", value);
  }

  void add_entry(const PlyElement& element, const Entry& entry) {
    for (std::size_t i = 0; i < entry.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      if (property.list) add(static_cast<double>(entry[i].size()), property.count_type);
      for (const double value : entry[i]) add(value, property.type);
    }
    if (ascii()) out_.back() = '\n';
  }

  std::string add_vertices(const PlyElement& element) {
    if (element.count != refinement_.vertices)
      throw InputError(source_.file, "the embedded PLY has another number of vertices than the surface");
    for (const PlyProperty& property : element.properties)
      if (property.list) return fmt::format("lists at its vertices (\"{}\")", property.name);
    std::vector<Entry> entries;
    entries.reserve(element.count + refinement_.ends.size());
    for (std::uint64_t v = 0; v < element.count; ++v) entries.push_back(next_entry(element, v));
    copy_to(values_.end());
    if (ascii()) out_ += '\n';
    const PlyVertexLayout layout = vertex_layout(element);
    for (const auto& [a, b] : refinement_.ends) {
      entries.push_back(between(element, layout, entries[a], entries[b]));
      add_entry(element, entries.back());
    }
    if (ascii()) out_.pop_back();  // the line's end is in the text that follows
    return "";
  }

  // Whole numbers that are no places and no colours name something: there is nothing between two labels.
  static bool is_label(const PlyElement& element, const PlyVertexLayout& layout, std::size_t i) {
    const PlyProperty& property = element.properties[i];
    const auto has = [&](const auto& numbers) {
      return std::find(numbers.begin(), numbers.end(), i) != numbers.end();
    };
    return !is_float(property.type) && !has(layout.position) &&
           !(layout.has_normal() && has(layout.normal)) &&
           std::none_of(std::begin(kColorWords), std::end(kColorWords),
                        [&](std::string_view word) { return property.name.find(word) != std::string::npos; });
  }

  static Entry between(const PlyElement& element, const PlyVertexLayout& layout, const Entry& a,
                       const Entry& b) {
    Entry result = a;
    for (std::size_t i = 0; i < result.size(); ++i)
      if (!is_label(element, layout, i)) result[i][0] = 0.5 * (a[i][0] + b[i][0]);
    if (!layout.has_normal()) return result;
    const auto normal = [&](const Entry& entry) {
      return Vec3(entry[layout.normal[0]][0], entry[layout.normal[1]][0], entry[layout.normal[2]][0]);
    };
    const Vec3 mean = mean_normal(normal(a), normal(b));
    for (std::size_t i = 0; i < 3; ++i) result[layout.normal[i]][0] = mean[static_cast<Eigen::Index>(i)];
    return result;
  }

  std::string split_faces(const PlyElement& element) {
    const auto corners = std::find_if(element.properties.begin(), element.properties.end(), is_corners);
    if (corners == element.properties.end() || element.count + 1 != first_piece_.size())
      throw InputError(source_.file, "the embedded PLY has another number of faces than the surface");
    const auto at = static_cast<std::size_t>(corners - element.properties.begin());
    const double vertices = static_cast<double>(refinement_.vertices + refinement_.ends.size());
    if (vertices - 1 > largest_of(corners->type))
      return fmt::format("indices of {} bits, too few for the new vertices", 8 * size_of(corners->type));
    for (std::uint32_t f = 0; f < element.count; ++f) {
      const Entry entry = next_entry(element, f);
      if (first_piece_[f + 1] - first_piece_[f] == 1) continue;
      copy_to(begin_);
      if (const std::string held = add_pieces(element, at, f, entry); !held.empty()) return held;
      if (ascii()) out_.pop_back();
      done_ = values_.end();
    }
    return "";
  }

  // Lists with numbers for each corner (texture coordinates) are interpolated, single numbers are those of the polygon.
  std::string add_pieces(const PlyElement& element, std::size_t corners, std::uint32_t face,
                         const Entry& entry) {
    const std::size_t count = entry[corners].size();
    for (std::size_t i = 0; i < entry.size(); ++i)
      if (i != corners && !entry[i].empty() && element.properties[i].list &&
          (!is_float(element.properties[i].type) || entry[i].size() % count != 0))
        return fmt::format("lists of its faces that are not numbers of their corners (\"{}\")",
                           element.properties[i].name);
    std::vector<Entry> pieces;
    for (std::uint32_t p = first_piece_[face]; p < first_piece_[face + 1]; ++p) {
      Entry& piece = pieces.emplace_back(entry);
      piece[corners].clear();
      for (std::uint32_t i = refinement_.offsets[p]; i < refinement_.offsets[p + 1]; ++i)
        piece[corners].push_back(refinement_.corners[i]);
    }
    for (std::size_t i = 0; i < entry.size(); ++i)
      if (i != corners && element.properties[i].list && !entry[i].empty())
        interpolate(entry[i], entry[corners], i, corners, pieces);
    for (const Entry& piece : pieces) add_entry(element, piece);
    return "";
  }

  void interpolate(const std::vector<double>& numbers, const std::vector<double>& vertices, std::size_t list,
                   std::size_t corners, std::vector<Entry>& pieces) const {
    using Numbers = std::vector<double>;
    const std::size_t each = numbers.size() / vertices.size();
    const auto halve = [](const Numbers& a, const Numbers& b, std::uint32_t) {
      Numbers mean(a.size());
      for (std::size_t i = 0; i < a.size(); ++i) mean[i] = 0.5 * (a[i] + b[i]);
      return mean;
    };
    PieceCorners<Numbers, decltype(halve)> known(refinement_, halve);
    for (std::size_t c = 0; c < vertices.size(); ++c) {
      const auto from = numbers.begin() + static_cast<std::ptrdiff_t>(c * each);
      known.add(static_cast<std::uint32_t>(vertices[c]),
                Numbers(from, from + static_cast<std::ptrdiff_t>(each)));
    }
    for (Entry& piece : pieces) {
      piece[list].clear();
      for (const double vertex : piece[corners]) {
        const Numbers own = known.at(static_cast<std::uint32_t>(vertex));
        piece[list].insert(piece[list].end(), own.begin(), own.end());
      }
    }
  }

  const SurfaceSource& source_;
  const Refinement& refinement_;
  const std::vector<std::uint32_t> first_piece_;
  std::string_view text_;
  PlyHeader header_;
  PlyValues values_;
  std::size_t begin_ = 0, done_ = 0;
  std::string out_;
};

}  // namespace

std::string refine_ply(SurfaceSource& source, const Refinement& refinement) {
  Bytes bytes;
  const std::string held = PlyRefinement(source, refinement).run(bytes);
  if (held.empty()) source.bytes = std::move(bytes);
  return held;
}

}  // namespace flexel
