// Command-line options of a mapping, shared by flexel-map and `flexel deform`.
#pragma once
#include "base/error.h"
#include "base/program/arguments.h"
#include "mapping/map_refined.h"

namespace flexel::mapping {

struct MapArguments {
  std::string method;  // "": blended
  std::string checks, crack = "keep", debris = "keep", pieces, report, format, tolerance;
  double scale = 1;
  std::string refine = "auto";
  bool keep_vertices = false;
  bool attributes = false, table = false, ascii = false, strict = false;
};

// Adds their options to the program; --format too, as it also names that of the pieces.
void declare_map_options(CommandLine& app, MapArguments& arguments);

// A body that model `quadratic` deformed is mapped by its own field unless --method is given.
void use_field(const Body& body, const MapArguments& arguments, MapOptions& options);

// What they ask for. Throws InputError: an unknown word, options that exclude each other.
[[nodiscard]] MapOptions map_options(const MapArguments& arguments);
[[nodiscard]] CrackOptions crack_options(const MapArguments& arguments);
// `app`: says whether --refine was given;
[[nodiscard]] RefineOptions refine_options(const MapArguments& arguments, const CommandLine& app,
                                           const CrackOptions& crack);

// Says the report's lines, the first as a warning where the mapping cannot be used, but for one that write_report()
// will throw; and its table.
void say_report(const MapReport& found, const MapArguments& arguments, const MapOptions& options,
                Progress& progress);
// Writes the report to `path` where there is one. Throws InvalidMappingError after that: the mapping cannot
// be used, and --strict or a vertex without a finite position forbids to write it.
void write_report(const MapReport& found, const MapArguments& arguments, const MapOptions& options,
                  const std::string& path);

}  // namespace flexel::mapping
