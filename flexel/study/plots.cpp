// Plots by gnuplot (its svg terminal). The data go into the script as data blocks; colours that gnuplot has
// for text and frames become the page's own, so that the plots are read on light and on dark.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include "flexel/study/study.h"
#include "formats/error.h"
#include "formats/files.h"

namespace flexel::study {
namespace {

namespace fs = std::filesystem;

// Okabe and Ito (2008), told apart by the colour-blind, on light and on dark.
constexpr const char* kColours[] = {"#0b84c8", "#e08a00", "#009e73", "#d55e00",
                                    "#b8659a", "#56a9dd", "#8a8a8a", "#a0922c"};

std::string in_quotes(std::string text) {
  for (char& c : text)
    if (c == '"' || c == '\\' || c == '\n') c = '\'';
  return "\"" + text + "\"";
}

std::string head(const std::string& name, int width, int height) {
  return fmt::format(
      "set encoding utf8\n"
      "set terminal svg size {},{} dynamic name '{}' font 'sans-serif,13' noenhanced\n"
      "set border lw 0.8\nset tics nomirror scale 0.6\n",
      width, height, name);
}

// Nobody of ours has it.
constexpr const char* kAgainstColour = "#8a5cd0";
constexpr int kAgainstMarker = 13;  // a filled diamond

// What has a place in the plot of errors.
bool is_drawn(const Point& point) {
  return point.error && (point.choosable || point.sweep == "calculix");
}

// The curve that a point belongs to: models one by one, all else by its sweep.
std::string curve_of(const Summed& each) {
  if (each.point.sweep == "resolution") return "size";
  if (each.point.sweep == "calculix") return "CalculiX";
  if (each.point.sweep != "model") return each.point.sweep;
  const std::string& label = each.point.label;  // "springs 3 mm"
  return "model " + label.substr(0, label.find(' '));
}

// What lies far below its uncertainty, above all the run that is the reference itself, is drawn at a tenth of
// it: a logarithmic axis has no place for none.
double shown_error(const Point& point) {
  return 100 * std::max({point.error->error, 0.1 * point.error->uncertainty, 1e-9});
}

std::string label_at(const Point& point) {
  return fmt::format("{:.9g} {:.9g} {}\n", point.seconds, shown_error(point), in_quotes(point.label));
}

std::string error_script(const Study& study, const std::string& out) {
  std::vector<std::pair<std::string, std::vector<const Summed*>>> curves;
  std::vector<Point> points;
  double floor = 0;
  for (const Summed& each : study.summed) {
    points.push_back(each.point);
    if (!is_drawn(each.point)) continue;
    floor = std::max(floor, 100 * each.point.error->uncertainty);
    const std::string name = curve_of(each);
    auto found = std::find_if(curves.begin(), curves.end(), [&](const auto& c) { return c.first == name; });
    if (found == curves.end()) found = curves.insert(curves.end(), {name, {}});
    found->second.push_back(&each);
  }
  std::string script = head("error", 860, 520);
  script += "set output '" + out +
            "'\nset logscale xy\nset format y '%g %%'\nset format x '%g s'\n"
            "set xlabel 'time of a run (median)'\nset ylabel 'error'\nset grid lt 1 lw 0.4 lc rgb '#888888'\n"
            "set key outside right top samplen 2 spacing 1.1\nset offsets graph 0.12, graph 0.12, 0, 0\n";
  std::string data, plots;
  if (floor > 0) {
    data += fmt::format("unsure = {:.9g}\n", floor);
    plots += "unsure with lines dt 3 lw 1.2 lc rgb '#888888' title 'uncertainty', ";
  }
  data += "$front << EOD\n";
  std::string labels = "$labels << EOD\n";
  const std::vector<std::size_t> front = frontier(points);
  for (const std::size_t i : front)
    data += fmt::format("{:.9g} {:.9g}\n", points[i].seconds, shown_error(points[i]));
  // The others are told by their colour: where all are written none can be read.
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].error && (points[i].sweep == "resolution" || points[i].sweep == "calculix" ||
                            std::find(front.begin(), front.end(), i) != front.end()))
      labels += label_at(points[i]);
  data += "EOD\n" + labels + "EOD\n";
  if (!front.empty()) plots += "$front with linespoints lw 7 lc rgb '#55e0c000' pt 6 ps 2 title 'frontier', ";
  for (std::size_t c = 0; c < curves.size(); ++c) {
    data += fmt::format("$curve{} << EOD\n", c);
    std::vector<const Summed*> sorted = curves[c].second;
    std::sort(sorted.begin(), sorted.end(),
              [](const Summed* a, const Summed* b) { return a->point.seconds < b->point.seconds; });
    for (const Summed* each : sorted)
      data += fmt::format("{:.9g} {:.9g}\n", each->point.seconds, shown_error(each->point));
    data += "EOD\n";
    const bool against = curves[c].first == "CalculiX";
    const bool joined = against || curves[c].first == "size" || curves[c].first.rfind("model", 0) == 0;
    plots += fmt::format("$curve{} with {} lw 1.6 pt {} ps {} lc rgb '{}' title {}, ", c,
                         joined ? "linespoints" : "points",
                         against  ? kAgainstMarker
                         : c == 0 ? 7
                                  : static_cast<int>(c) + 4,
                         against ? 1.1 : 0.7, against ? kAgainstColour : kColours[c % std::size(kColours)],
                         in_quotes(curves[c].first));
  }
  plots += "$labels with labels left offset 0.6,0.5 font ',10' notitle";
  return script + data + "plot " + plots + "\n";
}

std::string stages_script(const Study& study, const std::string& out) {
  std::vector<const Summed*> bars;
  for (const Summed& each : study.summed)
    if (each.point.sweep == "resolution" || each.point.sweep == "model") bars.push_back(&each);
  std::stable_sort(bars.begin(), bars.end(),
                   [](const Summed* a, const Summed* b) { return a->point.seconds < b->point.seconds; });
  std::string script = head("stages", 860, 380);
  script += "set output '" + out +
            "'\nset style data histograms\nset style histogram rowstacked\n"
            "set style fill solid 0.9 noborder\nset boxwidth 0.8\nset yrange [0:100]\nset format y '%g %%'\n"
            "set ylabel 'share of the time'\nset xtics rotate by -40 left font ',10'\nset grid y lw 0.4 lc "
            "rgb '#888888'\n"
            "set key outside right top invert samplen 1.5 spacing 1.1\n$bars << EOD\n";
  for (const Summed* bar : bars) {
    const Row& row = study.rows[bar->row];
    script += in_quotes(bar->point.label + ": " + human_seconds(row.found.wall));
    for (const Stage& stage : row.found.stages)
      script += fmt::format(" {:.4f}", 100 * stage.wall / row.found.wall);
    script += "\n";
  }
  script += "EOD\nplot ";
  for (std::size_t s = 0; s < std::size(kStages); ++s)
    script += fmt::format("$bars using {}{} lc rgb '{}' title '{}'{}", s + 2, s == 0 ? ":xtic(1)" : "",
                          s == 8 ? "#6a51a3" : kColours[s % std::size(kColours)], kStages[s],
                          s + 1 < std::size(kStages) ? ", " : "\n");
  return script;
}

// Text and frames in the page's colour, no prolog, no fixed size, and ids that are the plot's own.
std::string for_page(std::string svg, const std::string& name) {
  svg = svg.substr(svg.find("<svg"));
  svg = std::regex_replace(svg, std::regex("(fill|stroke|color)=(\"|')(black|rgb\\( *0, *0, *0\\))(\"|')"),
                           "$1=\"currentColor\"");
  svg = std::regex_replace(svg, std::regex("(fill|stroke) *: *black"), "$1:currentColor");
  svg = std::regex_replace(svg, std::regex("id=(\"|')([^\"']*)(\"|')"), "id=\"" + name + "-$2\"");
  svg = std::regex_replace(svg, std::regex("href=(\"|')#([^\"']*)(\"|')"), "href=\"#" + name + "-$2\"");
  return svg;
}

// "" where it cannot be read. Unlike read_all() it does not heed an interrupt, after which the page is still
// to be made.
std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string draw(const std::string& gnuplot, const std::string& name, const std::string& script,
                 const fs::path& folder) {
  const fs::path script_file = folder / (name + ".gp"), svg = folder / (name + ".svg");
  write_text(script, script_file.string());
  ChildOptions options;
  options.log = folder / "gnuplot.log";
  options.heed_interrupts = false;
  const ChildRun run = run_child({gnuplot, script_file.string()}, options);
  const std::string drawn = run.exit_code == 0 ? text_of(svg) : "";
  if (drawn.find("</svg>") == std::string::npos)
    throw InputError("gnuplot failed: " + text_of(folder / "gnuplot.log").substr(0, 400));
  return for_page(drawn, name);
}

}  // namespace

std::map<std::string, std::string> draw_plots(const Study& study, const fs::path& folder) {
  const std::string gnuplot = find_program("gnuplot");
  if (gnuplot.empty()) throw InputError("gnuplot is not installed: apt-get install gnuplot-nox");
  std::map<std::string, std::string> plots;
  const bool errors = std::any_of(study.summed.begin(), study.summed.end(),
                                  [](const Summed& s) { return is_drawn(s.point); });
  if (errors)
    plots["error"] = draw(gnuplot, "error", error_script(study, (folder / "error.svg").string()), folder);
  if (!study.summed.empty())
    plots["stages"] = draw(gnuplot, "stages", stages_script(study, (folder / "stages.svg").string()), folder);
  return plots;
}

}  // namespace flexel::study
