// The report of the resolution search, as text and JSON.
#include <fmt/format.h>

#include "base/files/json.h"
#include "base/human.h"
#include "base/units.h"
#include "flexel/accuracy/accuracy_report.h"

namespace flexel::commands {
namespace {

nlohmann::ordered_json json_of(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nullptr;
}

}  // namespace

bool AccuracyReport::met() const {
  const std::optional<double> reached = runs.empty() ? std::nullopt : runs.back().error;
  return (!goal.error || (reached && *reached <= *goal.error)) && (!goal.within || seconds <= *goal.within);
}

std::string AccuracyReport::sentence() const {
  const TriedRun& last = runs.back();
  std::string asked = goal.error ? fmt::format("--accuracy {:.6g}%", 100 * *goal.error) : "";
  if (goal.within) asked += fmt::format("{}--within {:.6g}s", asked.empty() ? "" : ", ", *goal.within);
  std::string text = fmt::format("{}: chose --size {} ({} cells) and --method {}; {} with {} before it",
                                 asked, size_text(last.size), human_count(last.cells), method,
                                 human_seconds(seconds), counted(runs.size() - 1, "run"));
  text += last.error ? fmt::format("; the error reached is about {} ({})", human_share(*last.error), last.of)
                     : "; its error is not known: no coarser run to compare with";
  if (!met())
    text +=
        goal.error && !(last.error && *last.error <= *goal.error)
            ? fmt::format(", NOT the {:.6g} % {}{}", 100 * *goal.error,
                          goal.by_default ? "aimed at" : "asked for", stopped.empty() ? "" : ": " + stopped)
            : ", and it took longer than predicted";
  return text;
}

std::string AccuracyReport::json() const {
  nlohmann::ordered_json json;
  json["by_default"] = goal.by_default;
  json["asked"] = json_of(goal.error);
  json["within"] = json_of(goal.within);
  json["size"] = runs.back().size;
  json["method"] = method;
  json["reached"] = json_of(runs.back().error);
  json["of"] = runs.back().of;
  json["met"] = met();
  json["seconds"] = seconds;
  json["stopped"] = stopped;
  json["advice"] = advice;
  json["runs"] = nlohmann::ordered_json::array();
  for (const TriedRun& each : runs)
    json["runs"].push_back({{"size", each.size},
                            {"cells", each.cells},
                            {"seconds", each.seconds},
                            {"memory", each.memory},
                            {"predicted_seconds", json_of(each.predicted_seconds)},
                            {"predicted_memory", json_of(each.predicted_memory)},
                            {"error", json_of(each.error)},
                            {"quantities", each.found},
                            {"failure", each.failure}});
  json["sentence"] = sentence();
  return json_text(json);
}

std::string size_text(double metres) {
  return fmt::format("{:.6g}mm", 1e3 * metres);
}

}  // namespace flexel::commands
