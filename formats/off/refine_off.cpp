// Splits the polygons of an OFF file that has a line for every vertex and every face, as all programs write it.
#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "formats/common/refine_files.h"
#include "formats/off/off_text.h"

namespace flexel {
namespace {

using OffWords = std::vector<std::string_view>;

OffWords words_of(std::string_view line) {
  OffWords words;
  line = line.substr(0, line.find('#'));
  constexpr std::string_view kBlank = " \t\r\n\v\f";
  for (std::size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

class OffRefinement {
 public:
  OffRefinement(const SurfaceSource& source, const Refinement& refinement)
      : source_(source),
        refinement_(refinement),
        first_piece_(first_pieces(refinement)),
        text_(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size()) {}

  std::string run(Bytes& result) {
    const OffFile file = parse_off(text_, source_.file);
    if (file.positions.size() != refinement_.vertices || file.offsets.size() != first_piece_.size())
      throw InputError(source_.file, "the embedded OFF has another number of vertices or faces");
    has_normals_ = !file.normals.empty();
    std::size_t number = 0;  // of the lines with words after the two of the head
    bool in_head = true;
    OffWords head;
    while (done_ < text_.size()) {
      const std::size_t end = text_.find('\n', done_);
      const std::string_view line =
          text_.substr(done_, end == std::string_view::npos ? end : end + 1 - done_);
      done_ += line.size();
      const OffWords words = words_of(line);
      if (words.empty()) {
        out_ += line;
      } else if (in_head && head.empty() && words.size() == 1) {
        head = words;
        add_line(line);
      } else if (in_head) {
        if (head.empty()) out_ += fmt::format("{}\n", words[0]);
        texture_ = (head.empty() ? words[0] : head[0]).starts_with("ST");
        out_ += fmt::format("{} {} 0\n", refinement_.vertices + refinement_.ends.size(),
                            refinement_.polygon_count());
        in_head = false;
      } else if (const std::string held = add(line, words, number++); !held.empty()) {
        return held;
      }
    }
    if (number != refinement_.vertices + first_piece_.size() - 1) return kByLines;
    result.resize(out_.size());
    std::copy_n(reinterpret_cast<const std::byte*>(out_.data()), out_.size(), result.begin());
    return "";
  }

 private:
  static constexpr const char* kByLines = "vertices or faces that do not have a line each";

  std::string add(std::string_view line, const OffWords& words, std::size_t number) {
    if (number < refinement_.vertices) {
      if (words.size() < 3) return kByLines;
      vertices_.push_back({});
      for (const std::string_view word : words) vertices_.back().push_back(off_number(word, source_.file));
      add_line(line);
      whole_.push_back(is_whole(words));
      if (number + 1 == refinement_.vertices) add_new_vertices();
      return "";
    }
    const std::size_t face = number - refinement_.vertices;
    if (face + 1 >= first_piece_.size()) return kByLines;
    if (first_piece_[face + 1] - first_piece_[face] == 1) {
      add_line(line);
      return "";
    }
    const auto corners = static_cast<std::size_t>(off_number(words[0], source_.file));
    if (words.size() < corners + 1) return kByLines;
    for (std::uint32_t p = first_piece_[face]; p < first_piece_[face + 1]; ++p) {
      out_ += fmt::format("{}", refinement_.offsets[p + 1] - refinement_.offsets[p]);
      for (std::uint32_t i = refinement_.offsets[p]; i < refinement_.offsets[p + 1]; ++i)
        out_ += fmt::format(" {}", refinement_.corners[i]);
      for (std::size_t i = corners + 1; i < words.size(); ++i) out_ += fmt::format(" {}", words[i]);
      out_ += '\n';
    }
    return "";
  }

  void add_line(std::string_view line) {
    out_ += line;
    if (!line.ends_with('\n')) out_ += '\n';
  }

  // Whether the colour is in whole numbers, 0 to 255.
  [[nodiscard]] bool is_whole(const OffWords& words) const {
    for (std::size_t i = first_of_color(); i < end_of_color(words.size()); ++i)
      if (words[i].find_first_of(".eE") != std::string_view::npos) return false;
    return true;
  }
  [[nodiscard]] std::size_t first_of_color() const { return has_normals_ ? 6 : 3; }
  [[nodiscard]] std::size_t end_of_color(std::size_t words) const { return texture_ ? words - 2 : words; }

  void add_new_vertices() {
    for (const auto& [a, b] : refinement_.ends) {
      std::vector<double> numbers;
      const bool whole = whole_[a] && whole_[b];
      const std::size_t count = std::min(vertices_[a].size(), vertices_[b].size());
      for (std::size_t i = 0; i < count; ++i) numbers.push_back(0.5 * (vertices_[a][i] + vertices_[b][i]));
      if (has_normals_ && count >= 6) {
        const auto normal = [&](std::uint32_t v) {
          return Vec3(vertices_[v][3], vertices_[v][4], vertices_[v][5]);
        };
        const Vec3 mean = mean_normal(normal(a), normal(b));
        for (std::size_t i = 0; i < 3; ++i) numbers[3 + i] = mean[static_cast<Eigen::Index>(i)];
      }
      for (std::size_t i = first_of_color(); whole && i < end_of_color(count); ++i)
        numbers[i] = std::round(numbers[i]);
      for (std::size_t i = 0; i < count; ++i)
        out_ += fmt::format("{}{}", i == 0 ? "" : " ", text_of(numbers[i], i, whole, count));
      out_ += '\n';
      vertices_.push_back(std::move(numbers));
      whole_.push_back(whole);
    }
  }

  // A colour from 0 to 1 keeps its point, which tells it from one up to 255.
  [[nodiscard]] std::string text_of(double value, std::size_t i, bool whole, std::size_t count) const {
    std::string text = fmt::format("{}", value);
    const bool color = i >= first_of_color() && i < end_of_color(count);
    if (color && !whole && text.find_first_of(".eE") == std::string::npos) text += ".0";
    return text;
  }

  const SurfaceSource& source_;
  const Refinement& refinement_;
  const std::vector<std::uint32_t> first_piece_;
  std::string_view text_;
  bool has_normals_ = false, texture_ = false;
  std::vector<std::vector<double>> vertices_;
  std::vector<std::uint8_t> whole_;  // (vertices)
  std::size_t done_ = 0;
  std::string out_;
};

}  // namespace

std::string refine_off(SurfaceSource& source, const Refinement& refinement) {
  Bytes bytes;
  const std::string held = OffRefinement(source, refinement).run(bytes);
  if (held.empty()) source.bytes = std::move(bytes);
  return held;
}

}  // namespace flexel
