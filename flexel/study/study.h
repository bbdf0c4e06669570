// A study: its runs and the conclusions from them.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "flexel/study/accuracy_analysis.h"
#include "flexel/study/runs/machine.h"
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

inline constexpr const char* kViewer = "finest.html";  // beside study.html

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
  std::string viewer;              // HTML of flexel view: the finest run; "": none
  std::vector<std::string> notes;  // for the reader: interrupted, plots left out ...
};

}  // namespace flexel::study
