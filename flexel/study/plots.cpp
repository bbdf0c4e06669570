// Plots by gnuplot (its svg terminal). The data go into the script as data blocks; colours that gnuplot has
// for text and frames become the page's own, so that the plots are read on light and on dark.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "flexel/study/conclude.h"
#include "flexel/study/plots.h"
#include "flexel/study/study.h"

namespace flexel::study {
namespace {

namespace fs = std::filesystem;

// Okabe and Ito (2008): distinguishable for the colour-blind, on light and on dark.
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

// No Flexel run has this colour.
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

// Where a label may lie beside its point: alignment and offset in characters, as gnuplot has them.
struct Slot {
  const char* alignment;
  double right, up;
};
constexpr Slot kSlots[] = {{"left", 0.6, 0.5},   {"left", 0.6, -0.6}, {"right", -0.6, -0.6},
                           {"right", -0.6, 0.5}, {"left", 0.6, 1.4},  {"left", 0.6, -1.5},
                           {"right", -0.6, -1.5}};

// Labels of `wanted` in the first slot where they cover no other label, the first ones first; what has none
// is left out: the table has it. Data of a plot for each slot.
std::array<std::string, std::size(kSlots)> placed_labels(const std::vector<Point>& points,
                                                         const std::vector<std::size_t>& wanted) {
  // Of the plot, in points of an svg: about what gnuplot leaves beside tics and key. Characters of 10 points.
  constexpr double kWidth = 600, kHeight = 480, kCharacter = 6, kLine = 12;
  double low[2] = {1e300, 1e300}, high[2] = {0, 0};
  const auto place = [](const Point& point) { return std::array{point.seconds, shown_error(point)}; };
  for (const Point& point : points) {
    if (!is_drawn(point)) continue;
    for (int a = 0; a < 2; ++a) {
      low[a] = std::min(low[a], place(point)[a]);
      high[a] = std::max(high[a], place(point)[a]);
    }
  }
  const double across = kWidth / (1.24 * std::max(std::log10(high[0] / low[0]), 0.1));
  const double upward =
      kHeight / std::max(std::ceil(std::log10(high[1])) - std::floor(std::log10(low[1])), 1.0);
  struct Box {
    double left, right, bottom, top;
  };
  std::vector<Box> taken;
  std::array<std::string, std::size(kSlots)> data;
  for (const std::size_t i : wanted) {
    const double x = std::log10(points[i].seconds) * across, y = std::log10(shown_error(points[i])) * upward;
    const double length = kCharacter * static_cast<double>(points[i].label.size());
    for (std::size_t s = 0; s < data.size(); ++s) {
      const double edge = x + kSlots[s].right * kCharacter, middle = y + kSlots[s].up * kLine;
      const double left = edge - (kSlots[s].right < 0 ? length : 0);
      const Box box{left, left + length, middle - kLine / 2, middle + kLine / 2};
      if (std::any_of(taken.begin(), taken.end(), [&](const Box& other) {
            return box.left < other.right && other.left < box.right && box.bottom < other.top &&
                   other.bottom < box.top;
          }))
        continue;
      taken.push_back(box);
      data[s] += label_at(points[i]);
      break;
    }
  }
  return data;
}

// The data and the plot command of one curve.
void add_curve(std::size_t c, const std::string& name, std::vector<const Summed*> sorted, std::string& data,
               std::string& plots) {
  data += fmt::format("$curve{} << EOD\n", c);
  std::sort(sorted.begin(), sorted.end(),
            [](const Summed* a, const Summed* b) { return a->point.seconds < b->point.seconds; });
  for (const Summed* each : sorted)
    data += fmt::format("{:.9g} {:.9g}\n", each->point.seconds, shown_error(each->point));
  data += "EOD\n";
  const bool against = name == "CalculiX";
  const bool joined = against || name == "size" || name.rfind("model", 0) == 0;
  plots += fmt::format(
      "$curve{} with {} lw 1.6 pt {} ps {} lc rgb '{}' title {}, ", c, joined ? "linespoints" : "points",
      against  ? kAgainstMarker
      : c == 0 ? 7
               : static_cast<int>(c) + 4,
      against ? 1.1 : 0.7, against ? kAgainstColour : kColours[c % std::size(kColours)], in_quotes(name));
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
  const std::vector<std::size_t> front = frontier(points);
  for (const std::size_t i : front)
    data += fmt::format("{:.9g} {:.9g}\n", points[i].seconds, shown_error(points[i]));
  data += "EOD\n";
  // The other points are identified by colour: labels on all would overlap.
  std::vector<std::size_t> labelled;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].error && (points[i].sweep == "resolution" || points[i].sweep == "calculix"))
      labelled.push_back(i);
  for (const std::size_t i : front)
    if (std::find(labelled.begin(), labelled.end(), i) == labelled.end()) labelled.push_back(i);
  if (!front.empty()) plots += "$front with linespoints lw 7 lc rgb '#55e0c000' pt 6 ps 2 title 'frontier', ";
  for (std::size_t c = 0; c < curves.size(); ++c)
    add_curve(c, curves[c].first, curves[c].second, data, plots);
  const auto labels = placed_labels(points, labelled);
  for (std::size_t s = 0; s < labels.size(); ++s) {
    if (labels[s].empty()) continue;
    data += fmt::format("$labels{} << EOD\n{}EOD\n", s, labels[s]);
    plots += fmt::format("$labels{} with labels {} offset {},{} font ',10' notitle, ", s, kSlots[s].alignment,
                         kSlots[s].right, kSlots[s].up);
  }
  plots.erase(plots.size() - 2);  // the last comma
  return script + data + "plot " + plots + "\n";
}

// The unit in which human_length() would write `metres`.
std::pair<double, const char*> shown_unit(double metres) {
  const std::pair<double, const char*> units[] = {{1, "m"}, {1e-3, "mm"}, {1e-6, "um"}, {1e-9, "nm"}};
  for (const auto& unit : units)
    if (metres >= unit.first) return unit;
  return units[3];
}

// The quantity that decides, of the sizes; the first where there are several.
std::string size_script(const Study& study, const std::string& out) {
  const auto reference = std::find_if(study.references.begin(), study.references.end(),
                                      [](const Reference& each) { return each.decides && each.unit == "m"; });
  if (reference == study.references.end()) return "";
  const std::vector<SizeValue> values = values_of(sizes_of(study, "resolution"), reference->name);
  if (values.size() < 2) return "";
  double most = 0;
  for (const SizeValue& each : values) most = std::max(most, std::abs(each.value));
  const auto [y_unit, y_name] = shown_unit(most);
  const auto [x_unit, x_name] = shown_unit(values.front().spacing);
  std::string script = head("size", 860, 360);
  script += fmt::format(
      "set output '{}'\nset xlabel 'spacing of the lattice ({})'\nset ylabel {}\nset grid lt 1 lw 0.4 lc rgb "
      "'#888888'\nset key outside right top samplen 2 spacing 1.1\nset xrange [0:{:.9g}]\n",
      out, x_name, in_quotes(fmt::format("{} ({})", reference->name, y_name)),
      1.06 * values.front().spacing / x_unit);
  // Bars of many times the values would hide the values.
  double low = 1e300, high = -1e300;
  for (const SizeValue& each : values) {
    low = std::min(low, each.value / y_unit);
    high = std::max(high, each.value / y_unit);
  }
  if (reference->doubt.empty()) {
    low = std::min(low, (reference->value - reference->uncertainty) / y_unit);
    high = std::max(high, (reference->value + reference->uncertainty) / y_unit);
  }
  const double room = 0.5 * std::max(high - low, 0.02 * high);
  script += fmt::format("set yrange [{:.9g}:{:.9g}]\n", std::max(0.0, low - room), high + room);
  std::string resolved = "$resolved << EOD\n", thin = "$thin << EOD\n", all = "$all << EOD\n", plots;
  bool any_resolved = false, any_thin = false;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double half =
        half_range({values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i) + 1}) / y_unit;
    const std::string line =
        fmt::format("{:.9g} {:.9g} {:.9g}\n", values[i].spacing / x_unit, values[i].value / y_unit, half);
    (values[i].resolved ? resolved : thin) += line;
    (values[i].resolved ? any_resolved : any_thin) = true;
    all += line;
  }
  script += resolved + "EOD\n" + thin + "EOD\n" + all + "EOD\n";
  if (reference->doubt.empty()) {
    script += fmt::format(
        "set object 1 rectangle from graph 0, first {:.9g} to graph 1, first {:.9g} fc rgb '#56a9dd' fs "
        "solid 0.25 "
        "noborder behind\nlimit = {:.9g}\n",
        (reference->value - reference->uncertainty) / y_unit,
        (reference->value + reference->uncertainty) / y_unit, reference->value / y_unit);
    plots += "limit with lines dt 3 lw 1.4 lc rgb '#56a9dd' title 'reference', ";
  }
  plots += "$all with lines lw 1 lc rgb '#0b84c8' notitle";
  if (any_resolved)
    plots += ", $resolved with yerrorbars pt 7 ps 0.7 lw 1.4 lc rgb '#0b84c8' title 'size, with its bar'";
  if (any_thin)
    plots += ", $thin with yerrorbars pt 6 ps 0.7 lw 1 lc rgb '#8a8a8a' title 'coarser than the walls'";
  return script + "plot " + plots + "\n";
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
  if (const std::string script = size_script(study, (folder / "size.svg").string()); !script.empty())
    plots["size"] = draw(gnuplot, "size", script, folder);
  if (!study.summed.empty())
    plots["stages"] = draw(gnuplot, "stages", stages_script(study, (folder / "stages.svg").string()), folder);
  return plots;
}

}  // namespace flexel::study
