// flexel view: results in the browser, from a page that is served to this machine or written to a file.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "base/error.h"
#include "base/files/memory_file.h"
#include "base/files/outputs.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/standard_output.h"
#include "base/program/termination.h"
#include "base/stop.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/picture_command.h"
#include "flexel/view/page.h"
#include "flexel/view/serve.h"
#include "formats/exchange/import.h"
#include "formats/lattice/body_file.h"

namespace flexel::commands {
namespace {

constexpr std::size_t kMostFiles = 16;  // side by side

struct ViewArguments {
  std::vector<std::string> files;
  std::string html, summary, colour, scale = "auto", up = "z", limit = "50", unit, input_format;
  bool cells = false, quiet = false, force = false;
  int threads = 0;
};

void declare(CommandLine& app, ViewArguments& a) {
  app.add_option("file", a.files, "Parts (STEP, STL, OBJ ...), bodies (.vtu) and series (.pvd); -: stdin")
      .required()
      .type_name("FILE");
  app.add_option("--html", a.html, "Write the page to this file instead: it needs no server and no network")
      .type_name("FILE");
  app.add_option("--summary", a.summary, "Show what the run found too: the summary that it wrote (JSON)")
      .type_name("FILE");
  app.add_option("--color,--colour", a.colour,
                 "Begin with these colours: displacement, strain, any attribute, or none")
      .type_name("NAME");
  app.add_option("--scale", a.scale,
                 "Begin with displacements this many times as large; auto: so that they are seen")
      .type_name("FACTOR")
      .show_default();
  declare_up(app, a.up);
  app.add_flag("--cells", a.cells, "Take the cells of bodies along, to be shown in place of the surface");
  app.add_option("--limit", a.limit, "The largest file that --html writes, in megabytes")
      .type_name("MB")
      .show_default();
  declare_import_to_draw(app, a.unit, a.input_format);
  add_threads_option(app, a.threads);
  app.add_flag("--quiet", a.quiet, "Say only warnings and errors");
  app.add_flag("--force", a.force, "Let the page replace a file that is read");
}

double positive(const std::string& text, const std::string& option, bool zero_too) {
  double value = 0;
  if (!is_number(text, value) || !std::isfinite(value) || value < 0 || (value == 0 && !zero_too))
    throw InputError(fmt::format("{} {}: a number {} is needed{}", option, text,
                                 zero_too ? "from 0 on" : "above 0", option == "--scale" ? ", or auto" : ""));
  return value;
}

view::PageOptions options_of(const ViewArguments& a) {
  view::PageOptions options;
  options.colour = a.colour;
  options.up = a.up[0];
  if (a.scale != "auto") options.exaggeration = positive(a.scale, "--scale", true);
  if (!a.summary.empty()) {
    const Bytes bytes = read_all(a.summary);
    options.words.summary.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return options;
}

view::ViewSubject read_view_subject(const std::string& path, const ImportOptions& import) {
  view::ViewSubject subject;
  subject.where = path == "-" ? "stdin" : path;
  subject.label = path == "-" ? "stdin" : std::filesystem::path(path).filename().string();
  if (std::filesystem::is_directory(path))
    throw InputError(path, "is a folder: of a study open its study.html, else name the files in it");
  if (extension(path) == "pvd") {
    subject.series = path;
  } else if (path == "-" || extension(path) == "vtu") {
    Bytes bytes = read_all(path);
    if (looks_like_body(bytes)) {
      subject.body = path == "-" ? read_body(std::move(bytes), subject.where) : read_body(path);
    } else {
      const MemoryFile file(bytes);
      try {
        subject.surface = import_surface(file.path(), import);
      } catch (const InputError& error) {
        const std::string path_now = file.path();
        if (!error.where().starts_with(path_now)) throw;
        throw InputError(subject.where + error.where().substr(path_now.size()), error.what());
      }
    }
  } else {
    subject.surface = import_surface(path, import);
  }
  return subject;
}

std::vector<view::ViewFile> read_files(const ViewArguments& arguments, Progress& progress) {
  const ImportOptions import = import_to_draw(arguments.unit, arguments.input_format);
  const view::ViewOptions options{arguments.cells, arguments.colour};
  std::vector<view::ViewFile> files;
  std::vector<view::NoSuchAttribute> grey;  // sound where another file has it
  for (const std::string& path : arguments.files) {
    progress.stage("read " + path);
    const view::ViewSubject subject = read_view_subject(path, import);
    if (arguments.cells && !subject.body)
      progress.warn(fmt::format("{}: --cells is for bodies (.vtu), and this is a {}: its surface is shown",
                                subject.where, subject.series.empty() ? "part" : "series"));
    try {
      files.push_back(make_view_file(subject, options, progress));
    } catch (const view::NoSuchAttribute& error) {
      grey.push_back(error);
      files.push_back(make_view_file(subject, {arguments.cells}, progress));
    }
  }
  if (grey.size() == files.size()) throw grey.front();
  progress.finish();
  return files;
}

void check(const ViewArguments& a) {
  if (a.files.size() > kMostFiles)
    throw InputError(fmt::format("{} files: at most {} are shown side by side", a.files.size(), kMostFiles));
  if (std::count(a.files.begin(), a.files.end(), "-") > 1)
    throw InputError("only one input can come from stdin");
  if (!a.html.empty() && a.html != "-" && extension(a.html) != "html" && extension(a.html) != "htm")
    throw InputError(fmt::format("--html {}: pages are HTML: name it {}.html", a.html, stem(a.html)));
  std::vector<std::string> inputs = a.files;
  inputs.push_back(a.summary);
  check_outputs({{a.html}}, inputs, a.force);
}

void serve(const std::vector<view::ViewFile>& files, const view::PageOptions& options, Progress& progress) {
  const view::PageServer server(make_page(files, options, false));
  print_to_stdout(server.url() + "\n");
  progress.say("open this in a browser on this machine; Ctrl-C ends it");
  while (true) {
    check_stop();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

}  // namespace

int view_command(int argc, char** argv) {
  ViewArguments arguments;
  CommandLine app{"Parts, bodies and series in the browser: turned, coloured, cut, probed, side by side.",
                  "flexel view"};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  check(arguments);
  const double limit = 1e6 * positive(arguments.limit, "--limit", false);
  view::PageOptions options = options_of(arguments);
  const ThreadLimit threads(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  std::vector<view::ViewFile> files;
  {
    const StopEndsProcess nothing_is_left;
    files = read_files(arguments, progress);
  }
  if (arguments.html.empty()) serve(files, options, progress);
  write_page(files, options, limit, " (--limit)", arguments.html);
  if (arguments.html != "-")
    progress.say(fmt::format("{}: {}", arguments.html,
                             human_bytes(static_cast<double>(std::filesystem::file_size(arguments.html)))));
  return kExitDone;
}

}  // namespace flexel::commands
