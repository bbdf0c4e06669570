// The page of flexel view: HTML that needs nothing else, or that asks its server for the geometry.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/files/files.h"
#include "flexel/view/view_file.h"

namespace flexel::view {

// What the run said, which the page shows.
struct RunWords {
  std::vector<std::string> warnings, lines;
  std::string summary;  // JSON, or ""; what it holds under "warnings" is shown first
};

struct PageOptions {
  std::string colour;                  // an attribute or "none"; "": displacement where something moved
  std::optional<double> exaggeration;  // of displacements; nothing: so that they are seen
  char up = 'z';                       // the axis of the files that points up
  RunWords words;
  // JSON of the hands' controls where the page is of flexel clay (page/clay.js); "" for a page to be looked at
  std::string clay;
};

struct Page {
  std::string html;
  std::vector<Bytes> data;  // what it fetches as data/0, data/1 ...; none where it holds them
};

// The data of one file, as the page takes it (pack.h); `quick`: for a page on this machine that waits for it.
[[nodiscard]] Bytes pack_file(const ViewFile& file, bool quick = false);

// `whole`: the page holds its data. Throws InputError(where the summary is no JSON).
[[nodiscard]] Page make_page(const std::vector<ViewFile>& files, const PageOptions& options, bool whole);

constexpr double kUsualLimit = 50e6;  // bytes: what mail takes, twice

struct PageTooLarge : InputError {
  using InputError::InputError;
};

// Writes the whole page. Throws PageTooLarge: than `limit` [bytes], which `option` raises; InputError: the disk.
void write_page(const std::vector<ViewFile>& files, const PageOptions& options, double limit,
                const std::string& option, const std::string& path);

// Bytes of the page itself, without data.
[[nodiscard]] std::size_t page_weight();

// What a browser lets the page do: run its own scripts, marked with `nonce`, and talk to its own server alone.
[[nodiscard]] std::string content_policy(const std::string& nonce, bool whole);

}  // namespace flexel::view
