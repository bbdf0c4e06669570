// --against calculix in a session: the check before the runs, and the comparison after them.
#include <fmt/format.h>

#include <cmath>

#include "flexel/study/runs/calculix.h"
#include "flexel/study/session.h"

namespace flexel::study {
namespace {

constexpr double kFewestTetrahedra = 300;  // about as many has the coarsest mesh of a bulky part
constexpr std::size_t kEdges = 8;
constexpr double kEdgeRatio = 1.5;

}  // namespace

// Whether CalculiX can run the scene; the study goes on where it cannot.
void Session::look_at_other(Sweep& sweep, double volume) {
  RunOptions options;
  options.folder = folder_->path();
  options.deadline = deadline();
  const CalculixLook look = look_at_calculix(wanted_.study_case, options);
  large_deflection_ = look.large_deflection;
  Against& against = study_.against;
  against.asked = true;
  against.refused = look.refused;
  against.versions = look.versions;
  against.nlgeom =
      fmt::format("{} ({})", look.large_deflection ? "with large rotations" : "without large rotations",
                  look.why_deflection);
  against.warnings = look.warnings;
  if (!look.refused.empty()) {
    study_.notes.push_back("CalculiX is left out: " + look.refused);
    progress_.warn(study_.notes.back());
    return;
  }
  std::vector<double> edges;
  for (double edge = std::cbrt(kTetrahedraInCube * volume / kFewestTetrahedra); edges.size() < kEdges;
       edge /= kEdgeRatio)
    edges.push_back(rounded(edge));
  sweep.set_against(edges, volume);
}

// Where every mesh failed the page says why, once.
void Session::note_against() {
  if (!study_.against.asked || !study_.against.refused.empty()) return;
  const Row* failed = nullptr;
  for (const Row& row : study_.rows) {
    if (row.trial.sweep != "calculix") continue;
    if (row.found.ok()) return;
    if (failed == nullptr) failed = &row;
  }
  std::string why = interrupted_ ? "the study was interrupted before" : "the budget did not reach for it";
  for (const LeftOut& each : study_.left_out)
    if (each.trial.sweep == "calculix") why = each.why;
  study_.against.refused = failed != nullptr ? failed->found.failure : why;
  study_.notes.push_back("There is no run of CalculiX: " + study_.against.refused);
  progress_.warn(study_.notes.back());
}

}  // namespace flexel::study
