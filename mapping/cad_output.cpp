// flexel-cad does the work (cad/deform); here its answer is put into words.
#include "mapping/cad_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/resources.h"
#include "base/units.h"
#include "formats/cad/cad_job.h"
#include "formats/common/file_formats.h"
#include "formats/lattice/body_file.h"

namespace flexel::mapping {
namespace {

constexpr double kTolerance = 1e-4;       // of the diagonal, where none is given
constexpr double kLeastTolerance = 1e-7;  // of the diagonal: below it OpenCASCADE takes points for one
constexpr double kWideGap = 3;            // tolerances
constexpr double kVolumeShare = 1e-3;  // by which the volumes of the faces and of the triangles may go apart

// --tolerance: a share of the diagonal of all parts together, or a length [m].
struct Tolerance {
  double value = kTolerance;
  bool is_share = true;
};

Tolerance parse_tolerance(const std::string& text) {
  Tolerance found;
  if (text.empty()) return found;
  found.is_share = is_number(text, found.value);
  if (!found.is_share) found.value = parse_quantity(text, Dimension::length);
  if (!(found.value > 0) || !std::isfinite(found.value) || (found.is_share && found.value >= 1))
    throw InputError(fmt::format(
        "--tolerance: \"{}\" is neither a share of the diagonal (1e-4) nor a length (10um)", text));
  return found;
}

// m
double tolerance_of(const std::string& text, const Body& body) {
  const Tolerance asked = parse_tolerance(text);
  const double diagonal = bounding_box(body.surface.vertices).diagonal();
  const double share = asked.is_share ? asked.value : asked.value / diagonal;
  if (share >= 1)
    throw InputError("--tolerance: must be below the part's diagonal, " + human_length(diagonal));
  if (share < kLeastTolerance)
    throw InputError(
        fmt::format("--tolerance: faces cannot be told apart below {:g} of the part's diagonal, {}: give "
                    "more",
                    kLeastTolerance, human_length(kLeastTolerance * diagonal)));
  return share * diagonal;
}

// "a, b, c and 12 others".
std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  if (names.size() <= kShown) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} others", fmt::join(names.begin(), names.begin() + kShown, ", "),
                     names.size() - kShown);
}

// What is wrong with it, a line each.
std::vector<std::string> faults(const CadWritten& written, const MapReport& found, double scale) {
  std::vector<std::string> lines;
  if (!written.folded.empty())
    lines.push_back(fmt::format("the deformation turns space inside out at {}: their faces are folded",
                                some_of(written.folded)));
  if (!written.missed.empty()) {
    std::vector<std::string> names;
    for (const CadFace& face : written.missed)
      names.push_back(fmt::format("{} ({})", face.name, human_length(face.deviation)));
    lines.push_back(fmt::format(
        "{} not within the tolerance of {}: {}; a larger --tolerance, or a finer --size, may do",
        names.size() == 1 ? "a face is" : "faces are", human_length(written.tolerance), some_of(names)));
  }
  if (written.gap > kWideGap * written.tolerance)
    lines.push_back(
        fmt::format("edges are up to {} from the faces that meet in them: a finer --size may close them",
                    human_length(written.gap)));
  std::vector<std::string> newly;
  for (const std::string& name : written.invalid)
    if (std::find(written.invalid_before.begin(), written.invalid_before.end(), name) ==
        written.invalid_before.end())
      newly.push_back(name);
  if (!newly.empty())
    lines.push_back(
        fmt::format("OpenCASCADE's check finds {} not valid: look at it in your CAD program, or write a "
                    "mesh (STL, OBJ, ...)",
                    some_of(newly)));
  if (!written.invalid_before.empty())
    lines.push_back(fmt::format("OpenCASCADE's check finds {} not valid, as it was in the file read",
                                some_of(written.invalid_before)));
  const SurfaceQuality& mesh = found.quality;
  const double faces = written.volume / written.volume_before,
               triangles = mesh.volume_after / mesh.volume_before;
  if (scale == 1 && std::isfinite(triangles) && found.valid() && std::abs(faces - triangles) > kVolumeShare)
    lines.push_back(
        fmt::format("the volume of the faces changed by {:.2f} %, that of the mapped triangles by {:.2f} %",
                    100 * (faces - 1), 100 * (triangles - 1)));
  return lines;
}

// Of one file, as it was read again.
std::string fault_of(const CadWritten& written, const CadFile& file, const std::string& title) {
  if (file.invalid_again == 0 || !written.invalid.empty()) return "";
  return fmt::format(
      "OpenCASCADE's check finds {} of the {} file, read again, not valid: look at it in your CAD "
      "program, or write a mesh (STL, OBJ, ...)",
      counted(file.invalid_again, "solid"), title);
}

std::string line_of(const CadWritten& written, const CadFile& file, const std::string& title) {
  const std::string others =
      written.kept == written.faces
          ? "all as before, moved"
          : fmt::format("{} as before, the others within {} of the deformation{}", written.kept,
                        human_length(written.deviation),
                        written.deviation_face.empty() ? "" : " (" + written.deviation_face + ")");
  const bool valid = written.invalid.empty() && file.invalid_again == 0;
  return fmt::format("{}: {} of {}, {}; {}", title, counted(written.solids, "solid"),
                     counted(written.faces, "face"), others,
                     valid ? "valid, also when read again" : "not valid");
}

std::string json_of(const CadWritten& written, const CadFile& file, const MapOutput& output) {
  std::vector<std::string> invalid = written.invalid;
  if (invalid.empty() && file.invalid_again > 0) invalid.emplace_back("a solid, read again");
  nlohmann::ordered_json json = {{"file", output.path},
                                 {"format", output.format->file->name},
                                 {"solids", written.solids},
                                 {"faces", written.faces},
                                 {"faces_kept", written.kept},
                                 {"tolerance", written.tolerance},
                                 {"deviation", written.deviation},
                                 {"deviation_face", written.deviation_face},
                                 {"missed", nlohmann::ordered_json::array()},
                                 {"folded", written.folded},
                                 {"valid", invalid.empty()},
                                 {"invalid", invalid},
                                 {"invalid_before", written.invalid_before},
                                 {"largest_gap", written.gap},
                                 {"volume_before", written.volume_before},
                                 {"volume_after", written.volume}};
  for (const CadFace& face : written.missed)
    json["missed"].push_back({{"face", face.name}, {"deviation", face.deviation}});
  return json_text(json);
}

ChildLimits limits_of(const Body& body) {
  double bytes = 0;
  for (const SurfaceSource& source : body.surface.sources) bytes += static_cast<double>(source.bytes.size());
  return limits_of_child(600 + 1e-3 * bytes, .8 * available_memory());
}

void refuse_meshes(const Body& body, const MapReport& found, const std::string& title) {
  for (const SurfaceSource& source : body.surface.sources)
    if (!is_cad(source) || source.bytes.empty())
      throw InputError(source.file,
                       fmt::format("has no CAD faces that {} could hold: write a mesh (STL, OBJ, ...), or "
                                   "start from a STEP, IGES or BREP file",
                                   title));
  if (found.crack.spanning_triangles > 0)
    throw InputError(fmt::format(
        "the part broke, and {} keeps its faces whole: write a mesh, with --crack open or cap", title));
}

// The outputs of one job: their faces are fitted once.
struct JobOutputs {
  std::vector<std::size_t> outputs;  // numbers
  CadWriteJob job;
  CadWritten written;
  [[nodiscard]] const CadFile& file_of(const MapOutput& output) const {
    const auto format = std::find(job.formats.begin(), job.formats.end(), output.format->file->name);
    return written.files[static_cast<std::size_t>(format - job.formats.begin())];
  }
};

// BREP has no unit: of a BREP file that is not in mm it is not of the same numbers as STEP and IGES, which come in mm.
std::vector<JobOutputs> jobs_of(const std::vector<MapOutput>& outputs, const Body& body) {
  const bool apart = std::any_of(
      body.surface.sources.begin(), body.surface.sources.end(),
      [](const SurfaceSource& source) { return source.format == "brep" && source.unit != kMillimetre; });
  std::vector<JobOutputs> jobs(2);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::string format(outputs[i].format->file->name);
    JobOutputs& job = jobs[apart && format == "brep" ? 1 : 0];
    job.outputs.push_back(i);
    if (std::find(job.job.formats.begin(), job.job.formats.end(), format) == job.job.formats.end())
      job.job.formats.push_back(format);
  }
  std::erase_if(jobs, [](const JobOutputs& each) { return each.outputs.empty(); });
  return jobs;
}

}  // namespace

void check_cad_output(const MapArguments& arguments, const CrackOptions& crack, bool any_cad) {
  static_cast<void>(parse_tolerance(arguments.tolerance));
  if (!any_cad) {
    if (!arguments.tolerance.empty())
      throw InputError("--tolerance is for STEP, IGES and BREP: meshes have the vertices of the part itself");
    return;
  }
  if (crack.mode != CrackMode::keep)
    throw InputError("--crack: STEP, IGES and BREP keep the faces of the part: write a mesh (STL, OBJ, ...)");
  if (arguments.attributes)
    throw InputError("--attributes: STEP, IGES and BREP have no vertices: write .vtu or PLY");
}

std::vector<CadAnswer> write_cad(const Body& body, const MapReport& found, const MapArguments& arguments,
                                 const MapOptions& options, const std::vector<MapOutput>& outputs,
                                 Progress& progress) {
  const auto title = [](const MapOutput& output) { return std::string(output.format->file->title); };
  if (outputs.empty()) return {};
  refuse_meshes(body, found, title(outputs.front()));
  const double scale = outputs.front().scale;
  const std::string where = body.surface.sources.empty() ? "the body" : body.surface.sources.front().file;
  std::vector<JobOutputs> jobs = jobs_of(outputs, body);
  std::vector<std::string> wrong;
  for (JobOutputs& each : jobs) {
    each.job.body = body_bytes(body);
    each.job.method = name_of(options.method);
    each.job.scale = scale;
    each.job.tolerance = tolerance_of(arguments.tolerance, body);
    if (scale == 1) each.job.volume = found.quality.volume_after / found.quality.volume_before;
    each.job.threads = thread_count();
    const auto begun = static_cast<double>(&each - jobs.data());
    each.written = run_job(
        each.job, limits_of(body), where, [&](const std::string& line) { progress.warn(line); },
        [&](double share) {
          progress.update((begun + share) / static_cast<double>(jobs.size()), "CAD faces");
        });
    each.job.body = {};
    for (const std::string& line : faults(each.written, found, scale)) wrong.push_back(line);
    for (const std::size_t i : each.outputs)
      if (std::string line = fault_of(each.written, each.file_of(outputs[i]), title(outputs[i]));
          !line.empty())
        wrong.push_back(std::move(line));
  }
  if (arguments.strict && !wrong.empty()) throw InvalidMappingError(wrong.front());
  for (const std::string& line : wrong) progress.warn(line);
  std::vector<CadAnswer> answers(outputs.size());
  for (const JobOutputs& each : jobs)
    for (const std::size_t i : each.outputs) {
      const CadFile& made = each.file_of(outputs[i]);
      OutputFile file(outputs[i].path);
      file.write(made.bytes.data(), made.bytes.size());
      file.commit();
      answers[i] = {line_of(each.written, made, title(outputs[i])), json_of(each.written, made, outputs[i])};
    }
  return answers;
}

}  // namespace flexel::mapping
