// Splits the polygons of an OBJ file. New v, vt and vn lines follow the last of their kind, so old ones keep their
// numbers; the f line of a polygon that was split becomes one for each piece. Texture coordinates are interpolated along
// the edges of each polygon, so seams stay seams. Every corner of a piece gets a normal of its own vertex: a normal
// that a whole flat side shares could not turn as the bent side does.
#include <fmt/format.h>

#include <map>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "base/files/append_text.h"
#include "formats/common/refine_files.h"
#include "formats/obj/obj_text.h"

namespace flexel {
namespace {

using Numbers = std::vector<double>;

// Half-way, number by number, as far as both go.
Numbers mean(const Numbers& a, const Numbers& b) {
  Numbers result;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) result.push_back(0.5 * (a[i] + b[i]));
  return result;
}

Numbers normal_between(const Numbers& a, const Numbers& b) {
  if (a.size() < 3 || b.size() < 3) return a;
  const Vec3 normal = mean_normal(Vec3(a[0], a[1], a[2]), Vec3(b[0], b[1], b[2]));
  return {normal.x(), normal.y(), normal.z()};
}

class ObjRefinement {
 public:
  ObjRefinement(const SurfaceSource& source, const Refinement& refinement)
      : source_(source),
        refinement_(refinement),
        first_piece_(first_pieces(refinement)),
        text_(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size()) {}

  std::string run(Bytes& result) {
    if (const std::string held = gather(); !held.empty()) return held;
    for (const auto& [a, b] : refinement_.ends) vertices_.push_back(mean(vertices_[a], vertices_[b]));
    split_faces();
    write();
    result.resize(out_.size());
    std::copy_n(reinterpret_cast<const std::byte*>(out_.data()), out_.size(), result.begin());
    return "";
  }

 private:
  // Line ends after the last line of each kind, and the numbers on all of them. Returns what cannot be split.
  std::string gather() {
    ObjLines lines(text_);
    for (ObjLine line; lines.next(line);) {
      switch (line.keyword) {
        case ObjKeyword::vertex:
          add(line, vertices_, vertices_end_, lines.at());
          break;
        case ObjKeyword::normal:
          add(line, normals_, normals_end_, lines.at());
          break;
        case ObjKeyword::texture:
          add(line, textures_, textures_end_, lines.at());
          break;
        case ObjKeyword::other:
          if (const std::string held = not_split(line); !held.empty()) return held;
          break;
        default:
          break;
      }
    }
    if (vertices_.size() != refinement_.vertices)
      throw InputError(source_.file, "the embedded OBJ has another number of vertices than the surface");
    old_normals_ = normals_.size();
    old_textures_ = textures_.size();
    return "";
  }

  static void add(const ObjLine& line, std::vector<Numbers>& numbers, std::size_t& end, std::size_t at) {
    numbers.push_back(numbers_of(line));
    end = at;
  }

  // Free-form geometry, and lines and points that count back from where they stand.
  std::string not_split(const ObjLine& line) const {
    const auto begin = static_cast<std::size_t>(line.text.data() - text_.data());
    const std::size_t from = text_.rfind('\n', begin == 0 ? 0 : begin - 1);
    std::string_view rest = text_.substr(from == std::string_view::npos ? 0 : from + 1);
    const std::string_view word = next_word(rest);
    for (const std::string_view kind : {"curv", "curv2", "surf", "vp", "cstype"})
      if (word == kind) return "curves or free-form surfaces";
    if ((word == "l" || word == "p") && line.text.find('-') != std::string_view::npos)
      return "lines or points with negative indices";
    return "";
  }

  // The f lines of every polygon that changes: in their order, with the place of the line.
  void split_faces() {
    ObjCounts counts{0, 0, 0};
    std::vector<ObjCorner> corners;
    std::uint32_t polygon = 0;
    ObjLines lines(text_);
    std::size_t begin = 0;
    for (ObjLine line; lines.next(line); begin = lines.at()) {
      counts.vertices += line.keyword == ObjKeyword::vertex;
      counts.normals += line.keyword == ObjKeyword::normal;
      counts.textures += line.keyword == ObjKeyword::texture;
      if (line.keyword != ObjKeyword::face) continue;
      parse_face(line, counts, source_.file, corners);
      if (polygon + 1 >= first_piece_.size())
        throw InputError(source_.file, "the embedded OBJ has another number of faces than the surface");
      if (std::string text = text_of(polygon++, corners, line); !text.empty())
        replaced_.push_back({begin, lines.at(), std::move(text)});
    }
  }

  // "" where the line can stay.
  std::string text_of(std::uint32_t polygon, std::vector<ObjCorner>& corners, const ObjLine& line) {
    const std::uint32_t first = first_piece_[polygon], last = first_piece_[polygon + 1];
    std::string text;
    const bool dangles = drop_dangling(corners);
    if (last - first == 1) {
      if (line.text.find('-') == std::string_view::npos && !dangles) return "";
      add_face(text, corners);  // what it counts back from is not what it was
      return text;
    }
    const auto halve = [&](const ObjCorner& a, const ObjCorner& b, std::uint32_t vertex) {
      return ObjCorner{vertex, normal_at(vertex, a.normal, b.normal), texture_between(a.texture, b.texture)};
    };
    PieceCorners<ObjCorner, decltype(halve)> pieces(refinement_, halve);
    for (ObjCorner& corner : corners) {
      corner.normal = normal_at(corner.vertex, corner.normal, corner.normal);
      pieces.add(static_cast<std::uint32_t>(corner.vertex), corner);
    }
    for (std::uint32_t piece = first; piece < last; ++piece) {
      std::vector<ObjCorner> own;
      for (std::uint32_t i = refinement_.offsets[piece]; i < refinement_.offsets[piece + 1]; ++i)
        own.push_back(pieces.at(refinement_.corners[i]));
      add_face(text, own);
    }
    return text;
  }

  // What names a line that is not there must not come to name a new one. Whether there was any.
  bool drop_dangling(std::vector<ObjCorner>& corners) const {
    bool found = false;
    const auto drop = [&](std::int64_t& index, std::size_t count) {
      if (index < static_cast<std::int64_t>(count)) return;
      index = kNoIndex;
      found = true;
    };
    for (ObjCorner& corner : corners) {
      drop(corner.normal, old_normals_);
      drop(corner.texture, old_textures_);
    }
    return found;
  }

  static void add_face(std::string& text, const std::vector<ObjCorner>& corners) {
    text += 'f';
    for (const ObjCorner& corner : corners) append(text, corner);
    text += '\n';
  }

  static void append(std::string& text, const ObjCorner& corner) {
    append_text(text, " {}", corner.vertex + 1);
    if (corner.texture == kNoIndex && corner.normal == kNoIndex) return;
    text += '/';
    if (corner.texture != kNoIndex) append_text(text, "{}", corner.texture + 1);
    if (corner.normal != kNoIndex) append_text(text, "/{}", corner.normal + 1);
  }

  // Half-way between two, on one side of a seam; where one is missing, none.
  std::int64_t texture_between(std::int64_t a, std::int64_t b) {
    if (a == b) return a;
    const auto count = static_cast<std::int64_t>(textures_.size());
    if (a == kNoIndex || b == kNoIndex || a >= count || b >= count) return kNoIndex;
    const auto [found, is_new] = texture_of_.emplace(std::minmax(a, b), count);
    if (is_new) textures_.push_back(mean(textures_[a], textures_[b]));
    return found->second;
  }

  // The normal of this vertex that lies half-way between two.
  std::int64_t normal_at(std::int64_t vertex, std::int64_t a, std::int64_t b) {
    const auto count = static_cast<std::int64_t>(normals_.size());
    if (a == kNoIndex || b == kNoIndex || a >= count || b >= count) return a == b ? a : kNoIndex;
    const auto [low, high] = std::minmax(a, b);
    const auto [found, is_new] = normal_of_.emplace(std::tuple(vertex, low, high), count);
    if (is_new) normals_.push_back(normal_between(normals_[low], normals_[high]));
    return found->second;
  }

  static void append_lines(std::string& text, const char* keyword, const std::vector<Numbers>& numbers,
                           std::size_t from) {
    for (std::size_t i = from; i < numbers.size(); ++i) {
      text += keyword;
      for (const double value : numbers[i]) append_text(text, " {}", value);
      text += '\n';
    }
  }

  // The file with all of it in its place.
  void write() {
    struct Added {
      std::size_t at = 0;
      const char* keyword = "";
      const std::vector<Numbers>* numbers = nullptr;
      std::size_t from = 0;
    };
    std::vector<Added> added = {{vertices_end_, "v", &vertices_, refinement_.vertices},
                                {textures_end_, "vt", &textures_, old_textures_},
                                {normals_end_, "vn", &normals_, old_normals_}};
    std::stable_sort(added.begin(), added.end(), [](const Added& a, const Added& b) { return a.at < b.at; });
    std::size_t done = 0, next = 0;
    const auto copy_to = [&](std::size_t end) {
      out_ += text_.substr(done, end - done);
      done = end;
    };
    const auto add_before = [&](std::size_t end) {
      for (; next < added.size() && added[next].at <= end; ++next) {
        copy_to(added[next].at);
        if (!out_.empty() && out_.back() != '\n') out_ += '\n';
        append_lines(out_, added[next].keyword, *added[next].numbers, added[next].from);
      }
    };
    for (const Replaced& each : replaced_) {
      add_before(each.begin);
      copy_to(each.begin);
      out_ += each.text;
      done = each.end;
    }
    add_before(text_.size());
    copy_to(text_.size());
  }

  struct Replaced {
    std::size_t begin = 0, end = 0;  // the line
    std::string text;
  };
  const SurfaceSource& source_;
  const Refinement& refinement_;
  const std::vector<std::uint32_t> first_piece_;
  std::string_view text_;
  std::vector<Numbers> vertices_, normals_, textures_;
  std::size_t vertices_end_ = 0, normals_end_ = 0, textures_end_ = 0;
  std::size_t old_normals_ = 0, old_textures_ = 0;
  std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> texture_of_;
  std::map<std::tuple<std::int64_t, std::int64_t, std::int64_t>, std::int64_t> normal_of_;
  std::vector<Replaced> replaced_;
  std::string out_;
};

}  // namespace

std::string refine_obj(SurfaceSource& source, const Refinement& refinement) {
  Bytes bytes;
  const std::string held = ObjRefinement(source, refinement).run(bytes);
  if (held.empty()) source.bytes = std::move(bytes);
  return held;
}

}  // namespace flexel
