// The command line's words for cracks, for flexel-map and flexel deform.
#include <fmt/format.h>

#include <filesystem>

#include "formats/error.h"
#include "formats/program.h"
#include "mapping/crack.h"

namespace flexel {
namespace {

constexpr std::string_view kPlace = "{piece}";

// The path of every piece's file, as write_parts() wants it.
std::string pattern_of(const std::string& pieces, const std::string& format) {
  std::string path = pieces;
  bool named = names_parts(path);
  for (std::size_t at = path.find(kPlace); at != std::string::npos; at = path.find(kPlace, at)) {
    path.replace(at, kPlace.size(), "{part}");
    named = true;
  }
  if (named) return path;
  if (std::error_code error; !std::filesystem::is_directory(path, error))
    throw InputError(
        fmt::format("--pieces: \"{}\" is no folder; make it, or give a path with {{piece}} in it, such as "
                    "out/{{piece}}.stl",
                    pieces));
  return (std::filesystem::path(path) / ("{part}." + (format.empty() ? "stl" : format))).string();
}

}  // namespace

CrackOptions crack_options(const std::string& mode, const std::string& debris, const std::string& pieces,
                           const std::string& format, bool ascii) {
  CrackOptions options;
  options.mode = crack_mode(mode);
  const std::vector<std::string> words = {"keep", "drop"};
  if (debris != words[0] && debris != words[1])
    throw InputError(
        fmt::format("unknown word \"{}\": --debris is keep or drop{}", debris, did_you_mean(debris, words)));
  options.drop_debris = debris == words[1];
  if (options.mode == CrackMode::keep && options.drop_debris)
    throw InputError("--debris drop needs --crack open or cap: else debris is not told from the rest");
  if (pieces.empty()) return options;
  if (options.mode == CrackMode::keep)
    throw InputError("--pieces needs --crack open or cap: else there are no pieces");
  options.pieces = pattern_of(pieces, format);
  options.pieces_format = surface_format("", options.pieces, ascii);
  return options;
}

}  // namespace flexel
