// study.html: a template (page.html, taken into the program) whose @NAMES@ are filled in.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/units.h"
#include "flexel/study/page.h"
#include "flexel/study/page_template.h"
#include "flexel/study/study.h"

namespace flexel::study {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '&'   ? "&amp;"
           : c == '<' ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '"' ? "&quot;"
                      : std::string(1, c);
  return out;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

// "1.4 %", "<0.01 %"
std::string percent_html(double share) {
  if (share > 0 && share < 1e-5) return "&lt;0.001 %";
  return share < 0.995 ? fmt::format("{:.2g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

std::string quantity(double value, const std::string& unit) {
  if (unit == "m") return human_length(value);
  if (unit == "N") return human_force(value);
  if (unit == "m3") return human_volume(value);
  return fmt::format("{:.4g} {}", value, unit);
}

// Cells are HTML already.
std::string table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows,
                  const std::set<std::size_t>& bold = {}) {
  std::string out = "<table><thead><tr>";
  for (const std::string& each : head) out += "<th>" + each + "</th>";
  out += "</tr></thead><tbody>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    out += bold.count(r) > 0 ? "<tr class=\"front\">" : "<tr>";
    for (const std::string& each : rows[r]) out += "<td>" + each + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

std::string time_of(const Summed& each) {
  return fmt::format("{}{}", each.wall.relative_error <= 0.05 ? "" : "~", human_seconds(each.point.seconds));
}

std::string error_of_point(const Point& point) {
  if (!point.error) return "";
  return percent_html(point.error->error) + " &plusmn; " + percent_html(point.error->uncertainty);
}

std::string paragraphs(const std::vector<std::string>& lines, const std::string& name) {
  std::string out;
  for (const std::string& line : lines) out += "<p class=\"" + name + "\">" + escaped(line) + "</p>\n";
  return out;
}

std::string references_table(const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const Reference& each : study.references)
    rows.push_back({escaped(each.name), quantity(each.value, each.unit),
                    quantity(each.uncertainty, each.unit),
                    each.order ? fmt::format("{:.1f}", *each.order) : "",
                    escaped(each.from + (each.doubt.empty() ? "" : "; no reference: " + each.doubt)),
                    each.decides ? "yes" : ""});
  return "<div class=\"wide\">" +
         table({"quantity", "reference", "uncertain by", "observed order", "from", "counts"}, rows) +
         "</div>";
}

std::string points_table(const Study& study) {
  std::vector<Point> points;
  for (const Summed& each : study.summed) points.push_back(each.point);
  const std::vector<std::size_t> front = frontier(points);
  const bool timed = study.facts.timed;
  std::vector<std::string> head = {"choice", "cells or elements", "wall", "cpu", "memory", "error"};
  for (const Reference& each : study.references)
    if (each.decides) head.push_back(escaped(each.name));
  head.insert(head.end(), {"surface, rms", "surface, Hausdorff"});
  if (timed)
    head.insert(head.end(), {"energy drift", "lag", "element-steps/s"});
  else
    head.emplace_back("Newton, CG");
  head.emplace_back("runs");
  std::vector<std::vector<std::string>> rows;
  std::set<std::size_t> bold;
  for (std::size_t i = 0; i < study.summed.size(); ++i) {
    const Summed& each = study.summed[i];
    if (!each.point.choosable) continue;
    if (std::count(front.begin(), front.end(), i) > 0) bold.insert(rows.size());
    const Row& row = study.rows[each.row];
    std::vector<std::string> line = {
        escaped(each.point.label),    human_count(row.found.size()),  time_of(each),
        human_seconds(row.found.cpu), human_bytes(each.point.memory), error_of_point(each.point)};
    for (const Reference& reference : study.references)
      if (reference.decides) {
        const Quantity* found = row.found.find(reference.name);
        line.push_back(found != nullptr ? quantity(found->value, found->unit) : "");
      }
    line.push_back(row.surface_rms ? human_length(*row.surface_rms) : "");
    line.push_back(row.surface_hausdorff ? human_length(*row.surface_hausdorff) : "");
    if (timed) {
      line.push_back(row.found.energy_drift ? fmt::format("{:.1e}", *row.found.energy_drift) : "");
      line.push_back(row.lag ? fmt::format("{:.2g} ms", 1e3 * *row.lag) : "");
      line.push_back(fmt::format("{:.3g} M", 1e-6 * row.found.element_steps_per_second()));
    } else {
      line.push_back(fmt::format("{}, {}", row.found.newton_iterations, row.found.cg_iterations));
    }
    line.push_back(std::to_string(each.runs));
    rows.push_back(line);
  }
  return table(head, rows, bold);
}

std::string against_part(const Study& study) {
  const Against& against = study.against;
  if (!against.asked) return "";
  std::string out = "<h2>Beside CalculiX</h2>\n";
  if (!against.refused.empty())
    return out + "<p>There is nothing of CalculiX here: " + escaped(against.refused) + ".</p>\n";
  std::vector<std::vector<std::string>> rows;
  for (const Summed& each : study.summed) {
    if (each.point.sweep != "calculix") continue;
    const Row& row = study.rows[each.row];
    std::vector<std::string> line = {escaped(each.point.label), human_count(row.found.cells),
                                     human_count(row.found.elements), time_of(each)};
    for (const Stage& stage : row.found.stages) line.push_back(human_seconds(stage.wall));
    line.insert(line.end(),
                {human_bytes(each.point.memory), error_of_point(each.point), std::to_string(each.runs)});
    rows.push_back(line);
  }
  out += table({"edges", "tetrahedra", "nodes", "wall", "export and mesh", "ccx", "memory", "error", "runs"},
               rows);
  rows.clear();
  for (const Agreement& each : against.agreements)
    rows.push_back({escaped(each.ours.name), quantity(each.ours.value, each.ours.unit),
                    quantity(each.ours.uncertainty, each.ours.unit), quantity(each.finest, each.ours.unit),
                    quantity(each.theirs.value, each.ours.unit),
                    quantity(each.theirs.uncertainty, each.ours.unit), each.agree ? "yes" : "no"});
  out += "<div class=\"wide\" style=\"margin-top:0.8rem\">" +
         table({"quantity", "reference", "uncertain by", "CalculiX, finest", "CalculiX, extrapolated",
                "uncertain by", "they agree"},
               rows) +
         "</div>\n<p class=\"faint\">" +
         escaped(fmt::format(
             "{}, through flexel export --calculix --mesh tet: second-order tetrahedra (C3D10), {}, {} "
             "threads. Its errors are against the same reference as all others; that is Flexel's own "
             "extrapolation unless it was given. They agree where the two ranges meet.",
             against.versions, against.nlgeom, study.machine.cores)) +
         "</p>\n";
  return out + paragraphs(against.warnings, "faint");
}

// Against the run of the ladder at the same size.
std::string effects_part(const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const Summed& each : study.summed) {
    if (each.point.sweep != "effect") continue;
    const Row& row = study.rows[each.row];
    const auto whole = std::find_if(study.summed.begin(), study.summed.end(), [&](const Summed& s) {
      return s.point.sweep == "resolution" &&
             study.rows[s.row].trial.configuration.size == row.trial.configuration.size;
    });
    if (whole == study.summed.end()) continue;
    const RunResult& full = study.rows[whole->row].found;
    double change = 0;
    for (const Reference& reference : study.references) {
      const Quantity *with = full.find(reference.name), *without = row.found.find(reference.name);
      if (reference.decides && with != nullptr && without != nullptr && with->value != 0)
        change = std::max(change, std::abs(without->value / with->value - 1));
    }
    const double saved = whole->point.seconds - each.point.seconds;
    rows.push_back({escaped(each.point.label), time_of(*whole), time_of(each),
                    fmt::format("{:+.0f} %", -100 * saved / whole->point.seconds), percent_html(change)});
  }
  if (rows.empty()) return "";
  return "<h2>What each effect costs</h2>\n" +
         table({"run", "the whole scene", "this run", "time", "change in the result"}, rows) +
         "<p class=\"faint\">Each effect of the scene is left out in turn, and what comes by itself "
         "(stresses; error bars, "
         "which the other runs of this page leave out) is switched. Wall times; the change is the largest of "
         "the "
         "quantities that count for the error.</p>\n";
}

std::string pictures_part(const Study& study) {
  if (study.pictures.empty()) return "";
  std::string out = "<h2>Where the error is</h2>\n<div class=\"pictures\">";
  for (const Picture& each : study.pictures)
    out += fmt::format(
        "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
        escaped(each.title), base64(each.png));
  return out +
         "</div><p class=\"faint\">Distance of each vertex of the mapped surface from the finest "
         "run's.</p>\n";
}

std::string predictions(const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const Row& row : study.rows) {
    if (!row.found.ok() || row.repeat > 1) continue;
    rows.push_back({escaped(row.trial.label), human_count(row.found.size()),
                    human_seconds(row.predicted.seconds), human_seconds(row.found.wall),
                    fmt::format("{:.2f}", row.predicted.seconds / row.found.wall),
                    human_bytes(row.predicted.bytes), human_bytes(row.found.memory),
                    fmt::format("{:.2f}", row.predicted.bytes / row.found.memory)});
  }
  return table({"run", "cells or elements", "predicted", "took", "ratio", "predicted", "needed", "ratio"},
               rows);
}

std::string left_out(const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const LeftOut& each : study.left_out)
    rows.push_back({escaped(each.trial.label), human_seconds(each.predicted.seconds),
                    human_bytes(each.predicted.bytes), escaped(each.why)});
  for (const Row& row : study.rows)
    if (!row.found.ok())
      rows.push_back({escaped(row.trial.label), human_seconds(row.predicted.seconds),
                      human_bytes(row.predicted.bytes), escaped(row.found.failure)});
  if (rows.empty()) return "";
  return "<h2>What was left out or failed</h2>\n<div class=\"wide\">" +
         table({"run", "predicted", "memory", "why"}, rows) + "</div>\n";
}

std::string plot(const std::map<std::string, std::string>& plots, const std::string& name) {
  const auto found = plots.find(name);
  if (found == plots.end()) return "<p class=\"faint\">The plot is left out: see the note above.</p>";
  return "<figure style=\"margin:0\">" + found->second + "</figure>";
}

}  // namespace

std::string page(const Study& study, const std::map<std::string, std::string>& plots) {
  const Machine& machine = study.machine;
  const std::vector<std::pair<std::string, std::string>> values = {
      {"TITLE",
       escaped(fmt::format("What accuracy costs: {}, {}", fmt::join(study.parts, ", "), study.scene))},
      {"UNDER", escaped(fmt::format("flexel study {}, {}; {} runs in {} of a budget of {}", machine.version,
                                    machine.date, study.rows.size(), human_seconds(study.spent),
                                    human_seconds(study.budget)))},
      {"SENTENCES", paragraphs(study.sentences, "sentence")},
      {"NOTES", paragraphs(study.notes, "faint")},
      {"PLOT_SIZE", plot(plots, "size")},
      {"SIZE_WORDS",
       "What each size found. Its bar is the range in which the limit lies by the sizes up to it "
       "(docs/guide/study.md); "
       "the band is the reference. Hollow: a fifth of the matter or more lies in walls of fewer than two "
       "cells, "
       "and the size has no part in the reference."},
      {"PLOT_ERROR", plots.count("error") == 0 && plots.count("size") > 0
                         ? "<p class=\"faint\">No reference, no errors: see above.</p>"
                         : plot(plots, "error")},
      {"ERROR_WORDS",
       "The error of a run is the largest relative one among the quantities that count (the probes; in timed "
       "runs the most that "
       "they moved; without probes the largest displacement), against the reference below. What lies under "
       "the grey line is not told apart from the reference."},
      {"REFERENCES", references_table(study)},
      {"POINTS", points_table(study)},
      {"AGAINST", against_part(study)},
      {"PLOT_STAGES", plot(plots, "stages")},
      {"EFFECTS", effects_part(study)},
      {"VIEWER", study.viewer.empty() ? ""
                                      : fmt::format("<p><a href=\"{}\">The finest run, to be turned, cut and "
                                                    "probed</a> (a file beside this one)</p>\n",
                                                    kViewer)},
      {"PICTURES", pictures_part(study)},
      {"PREDICTIONS", predictions(study)},
      {"LEFT_OUT", left_out(study)},
      {"HOW", escaped(fmt::format("{}, {} cores, {} of memory, {}; load {:.1f} at the start. Each run is "
                                  "flexel-voxelize, flexel-simulate (without "
                                  "error bars) and flexel-map as processes of their own; times and peak "
                                  "memory are the kernel's (wait4). Every row is "
                                  "in study.csv.",
                                  machine.processor, machine.cores, human_bytes(machine.memory),
                                  machine.system, machine.load_at_start))}};
  std::string out = kPageTemplate;
  for (const auto& [name, value] : values) {
    const std::string mark = "@" + name + "@";
    for (std::size_t at = out.find(mark); at != std::string::npos; at = out.find(mark, at + value.size()))
      out.replace(at, mark.size(), value);
  }
  return out;
}

}  // namespace flexel::study
