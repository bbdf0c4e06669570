// Two names mean the same file when device and inode agree or, where one does not exist yet, when folder and
// name agree. A name may stand for many files: the frames of a series, or a file a part. What such a name may
// replace is what lies there already, and an input does.
#include "base/files/outputs.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"

namespace flexel {
namespace {

namespace fs = std::filesystem;

bool is_pattern(const std::string& path) {
  return path.find("{part}") != std::string::npos || path.find("{frame}") != std::string::npos;
}

bool stands_for_many(const OutputName& output) {
  return !output.literal && is_pattern(output.path);
}

// What glob() takes for itself alone.
std::string literal(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '*' || c == '?' || c == '[' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::vector<std::string> files_like(const std::string& pattern) {
  glob_t found{};
  std::vector<std::string> files;
  if (::glob(pattern.c_str(), GLOB_PERIOD, nullptr, &found) == 0)
    files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  return files;
}

bool can_be_shared(const std::string& path) {
  std::error_code none;
  return fs::is_character_file(path, none);
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code none;
  if (fs::exists(a, none) && fs::exists(b, none)) return fs::equivalent(a, b, none);
  const auto place = [&](const std::string& path) {
    return fs::weakly_canonical(fs::absolute(follow_links(path), none), none);
  };
  const fs::path first = place(a);
  return !first.empty() && first == place(b);
}

}  // namespace

std::vector<std::string> files_replaced(const std::string& path, bool literal_braces) {
  if (!literal_braces && is_pattern(path)) {
    std::string pattern = literal(path);
    for (const std::string place : {"{part}", "{frame}"})
      for (std::size_t at = pattern.find(place); at != std::string::npos; at = pattern.find(place))
        pattern.replace(at, place.size(), "*");
    return files_like(pattern);
  }
  std::vector<std::string> files;
  if (std::error_code none; fs::exists(path, none)) files.push_back(path);
  if (extension(path) != "pvd" || (!literal_braces && is_pattern(path))) return files;
  const std::string before = path.substr(0, path.size() - 4) + "_", after = ".vtu";
  for (const std::string& frame : files_like(literal(before) + "*" + after)) {
    const std::string number = frame.substr(before.size(), frame.size() - before.size() - after.size());
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string::npos)
      files.push_back(frame);
  }
  return files;
}

namespace {

// Throws InputError where `path` would or may replace one of `inputs`.
void keep_inputs(const OutputName& output, const std::vector<std::string>& inputs) {
  const std::string& path = output.path;
  const auto is_input = [&](const std::string& file) {
    return std::any_of(inputs.begin(), inputs.end(), [&](const std::string& input) {
      return !input.empty() && input != "-" && same_file(file, input);
    });
  };
  const std::string what = "is an input of this command",
                    advice = "name another output, or add --force to replace it";
  if (is_input(path)) throw InputError(path, fmt::format("{}: {}", what, advice));
  const bool series = extension(path) == "pvd" && !stands_for_many(output);
  for (const std::string& file : files_replaced(path, output.literal))
    if (is_input(file))
      throw InputError(file, fmt::format("{} and fits the name of a result, {}: {}", what,
                                         series ? "a frame of " + path : path, advice));
}

}  // namespace

void check_outputs(const std::vector<OutputName>& outputs, const std::vector<std::string>& inputs,
                   bool force) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::string& path = outputs[i].path;
    if (path.empty()) continue;
    for (std::size_t j = 0; j < i && !stands_for_many(outputs[i]); ++j) {
      const std::string& other = outputs[j].path;
      if (other.empty() || stands_for_many(outputs[j])) continue;
      if (means_stdout(path) && means_stdout(other))
        throw InputError("two results would go to stdout: give one of them a file");
      if (!means_stdout(path) && !means_stdout(other) && !can_be_shared(path) && same_file(path, other))
        throw InputError(fmt::format("two results would go to \"{}\": give each a name of its own", path));
    }
    if (!means_stdout(path) && !can_be_shared(path) && !force) keep_inputs(outputs[i], inputs);
  }
  for (const OutputName& output : outputs)
    if (!stands_for_many(output)) refuse_unwritable(output.path, output.binary);
}

}  // namespace flexel
