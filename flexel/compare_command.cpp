// flexel compare: which of several parts is stiffer under one scene. Every part gets the same number of cells
// (or the same spacing), so that the errors are similar, and its own error bars; where two bars overlap the
// order is not certain.
//
// Stiffness is the resultant of all loads (or of the reactions at the moves) over the largest displacement.
// Its bar is that of the displacement or, where a [[move]] drives the part, of the elastic energy.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <limits>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/printable.h"
#include "base/program/brief_output.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/job.h"
#include "formats/part/topology.h"
#include "simulate/indent/indenters.h"
#include "simulate/input/infill.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/strength.h"
#include "simulate/simulate.h"
#include "simulate/thermal/thermal.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

constexpr double kRounding = 1e-6;
constexpr double kAgainst = 0.1;  // of all forces: forces of which less is left act against each other

struct CompareArguments {
  JobArguments job;
  bool json = false, quiet = false;
  int threads = 0;
};

// What one part came to; SI.
struct Finding {
  std::string file;  // its name, with folders where another has the same
  std::vector<std::string> warnings, notes;
  double size = 0;  // m, of the bounding box's diagonal
  double mass = 0, volume = 0, displacement = 0, force = 0, seconds = 0, spacing = 0;
  std::optional<double> bar;        // of the displacement
  std::optional<double> share;      // of the stiffness: its bar
  std::optional<double> stiffness;  // nothing without a resultant, or where nothing moves
  double least = 0, most = std::numeric_limits<double>::infinity();  // of the stiffness
  std::optional<double> stress;                                      // largest von Mises stress
  // Of the part that is nearest to its limit: limit over stress, and what it yields or breaks at.
  std::optional<double> factor, limit, across;  // across: of a print's layers
  std::string limit_name;                       // "yield" or "strength"
  std::size_t cells = 0;
};

std::optional<simulate::ErrorBar> error_bar_of(const simulate::SimulateResult& result,
                                               simulate::ErrorBar::Of of) {
  for (const simulate::ErrorBar& each : result.error_bars.bars)
    if (each.of == of) return each;
  return std::nullopt;
}

// Of the loads, else what the moves take; 0 where that is no measure of stiffness.
double resultant(const simulate::SimulateResult& result, const simulate::Scene& scene, double size,
                 bool& driven) {
  driven = false;
  if (!scene.get<simulate::Indenters>().indenters.empty()) return 0;  // contact is in proportion to nothing
  const auto& heat = scene.get<simulate::Thermal>();
  if (heat.expands() || heat.conducts()) return 0;  // matter that expands moves without a force
  bool turned = false;
  for (const simulate::Tie& tie : scene.get<simulate::Supports>().ties) {
    driven = driven || tie.is_move;
    turned = turned || (tie.is_move && tie.motion.angle != 0);
  }
  if (turned) return 0;  // a couple over an angle is no force over a displacement
  Vec3 sum = Vec3::Zero();
  double all = 0, moment = 0;  // N, what acts one way or another; N m
  const auto add = [&](const Vec3& force) {
    sum += force;
    all += force.norm();
  };
  if (driven) {
    for (const simulate::Reaction& reaction : result.reactions)
      if (reaction.is_move) add(reaction.force);
  } else {
    for (const simulate::AppliedLoad& load : result.loads) {
      add(load.force);
      moment = std::max(moment, load.moment.norm());
    }
  }
  // What rounding leaves of a couple is no force, nor what is left of forces against each other.
  if (!(sum.norm() * size > kRounding * moment) || sum.norm() < kAgainst * all) return 0;
  return sum.norm();
}

void judge_stiffness(const simulate::SimulateResult& result, const simulate::Scene& scene, Finding& found) {
  bool driven = false;
  found.force = resultant(result, scene, found.size, driven);
  if (const auto bar = error_bar_of(result, simulate::ErrorBar::Of::largest_displacement))
    found.bar = bar->bar.half_width;
  const auto judge = error_bar_of(
      result, driven ? simulate::ErrorBar::Of::elastic_energy : simulate::ErrorBar::Of::largest_displacement);
  if (judge && judge->value != 0) found.share = judge->bar.half_width / std::abs(judge->value);
  if (!(found.force > 0 && found.displacement > 0)) return;
  found.stiffness = found.force / found.displacement;
  if (!found.share) return;
  found.least = *found.stiffness / (1 + *found.share);
  if (*found.share < 1) found.most = *found.stiffness / (1 - *found.share);
}

void judge_stress(const simulate::SimulateResult& result, const simulate::Scene& scene, const Body& body,
                  Finding& found) {
  if (!result.stress) return;
  found.stress = result.stress->value;
  std::vector<std::string> unknown;
  const auto near = nearest_to_strength(body, materials_of_parts(scene, body), unknown);
  if (!near || !(near->share > 0)) return;
  if (near->nearest_share() <= 1 && result.stress->lacks_bending()) return;  // it would be too good
  found.factor = 1 / near->share;
  if (near->layer_share && *near->layer_share > 0) found.across = 1 / *near->layer_share;
  found.limit = near->limit;
  found.limit_name = near->yields ? "yield" : "strength";
}

// A move by nothing is a support.
void hold_what_stays(simulate::Scene& scene) {
  for (simulate::Tie& tie : scene.get<simulate::Supports>().ties)
    if (tie.motion.translation.isZero(0) && tie.motion.angle == 0) tie.is_move = false;
}

// Files without their folders, but for those that would have the name of another.
std::vector<std::string> labels_of(const std::vector<std::string>& files) {
  const auto short_name = [](const std::string& file) {
    return std::filesystem::path(file).filename().string();
  };
  std::vector<std::string> labels;
  for (const std::string& file : files) {
    const bool other = std::any_of(files.begin(), files.end(), [&](const std::string& each) {
      return each != file && short_name(each) == short_name(file);
    });
    labels.push_back(other ? file : short_name(file));
  }
  return labels;
}

// One part's run. A file of one part goes by the name of the first file's, so that one scene fits all.
Finding run_part(const CompareArguments& arguments, const std::string& file, std::string& name,
                 Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  JobArguments own = arguments.job;
  own.parts = {file};
  Job job = plan_job(own);
  Surface surface = read_parts(own.parts, job.import, progress);
  if (surface.parts.size() == 1) {
    if (name.empty()) name = surface.parts[0].name;
    surface.parts[0].name = name;
  }
  check_parts(job, surface);
  voxelize::VoxelizeResult voxels = voxelize::voxelize(std::move(surface), job.voxelize, progress);
  voxelize::report(voxels, progress);
  Body& body = voxels.body;
  add_actions(job, body);
  hold_what_stays(job.scene);
  simulate::SimulateOptions options;
  options.threads = arguments.threads;
  const simulate::SimulateResult result = simulate::simulate(body, job.scene, options, progress);
  Finding found;
  found.mass = result.mass;
  found.size = bounding_box(body.rest).diagonal();
  for (const Part& part : body.parts) found.volume += part.surface_volume;
  found.displacement = result.largest_displacement;
  found.cells = body.cell_count();
  found.spacing = std::cbrt(body.parts.front().lattice.spacing.prod());
  judge_stiffness(result, job.scene, found);
  judge_stress(result, job.scene, body, found);
  const std::vector<simulate::Material> materials = materials_of_parts(job.scene, body);
  for (std::size_t p = 0; p < materials.size(); ++p)
    if (const std::string line = infill_line(body.parts[p].name, materials[p]); !line.empty())
      found.notes.push_back(line);
  found.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return found;
}

// `label`: what the file is called in what is said of it.
Finding run_named(const CompareArguments& arguments, const std::string& file, const std::string& label,
                  std::string& name, Progress& progress) {
  try {
    HeldWarnings held;
    Finding found = run_part(arguments, file, name, progress);
    found.file = label;
    found.warnings = held.take();
    return found;
  } catch (const InputError& error) {
    if (error.where() == file) throw;
    throw InputError(file, (error.where().empty() ? "" : error.where() + ": ") + error.what());
  }
}

std::string mass_text(double kilograms) {
  return kilograms >= 1 ? human_number(kilograms, 4) + " kg" : human_number(1e3 * kilograms, 4) + " g";
}

// "12.3 N/mm"
std::string stiffness_text(double value) {
  const double per_mm = 1e-3 * value;
  return per_mm >= 1000 ? human_number(1e-3 * per_mm) + " kN/mm" : human_number(per_mm) + " N/mm";
}

// "2.9 against yield, 1.5 across layers"; beyond some thousand the figure says no more.
std::string factor_text(const Finding& found) {
  constexpr double kMuch = 1000;
  const auto number = [](double factor) {
    return factor > kMuch ? "over " + human_number(kMuch) : human_number(factor, 2);
  };
  return fmt::format("{} against {}{}", number(*found.factor), found.limit_name,
                     found.across ? fmt::format(", {} across layers", number(*found.across)) : "");
}

std::vector<std::pair<std::string, std::vector<std::string>>> rows_of(const std::vector<Finding>& all) {
  std::vector<std::pair<std::string, std::vector<std::string>>> rows;
  const auto add = [&](const char* title, const auto& text) {
    std::vector<std::string> row;
    for (const Finding& each : all) row.push_back(text(each));
    rows.emplace_back(title, row);
  };
  add("mass", [](const Finding& f) { return mass_text(f.mass); });
  add("volume", [](const Finding& f) { return f.volume > 0 ? human_volume(f.volume) : "open"; });
  add("largest displacement", [](const Finding& f) {
    return f.bar ? length_with_bar(f.displacement, *f.bar) : human_length(f.displacement);
  });
  add("stiffness", [](const Finding& f) {
    if (!f.stiffness) return std::string("-");
    return stiffness_text(*f.stiffness) + (f.share ? " +- " + human_share(*f.share) : "");
  });
  add("stiffness by mass", [](const Finding& f) {
    return f.stiffness ? human_number(1e-6 * *f.stiffness / f.mass) + " N/mm/g" : std::string("-");
  });
  add("largest von Mises stress",
      [](const Finding& f) { return f.stress ? human_pressure(*f.stress) : "-"; });
  add("safety factor", [](const Finding& f) { return f.factor ? factor_text(f) : std::string("-"); });
  add("cells", [](const Finding& f) {
    return fmt::format("{} of {}", human_count(f.cells), human_length(f.spacing));
  });
  add("time", [](const Finding& f) { return fmt::format("{:.1f} s", f.seconds); });
  return rows;
}

std::string table_of(const std::vector<Finding>& all) {
  auto rows = rows_of(all);
  std::vector<std::string> head;
  for (const Finding& each : all) head.push_back(each.file);
  rows.insert(rows.begin(), {"", head});
  std::size_t first = 0;
  std::vector<std::size_t> width(all.size(), 0);
  for (const auto& [title, cells] : rows) {
    first = std::max(first, title.size());
    for (std::size_t c = 0; c < cells.size(); ++c) width[c] = std::max(width[c], cells[c].size());
  }
  std::string text;
  for (const auto& [title, cells] : rows) {
    std::string line = fmt::format("{:<{}}", title, first);
    for (std::size_t c = 0; c < cells.size(); ++c) line += fmt::format("  {:<{}}", cells[c], width[c]);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

// Indices, the stiffest first.
std::vector<std::size_t> order_of(const std::vector<Finding>& all) {
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return all[a].stiffness.value_or(0) > all[b].stiffness.value_or(0);
  });
  return order;
}

bool clearly_stiffer(const Finding& a, const Finding& b) {
  return a.share && b.share && a.least > b.most;
}

std::vector<std::string> verdict(const std::vector<Finding>& all) {
  for (const Finding& each : all)
    if (!each.stiffness)
      return {"no stiffness to compare: the loads of " + each.file +
              " have no resultant or act against each other, heat, shrinkage or an [[indenter]] acts, or "
              "nothing moves; compare displacements and stresses above"};
  const std::vector<std::size_t> order = order_of(all);
  std::vector<std::string> lines;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) {
    const Finding &a = all[order[i]], &b = all[order[i + 1]];
    const double times = *a.stiffness / *b.stiffness;
    const std::string mass = human_number(a.mass / b.mass, 2) + " times the mass";
    if (clearly_stiffer(a, b))
      lines.push_back(
          fmt::format("{} is {} times as stiff as {}, with {}", a.file, human_number(times), b.file, mass));
    else
      lines.push_back(fmt::format(
          "not sure which of {} and {} is stiffer: {}; a smaller --size or a larger --count "
          "makes the bars narrower",
          a.file, b.file, a.share && b.share ? "their error bars overlap" : "there are no error bars"));
  }
  return lines;
}

using Json = nlohmann::ordered_json;

Json json_number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json();
}

std::string comparison_json(const std::vector<Finding>& all) {
  Json parts = Json::array(), order = Json::array();
  for (const Finding& f : all)
    parts.push_back(
        {{"file", f.file},
         {"mass", f.mass},
         {"volume", f.volume},
         {"largest_displacement", f.displacement},
         {"largest_displacement_bar", json_number(f.bar)},
         {"force", f.force},
         {"stiffness", json_number(f.stiffness)},
         {"stiffness_bar", {f.share ? json_number(f.least) : Json(), f.share ? json_number(f.most) : Json()}},
         {"von_mises", json_number(f.stress)},
         {"safety_factor", json_number(f.factor)},
         {"safety_factor_across_layers", json_number(f.across)},
         {"limit", json_number(f.limit)},
         {"limit_is", f.limit_name},
         {"cells", f.cells},
         {"spacing", f.spacing},
         {"seconds", f.seconds},
         {"warnings", f.warnings}});
  const std::vector<std::size_t> stiffest = order_of(all);
  bool sure = true;
  for (std::size_t i = 0; i < stiffest.size(); ++i) {
    order.push_back(all[stiffest[i]].file);
    if (i > 0) sure = sure && clearly_stiffer(all[stiffest[i - 1]], all[stiffest[i]]);
  }
  return json_text({{"parts", parts}, {"stiffest_first", order}, {"sure", sure}}, 2) + "\n";
}

}  // namespace

int compare_command(int argc, char** argv) {
  CompareArguments arguments;
  CommandLine app{"Which of several parts is stiffer under one scene: mass, displacement, stiffness, stress.",
                  "flexel compare"};
  declare_job(app, arguments.job);
  app.add_flag("--json", arguments.json, "As JSON, in SI units (docs/guide/compare.md)");
  add_threads_option(app, arguments.threads);
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  if (arguments.job.parts.size() < 2) throw InputError("two parts at least are compared: name another file");
  if (std::count(arguments.job.parts.begin(), arguments.job.parts.end(), "-") > 0 ||
      arguments.job.scene == "-")
    throw InputError("flexel compare reads its scene once for each part: give files, not stdin");
  const StopEndsProcess nothing_is_left;
  plan_after_files(arguments.job, [&] {
    if (plan_job(arguments.job).scene.run.time)
      throw InputError(arguments.job.scene,
                       "flexel compare is for runs to equilibrium, and this scene is a timed run");
  });
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  Progress inner("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  std::vector<Finding> all;
  std::string name;
  const std::vector<std::string>& files = arguments.job.parts;
  const std::vector<std::string> labels = labels_of(files);
  for (std::size_t n = 0; n < files.size(); ++n) {
    progress.stage(labels[n]);
    {
      const BriefOutput bars_only(true);
      all.push_back(run_named(arguments, files[n], labels[n], name, inner));
      inner.finish();
    }
    for (const std::string& line : all.back().warnings) progress.warn(labels[n] + ": " + line);
    for (const std::string& line : all.back().notes) progress.say(labels[n] + ": " + line);
  }
  progress.finish();
  std::string text = arguments.json ? comparison_json(all) : printable_lines(table_of(all));
  if (!arguments.json)
    for (const std::string& line : verdict(all)) text += printable(line) + "\n";
  OutputFile out("-", false);
  out.write(text);
  out.commit();
  return kExitDone;
}

}  // namespace flexel::commands
