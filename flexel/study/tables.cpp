// study.csv, study.json and the table of predictions. docs/guide/study.md gives every column.
#include <fmt/format.h>

#include "base/files/csv.h"
#include "base/files/json.h"
#include "base/units.h"
#include "flexel/study/study.h"
#include "flexel/study/tables.h"

namespace flexel::study {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string number(double value) {
  return fmt::format("{:.9g}", value);
}

std::string number(const std::optional<double>& value) {
  return value ? number(*value) : "";
}

struct Field {
  std::string name, value;
};

// One row, with the names of its columns: the header cannot drift from the lines.
std::vector<Field> fields(std::size_t run, const Row& row, const std::vector<Quantity>& quantities) {
  const Configuration& c = row.trial.configuration;
  const RunResult& found = row.found;
  std::vector<Field> out = {{"run", std::to_string(run)},
                            {"sweep", row.trial.sweep},
                            {"label", row.trial.label},
                            {"repeat", std::to_string(row.repeat)},
                            {"size [m]", number(c.size)},
                            {"model", c.model},
                            {"hooke", c.hooke},
                            {"method", c.method},
                            {"integrator", c.integrator},
                            {"step asked [s]", number(c.step)},
                            {"tolerance", number(c.tolerance)},
                            {"threads", std::to_string(c.threads)},
                            {"without", c.without},
                            {"stress", c.stress ? "1" : "0"},
                            {"error bars", c.error_bars ? "1" : "0"},
                            {"status", found.ok() ? "ok" : found.failure},
                            {"wall [s]", number(found.wall)},
                            {"cpu [s]", number(found.cpu)},
                            {"memory [B]", number(found.memory)}};
  for (const char* stage : kStages) {
    double seconds = 0;
    for (const Stage& each : found.stages)
      if (each.name == stage) seconds = each.wall;
    out.push_back({fmt::format("{} stage [s]", stage), number(seconds)});
  }
  const std::vector<Field> rest = {{"cells", std::to_string(found.cells)},
                                   {"elements", std::to_string(found.elements)},
                                   {"spacing [m]", number(found.spacing)},
                                   {"thin matter", number(found.thin_matter)},
                                   {"newton iterations", std::to_string(found.newton_iterations)},
                                   {"cg iterations", std::to_string(found.cg_iterations)},
                                   {"steps", std::to_string(found.steps)},
                                   {"step [s]", number(found.step)},
                                   {"element-steps per second", number(found.element_steps_per_second())},
                                   {"predicted wall [s]", number(row.predicted.seconds)},
                                   {"predicted memory [B]", number(row.predicted.bytes)},
                                   {"energy drift", number(found.energy_drift)},
                                   {"lag [s]", number(row.lag)},
                                   {"surface rms [m]", number(row.surface_rms)},
                                   {"surface hausdorff [m]", number(row.surface_hausdorff)},
                                   {"error", row.error ? number(row.error->error) : ""},
                                   {"error uncertainty", row.error ? number(row.error->uncertainty) : ""}};
  out.insert(out.end(), rest.begin(), rest.end());
  for (const Quantity& quantity : quantities) {
    const Quantity* value = found.find(quantity.name);
    out.push_back({fmt::format("{} [{}]", quantity.name, quantity.unit), value ? number(value->value) : ""});
  }
  return out;
}

OrderedJson json_of(const std::optional<double>& value) {
  return value ? OrderedJson(*value) : nullptr;
}

OrderedJson json_of(const Summed& each) {
  OrderedJson json = {
      {"label", each.point.label},   {"sweep", each.point.sweep}, {"options", each.point.options},
      {"runs", each.runs},           {"wall", each.wall.value},   {"wall_known_to", nullptr},
      {"memory", each.point.memory}, {"error", nullptr},          {"error_uncertainty", nullptr}};
  if (std::isfinite(each.wall.relative_error)) json["wall_known_to"] = each.wall.relative_error;
  if (each.point.error) {
    json["error"] = each.point.error->error;
    json["error_uncertainty"] = each.point.error->uncertainty;
  }
  return json;
}

OrderedJson json_of(const Reference& each) {
  return {{"name", each.name},
          {"unit", each.unit},
          {"value", each.value},
          {"uncertainty", each.uncertainty},
          {"order", json_of(each.order)},
          {"from", each.from},
          {"decides", each.decides},
          {"doubt", each.doubt}};
}

OrderedJson json_of(const Against& against) {
  OrderedJson json = {{"program", "calculix"},        {"versions", against.versions},
                      {"refused", against.refused},   {"nlgeom", against.nlgeom},
                      {"warnings", against.warnings}, {"quantities", OrderedJson::array()}};
  for (const Agreement& each : against.agreements) {
    json["quantities"].push_back(json_of(each.theirs));
    json["quantities"].back()["finest"] = each.finest;
    json["quantities"].back()["decides"] = each.ours.decides;
    json["quantities"].back()["agrees"] = each.agree;
  }
  return json;
}

}  // namespace

std::string csv_header(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Field& field : fields(0, {}, quantities)) names.push_back(csv_field(field.name));
  return fmt::format("{}\n", fmt::join(names, ","));
}

std::string csv_line(std::size_t run, const Row& row, const std::vector<Quantity>& quantities) {
  std::vector<std::string> values;
  for (const Field& field : fields(run, row, quantities)) values.push_back(csv_field(field.value));
  return fmt::format("{}\n", fmt::join(values, ","));
}

std::string study_json(const Study& study) {
  OrderedJson json;
  json["program"] = "flexel study";
  json["version"] = study.machine.version;
  json["parts"] = study.parts;
  json["scene"] = study.scene;
  json["budget"] = study.budget;
  json["spent"] = study.spent;
  json["machine"] = {{"processor", study.machine.processor},
                     {"system", study.machine.system},
                     {"cores", study.machine.cores},
                     {"memory", study.machine.memory},
                     {"load_at_start", study.machine.load_at_start},
                     {"date", study.machine.date}};
  json["sentences"] = study.sentences;
  json["references"] = OrderedJson::array();
  for (const Reference& each : study.references) json["references"].push_back(json_of(each));
  if (study.against.asked) json["against"] = json_of(study.against);
  json["points"] = OrderedJson::array();
  for (const Summed& each : study.summed) json["points"].push_back(json_of(each));
  json["left_out"] = OrderedJson::array();
  for (const LeftOut& each : study.left_out)
    json["left_out"].push_back({{"label", each.trial.label},
                                {"predicted_wall", each.predicted.seconds},
                                {"predicted_memory", each.predicted.bytes},
                                {"why", each.why}});
  json["notes"] = study.notes;
  return json_text(json, 2) + "\n";
}

std::string prediction_table(const Study& study) {
  std::string out = fmt::format("{:<28} {:>9}  {:>9} {:>9} {:>6}  {:>9} {:>9} {:>6}\n", "run", "cells",
                                "told", "took", "ratio", "told", "took", "ratio");
  for (const Row& row : study.rows) {
    if (!row.found.ok() || row.repeat > 1) continue;
    out += fmt::format("{:<28} {:>9}  {:>9} {:>9} {:>6.2f}  {:>9} {:>9} {:>6.2f}\n", row.trial.label,
                       row.found.size(), human_seconds(row.predicted.seconds), human_seconds(row.found.wall),
                       row.predicted.seconds / row.found.wall, human_bytes(row.predicted.bytes),
                       human_bytes(row.found.memory), row.predicted.bytes / row.found.memory);
  }
  return out;
}

}  // namespace flexel::study
