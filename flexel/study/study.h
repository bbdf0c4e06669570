// A study: its runs and the conclusions from them.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "flexel/study/accuracy_analysis.h"
#include "flexel/study/sweep.h"

namespace flexel::study {

// One run, which is one row of study.csv.
struct Row {
  Trial trial;
  int repeat = 1;
  Prediction predicted;
  RunResult found;
  // Filled at the end:
  std::optional<double> lag;                // s, of the first probe behind the reference; timed runs
  std::optional<double> surface_rms;        // m, of corresponding points, from the finest surface
  std::optional<double> surface_hausdorff;  // m, from the finest surface
  std::optional<RunError> error;
};

struct Machine {
  std::string processor, system, version;  // of Flexel
  int cores = 1;
  double memory = 0;         // bytes
  double load_at_start = 0;  // runnable processes, mean of a minute
  std::string date;          // UTC, ISO 8601
};
[[nodiscard]] Machine this_machine();

// All rows of one configuration.
struct Summed {
  Point point;
  std::size_t row = 0;  // the first of its rows that went well
  int runs = 0;
  Median wall;
};

struct Picture {
  std::string title;
  std::string png;  // its bytes
};

// CalculiX on the same part and scene (--against calculix).
struct Against {
  bool asked = false;
  std::string refused;           // why there is nothing of it; "": there is
  std::string versions, nlgeom;  // "CalculiX 2.20, gmsh 4.8.4"; how large rotations were treated, and why
  std::vector<std::string> warnings;  // what is not exactly as in the scene
  std::vector<Agreement> agreements;  // of the quantities that both have
};

struct Study {
  std::vector<std::string> parts;  // as they were given
  std::string scene;
  double budget = 0, spent = 0;  // s
  SceneFacts facts;
  Machine machine;
  std::vector<Row> rows;  // in the order of the runs
  std::vector<LeftOut> left_out;
  std::vector<Reference> references;
  std::vector<Summed> summed;
  std::vector<std::string> sentences;
  Against against;
  std::vector<Picture> pictures;
  std::vector<std::string> notes;  // for the reader: interrupted, plots left out ...
};

// The first row of each size of a sweep that went well, the coarsest first.
[[nodiscard]] std::vector<const Row*> sizes_of(const Study& study, const std::string& sweep);
// Their values, of the rows that have the quantity.
[[nodiscard]] std::vector<SizeValue> values_of(const std::vector<const Row*>& rows,
                                               const std::string& quantity);

// References from the rows (`given` go first), errors of the rows, the summed points and the sentences.
void conclude(Study& study, const std::vector<Reference>& given);

// study.csv (docs/guide/study.md gives its columns): one line of names, one line a row. `quantities` are the names
// of the last columns.
[[nodiscard]] std::string csv_header(const std::vector<Quantity>& quantities);
[[nodiscard]] std::string csv_line(std::size_t number, const Row& row,
                                   const std::vector<Quantity>& quantities);
// All of it, as JSON in SI units.
[[nodiscard]] std::string study_json(const Study& study);
// The prediction for each run beside its cost: a table for a terminal.
[[nodiscard]] std::string prediction_table(const Study& study);

// Distances of the mapped surface `path` from `finest` (both .ply of the same part): the root mean square,
// over the area, of the distance between the same material points, and the Hausdorff distance
// (study/hausdorff.h), computed until `deadline`. Throws InputError where the surfaces do not correspond.
struct SurfaceDistance {
  double rms = 0, hausdorff = 0;  // m
};
[[nodiscard]] SurfaceDistance surface_distance(const std::string& path, const std::string& finest,
                                               Deadline deadline);
// Writes `path` to `out` (.ply) with the distance of each vertex from `finest` as the attribute
// kErrorAttribute, in percent of `whole` [m].
inline constexpr const char* kErrorAttribute = "error_in_percent";
void write_error_surface(const std::string& path, const std::string& finest, double whole,
                         const std::string& out);

// study.html: the page. `plots` are SVG texts by name ("size", "error", "stages"); those that are missing
// are said to be.
[[nodiscard]] std::string page(const Study& study, const std::map<std::string, std::string>& plots);

// Draws the plots with gnuplot in `folder`. Throws InputError: gnuplot is missing or failed.
[[nodiscard]] std::map<std::string, std::string> draw_plots(const Study& study,
                                                            const std::filesystem::path& folder);

}  // namespace flexel::study
