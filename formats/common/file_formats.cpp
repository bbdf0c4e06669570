// The one place where the rows come together. Their order is that of messages and help texts.
#include "formats/common/file_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace flexel {
namespace {

// Our own first, then those of assimp.
const std::vector<const FileFormat*>& all_formats() {
  static const std::vector<const FileFormat*> kAll = [] {
    std::vector<const FileFormat*> all = {&kStepFormat, &kIgesFormat, &kBrepFormat, &kStlFormat, &kObjFormat,
                                          &kPlyFormat,  &kOffFormat,  &kGltfFormat, &k3mfFormat, &kVdbFormat};
    for (const FileFormat& format : assimp_formats()) all.push_back(&format);
    return all;
  }();
  return kAll;
}

// "a, b or c".
std::string listed(const std::vector<std::string>& words, std::string_view last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 < words.size() ? ", " : fmt::format(" {} ", last);
    text += words[i];
  }
  return text;
}

}  // namespace

std::span<const FileFormat* const> file_formats() {
  return all_formats();
}

const FileFormat* format_named(std::string_view name) {
  for (const FileFormat* format : all_formats())
    if (format->name == name ||
        std::find(format->extensions.begin(), format->extensions.end(), name) != format->extensions.end())
      return format;
  return nullptr;
}

const FileFormat* format_of(const SurfaceSource& source) {
  for (const FileFormat* format : all_formats())
    if (is_format(source, *format)) return format;
  return nullptr;
}

bool carries_unit(const SurfaceSource& source) {
  const FileFormat* format = format_of(source);
  return format != nullptr && format->carries_unit;
}

bool is_cad(const SurfaceSource& source) {
  const FileFormat* format = format_of(source);
  return format != nullptr && format->is_cad;
}

bool is_rewritten(const SurfaceSource& source) {
  const FileFormat* format = format_of(source);
  return format != nullptr && format->rewrite != nullptr;
}

std::vector<std::string> read_formats() {
  std::vector<std::string> names;
  for (const FileFormat* format : all_formats()) names.emplace_back(format->name);
  return names;
}

std::vector<std::string> written_formats(bool cad) {
  std::vector<std::string> names;
  for (const FileFormat* format : all_formats())
    if (format->write_new != nullptr || (cad && format->is_cad)) names.emplace_back(format->name);
  return names;
}

std::string read_titles(bool cad) {
  std::vector<std::string> titles;
  for (const FileFormat* format : all_formats())
    if ((cad || !format->is_cad) && !format->by_assimp) titles.emplace_back(format->title);
  constexpr std::size_t kNamed = 6;  // those that parts come in
  for (const FileFormat& format : assimp_formats().first(kNamed)) titles.emplace_back(format.title);
  titles.emplace_back("another that assimp reads");
  return listed(titles, "or");
}

std::string capitals(const FileFormat& format) {
  std::string text(format.name);
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string written_titles(bool (*holds)(const FileFormat&), std::string_view last) {
  std::vector<std::string> titles;
  for (const FileFormat* format : all_formats())
    if (format->write_new != nullptr && holds(*format)) titles.push_back(capitals(*format));
  return listed(titles, last);
}

}  // namespace flexel
