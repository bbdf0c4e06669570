// Two names mean the same file when device and inode agree or, where one does not exist yet, when folder and
// name agree.
#include "base/files/outputs.h"

#include <fmt/format.h>

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

// Whether a name is that of a frame of the series NAME.pvd: NAME_00000.vtu.
bool is_frame_name(const std::string& name, const std::string& series) {
  if (!name.starts_with(series + "_") || !name.ends_with(".vtu")) return false;
  const std::string number = name.substr(series.size() + 1, name.size() - series.size() - 5);
  return number.size() >= 5 &&
         std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// The file that a series (.pvd) at `path` would put a frame in place of, one of the inputs; "" where there is none.
std::string replaced_by_frames(const std::string& path, const std::vector<std::string>& inputs) {
  if (extension(path) != "pvd") return "";
  std::error_code none;
  const fs::path folder = fs::absolute(path, none).parent_path();
  for (fs::directory_iterator each(folder, none), end; each != end; each.increment(none)) {
    if (!is_frame_name(each->path().filename().string(), stem(path))) continue;
    for (const std::string& input : inputs)
      if (!input.empty() && input != "-" && fs::equivalent(each->path(), input, none)) return input;
  }
  return "";
}

}  // namespace

void check_outputs(const std::vector<OutputName>& outputs, const std::vector<std::string>& inputs,
                   bool force) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::string& path = outputs[i].path;
    if (path.empty() || is_pattern(path)) continue;
    for (std::size_t j = 0; j < i; ++j) {
      const std::string& other = outputs[j].path;
      if (other.empty() || is_pattern(other)) continue;
      if (means_stdout(path) && means_stdout(other))
        throw InputError("two results would go to stdout: give one of them a file");
      if (!means_stdout(path) && !means_stdout(other) && !can_be_shared(path) && same_file(path, other))
        throw InputError(fmt::format("two results would go to \"{}\": give each a name of its own", path));
    }
    if (means_stdout(path) || can_be_shared(path) || force) continue;
    for (const std::string& input : inputs)
      if (!input.empty() && input != "-" && same_file(path, input))
        throw InputError(path,
                         "is an input of this command: name another output, or add --force to replace it");
    if (const std::string input = replaced_by_frames(path, inputs); !input.empty())
      throw InputError(path,
                       fmt::format("its frames are named like {}, an input of this command: name another "
                                   "output, or add --force to replace it",
                                   input));
  }
  for (const OutputName& output : outputs)
    if (!is_pattern(output.path)) refuse_unwritable(output.path, output.binary);
}

}  // namespace flexel
