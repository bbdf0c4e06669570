// What CAD files look like, and how flexel-cad is asked to read them. Without OpenCASCADE they are known all the same,
// to be refused by name.
#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "base/parallel.h"
#include "base/resources.h"
#include "formats/cad/cad_surface.h"
#include "formats/common/readers.h"

namespace flexel {
namespace {

Evidence text_if(bool found) {
  return found ? Evidence::text : Evidence::none;
}

bool looks_like_brep(std::string_view text) {
  constexpr std::string_view kBinary = "Open CASCADE Topology V";
  return begins_with_word(text, "dbrep_drawableshape") || begins_with_word(text, "cascade topology v") ||
         text.substr(0, kBinary.size() + 1).find(kBinary) != std::string_view::npos;
}

// The first line is 80 characters long: text, an S in column 73, and the number 1.
bool looks_like_iges(std::string_view text) {
  constexpr std::size_t kLetter = 72, kLine = 80;
  if (text.size() < kLine || text[kLetter] != 'S') return false;
  const std::string_view number = text.substr(kLetter + 1, kLine - kLetter - 1);
  return number.find_first_not_of(" 0") == number.size() - 1 && number.back() == '1' &&
         text.substr(0, kLine).find('\n') == std::string_view::npos;
}

bool is_always_text(const ImportInput&) {
  return true;
}

// Some damaged files send OpenCASCADE into loops without an end, or have it ask for all memory there is. Sound
// ones take it about a second a megabyte, and 250 bytes a triangle, of which a given deflection may ask for any number.
ChildLimits limits_of(const ImportInput& input, const ImportOptions& options) {
  const auto bytes = static_cast<double>(input.bytes.size());
  const double share = .8 * available_memory(), seconds = (options.deflection ? 600 : 60) + 1e-5 * bytes;
  ChildLimits limits;
  limits.processor = options.occt_seconds.value_or(seconds * static_cast<double>(thread_count()));
  limits.wall = 3 * options.occt_seconds.value_or(seconds);  // another program may have the processor
  limits.memory =
      options.occt_memory.value_or(options.deflection ? share : std::min(share, 2e9 + 500 * bytes));
  return limits;
}

// The file travels along: a deformed part is written in its place.
Surface read_cad(ImportInput& input, const ImportOptions& options, SurfaceSource source) {
  const ChildLimits limits = limits_of(input, options);
  CadReadJob job;
  job.format = source.format;
  job.bytes = std::move(input.bytes);
  job.where = input.where;
  job.file = input.file;
  job.unit = source.unit;
  job.deflection = options.deflection;
  job.angular_deflection = options.angular_deflection;
  job.threads = thread_count();
  const char* instead = options.deflection ? "a larger --deflection takes less" : "export it anew, or as STL";
  CadMesh mesh = run_job(job, limits, instead, options.warn);
  source.bytes = std::move(job.bytes);
  return cad_surface(std::move(mesh), std::move(source), options, input.where);
}

Surface read_with_unit(ImportInput& input, const ImportOptions& options, const char* format,
                       const char* title) {
  if (options.unit)
    throw InputError(input.where, fmt::format("{} file carries its own unit: leave out --unit", title));
  return read_cad(input, options, source_in_unit(format, kMillimetre));
}

}  // namespace

constinit const FileReader kStepReader{
    .format = &kStepFormat,
    .sniff =
        [](const ImportInput& input) {
          return begins_with_word(beginning(input), "iso-10303-21") ? Evidence::magic : Evidence::none;
        },
    .read = [](ImportInput& input,
               const ImportOptions& options) { return read_with_unit(input, options, "step", "a STEP"); },
    .is_text = is_always_text};
constinit const FileReader kIgesReader{
    .format = &kIgesFormat,
    .sniff = [](const ImportInput& input) { return text_if(looks_like_iges(beginning(input))); },
    .read = [](ImportInput& input,
               const ImportOptions& options) { return read_with_unit(input, options, "iges", "an IGES"); },
    .is_text = is_always_text};
constinit const FileReader kBrepReader{
    .format = &kBrepFormat,
    .sniff = [](const ImportInput& input) { return text_if(looks_like_brep(beginning(input))); },
    .read =
        [](ImportInput& input, const ImportOptions& options) {
          return read_cad(input, options, unitless_source("brep", options));
        }};

}  // namespace flexel
