// flexel picture: surfaces and bodies as a picture file, without a display.
#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>

#include "base/error.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/picture/canvas/png_file.h"
#include "flexel/picture/picture.h"
#include "flexel/picture_command.h"
#include "formats/exchange/import.h"
#include "formats/lattice/body_file.h"

namespace flexel::commands {
namespace {

constexpr int kLargestSide = 16384, kSmallestSide = 64;
constexpr double kMostPixels = 40e6;  // about a hundred bytes each while the picture is made

struct PictureArguments {
  std::vector<std::string> files;
  std::string output, colour, range, scale = "1", view = "auto", up = "z", size = "1600x1200", unit,
                                     input_format;
  bool cells = false, elements = false, faces = false, no_outline = false, quiet = false, force = false;
  int threads = 0;
};

void declare_files(CommandLine& app, PictureArguments& a) {
  app.add_option("file", a.files, "Parts (STEP, STL, OBJ ...) and bodies (.vtu); -: stdin")
      .required()
      .type_name("FILE");
  app.add_option("-o,--output", a.output, "The picture (.png); -: stdout").required().type_name("FILE");
  declare_import_to_draw(app, a.unit, a.input_format);
  app.add_flag("--quiet", a.quiet, "Say only warnings and errors");
  app.add_flag("--force", a.force, "Let the picture replace a file that is read");
}

void declare_drawing(CommandLine& app, PictureArguments& a) {
  app.add_option("--color,--colour", a.colour,
                 "displacement, strain, fill, thickness, any attribute, or none")
      .type_name("NAME");
  app.add_option("--range", a.range, "Values at the ends of the colour map, such as \"0:5 mm\"")
      .type_name("LOW:HIGH");
  app.add_option("--scale", a.scale,
                 "Draw displacements this many times as large; auto: so that they are seen")
      .type_name("FACTOR")
      .show_default();
  app.add_option("--view", a.view,
                 "auto, iso, front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees")
      .type_name("VIEW")
      .show_default();
  declare_up(app, a.up);
  app.add_option("--size", a.size, "Pixels").type_name("WIDTHxHEIGHT").show_default();
  app.add_flag("--cells", a.cells, "Draw the cells of a body instead of its surface");
  app.add_flag("--elements", a.elements, "Draw the elements of a body instead of its surface");
  app.add_flag("--faces", a.faces,
               "Write the numbers of the faces on them (part/3), from four sides without --view");
  app.add_flag("--no-outline", a.no_outline, "Leave out the shape at rest");
  add_threads_option(app, a.threads);
}

double number(const std::string& text, const std::string& option) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size() || !std::isfinite(value))
    throw InputError(fmt::format("{} \"{}\": a number is needed", option, text));
  return value;
}

void parse_size(const std::string& text, picture::PictureOptions& options) {
  int end = 0;
  if (std::sscanf(text.c_str(), "%5d%*1[xX]%5d%n", &options.width, &options.height, &end) != 2 ||
      static_cast<std::size_t>(end) != text.size())
    throw InputError(
        fmt::format("--size \"{}\": write it as WIDTHxHEIGHT in pixels, such as 1600x1200", text));
  for (const int side : {options.width, options.height})
    if (side < kSmallestSide || side > kLargestSide)
      throw InputError(
          fmt::format("--size {}: a side has {} to {} pixels", text, kSmallestSide, kLargestSide));
  if (static_cast<double>(options.width) * options.height > kMostPixels)
    throw InputError(fmt::format("--size {}: at most {:g} million pixels", text, kMostPixels / 1e6));
}

picture::PictureOptions options_of(const PictureArguments& a) {
  picture::PictureOptions options;
  parse_size(a.size, options);
  options.view = picture::parse_view(a.view);
  options.up = a.up == "x" ? picture::Up::x : a.up == "y" ? picture::Up::y : picture::Up::z;
  if (a.cells && a.elements) throw InputError("--cells and --elements exclude each other: give one of them");
  if (a.cells) options.show = picture::PictureOptions::Show::cells;
  if (a.elements) options.show = picture::PictureOptions::Show::elements;
  options.faces = a.faces;
  if (!a.colour.empty()) options.colour = a.colour;
  options.outline_at_rest = !a.no_outline;
  options.exaggeration = std::nullopt;
  if (a.scale != "auto") {
    options.exaggeration = number(a.scale, "--scale");
    if (!(*options.exaggeration >= 0))
      throw InputError(fmt::format("--scale {}: zero or more is needed, or auto", a.scale));
  }
  if (!a.range.empty()) {
    const std::size_t colon = a.range.find(':');
    if (colon == std::string::npos)
      throw InputError(fmt::format("--range \"{}\": write it as LOW:HIGH, such as \"0:5 mm\"", a.range));
    options.range = {a.range.substr(0, colon), a.range.substr(colon + 1)};
  }
  return options;
}

// A file that can be read twice: what stdin or a FIFO gives is kept in an unnamed temporary file.
class Input {
 public:
  explicit Input(const std::string& path) : path_(path), where_(path == "-" ? "stdin" : path) {
    struct stat status {};
    if (path != "-" &&
        (stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)))
      return;
    const Bytes bytes = read_all(path);
    spool_.reset(std::tmpfile());
    if (!spool_ || std::fwrite(bytes.data(), 1, bytes.size(), spool_.get()) != bytes.size() ||
        std::fflush(spool_.get()) != 0)
      throw InputError(where_, "cannot be kept in a temporary file: is the folder for temporary files full?");
    path_ = fmt::format("/proc/self/fd/{}", fileno(spool_.get()));
  }
  // What read(path) gives; errors speak of the user's own name for it.
  template <class Read>
  auto read(const Read& use) const {
    try {
      return use(path_);
    } catch (const InputError& error) {
      if (error.where() != path_) throw;
      throw InputError(where_, error.what());
    }
  }
  [[nodiscard]] bool is_body() const {
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path_.c_str(), "rb"), std::fclose);
    Bytes head(1024);
    if (file) head.resize(std::fread(head.data(), 1, head.size(), file.get()));
    return file && looks_like_body(head);
  }
  [[nodiscard]] const std::string& where() const { return where_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string path_, where_;
  std::unique_ptr<std::FILE, Close> spool_;
};

picture::PictureSubject read_subject(const std::string& path, const ImportOptions& import) {
  const Input input(path);
  picture::PictureSubject subject;
  subject.where = input.where();
  subject.label = path == "-" ? "stdin" : std::filesystem::path(path).filename().string();
  if (input.is_body())
    subject.body = input.read([](const std::string& p) { return read_body(p); });
  else
    subject.surface = input.read([&](const std::string& p) { return import_surface(p, import); });
  return subject;
}

void check_output(const std::string& output) {
  if (output != "-" && extension(output) != "png")
    throw InputError(fmt::format("-o {}: pictures are written as PNG: name it {}.png", output, stem(output)));
}

}  // namespace

void declare_up(CommandLine& app, std::string& up) {
  app.add_option("--up", up, "The axis that points up: x, y (glTF, many OBJ files) or z")
      .one_of({"x", "y", "z"})
      .type_name("AXIS")
      .show_default();
}

void declare_import_to_draw(CommandLine& app, std::string& unit, std::string& format) {
  app.add_option("--unit", unit, "Unit of files that carry none (default mm)").type_name("UNIT");
  app.add_option("--input-format", format, "Format of the files, where their bytes do not tell")
      .type_name("NAME");
}

ImportOptions import_to_draw(const std::string& unit, const std::string& format) {
  ImportOptions import;
  import.largest_edge = std::numeric_limits<double>::infinity();  // flat faces need no splitting to be drawn
  import.angular_deflection = 0.12;                               // round ones should look round
  if (!unit.empty()) import.unit = length_unit(unit);
  if (!format.empty()) import.format = format;
  return import;
}

int picture_command(int argc, char** argv) {
  PictureArguments arguments;
  CommandLine app{"A picture (PNG) of parts and bodies, made without a display.", "flexel picture"};
  declare_files(app, arguments);
  declare_drawing(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const StopEndsProcess nothing_is_left;
  check_output(arguments.output);
  check_outputs({{arguments.output, true}}, arguments.files, arguments.force);
  const picture::PictureOptions options = options_of(arguments);
  const ImportOptions import = import_to_draw(arguments.unit, arguments.input_format);
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("read");
  std::vector<picture::PictureSubject> subjects;
  for (const std::string& file : arguments.files) subjects.push_back(read_subject(file, import));
  progress.stage("picture");
  const picture::PictureResult picture = draw_picture(subjects, options, progress);
  progress.finish();
  for (const std::string& note : picture.notes) progress.say(note);
  const Bytes bytes = encode_png(picture.image);
  OutputFile out(arguments.output);
  out.write(bytes.data(), bytes.size());
  out.commit();
  return kExitDone;
}

picture::PictureResult draw_subjects(const std::vector<std::string>& arguments,
                                     const std::vector<picture::PictureSubject>& subjects,
                                     Progress& progress) {
  PictureArguments given;
  CommandLine app{"A picture of what is in memory.", "flexel picture"};
  declare_drawing(app, given);
  std::vector<std::string> words = {"picture"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  if (!parse_arguments(app, static_cast<int>(words.size()), pointers.data()))
    throw InputError("help is no picture: leave --help out");
  const picture::PictureOptions options = options_of(given);
  const ThreadLimit limit(given.threads);
  progress.stage("picture");
  return draw_picture(subjects, options, progress);
}

}  // namespace flexel::commands
