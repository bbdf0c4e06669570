// flexel deform: every stage in one process, on one body in memory. All that can be wrong with the arguments
// is found before the first stage runs, and nothing is written before the last has ended.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <new>

#include "base/files/files.h"
#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/human.h"
#include "base/parallel.h"
#include "base/program/brief_output.h"
#include "base/program/progress_stretch.h"
#include "base/program/termination.h"
#include "base/resources.h"
#include "base/stop.h"
#include "base/units.h"
#include "flexel/accuracy/resolution_search.h"
#include "flexel/accuracy/run_error.h"
#include "flexel/commands.h"
#include "flexel/deform.h"
#include "flexel/job.h"
#include "flexel/picture/bent_picture.h"
#include "flexel/view/result_page.h"
#include "formats/common/file_format.h"
#include "formats/exchange/surface_file.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/quadratic_field.h"
#include "mapping/cad_output.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "mapping/report/report.h"
#include "simulate/answer.h"
#include "simulate/indent/indenters.h"
#include "simulate/input/infill.h"
#include "simulate/matter/voxel_pieces.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/result/options.h"
#include "simulate/result/overload.h"
#include "simulate/scene/strength.h"
#include "simulate/simulate.h"
#include "simulate/summary.h"
#include "simulate/time/dynamic_relaxation.h"
#include "voxelize/memory.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"
#include "voxelize/voxelize_box.h"

namespace flexel::commands {
namespace {

// Of the first run when a size is chosen: enough for most error bars, or for one that takes a tenth of a
// second.
constexpr std::size_t kFirstCells = 20000, kFewCells = 2000;
constexpr std::size_t kFirstQuadraticCells = 1000, kFewQuadraticCells = 300;
constexpr double kThinWalls = 3;                          // cells: model `quadratic` is for thinner ones
constexpr double kShort = 5;                              // s
constexpr double kUsualError = 0.05, kUsualSeconds = 20;  // aimed at where nothing is asked for

struct DeformArguments {
  JobArguments job;
  std::vector<std::string> outputs;
  std::string html, summary, body, accuracy, within;
  mapping::MapArguments map;
  int threads = 0;
  bool quiet = false, verbose = false, estimate = true, json = false;
  bool closer = false;  // a closer look at the largest stress
  bool needs_output = true;
  const Surface* part = nullptr;  // in place of the files
};

void declare_input(CommandLine& app, JobArguments& arguments) {
  declare_job(app, arguments);
  app.add_option("--placement", arguments.placement,
                 "Elements at the voxels' corner or centre (model \"paper\")")
      .type_name("WHERE")
      .show_default();
}

void declare_output(CommandLine& app, DeformArguments& arguments) {
  app.add_option("-o,--output", arguments.outputs,
                 "The deformed part (.stl, .obj ...), body (.vtu), a picture (.png) or a page (.html) of it; "
                 "again for "
                 "more; -: stdout")
      .type_name("FILE")
      .one_value_each();
  app.add_option("--html", arguments.html,
                 "A page to look at the result in the browser, in one file (docs/guide/view.md)")
      .type_name("FILE");
  app.add_option("--body", arguments.body, "Write the deformed body (.vtu) too").type_name("FILE");
  declare_map_options(app, arguments.map);
  app.add_option("--summary", arguments.summary,
                 "Write the summary of all stages (JSON; docs/guide/deform.md)")
      .type_name("FILE");
  app.add_flag("--json", arguments.json, "Print the summary as JSON to stdout (docs/reference/json.md)");
  add_threads_option(app, arguments.threads);
  app.add_option("--accuracy", arguments.accuracy,
                 "Choose size and mapping from cheap runs so that the error is at most this (\"2%\")")
      .type_name("SHARE");
  app.add_option("--within", arguments.within,
                 "Choose the finest size whose run ends within this time, all in all (\"10s\")")
      .type_name("TIME");
  app.add_flag("!--no-estimate", arguments.estimate, "Leave out the error bars (docs/theory/error-bars.md)");
  app.add_flag("--refine-stress", arguments.closer,
               "Look at the largest stress again, on finer cells around it (docs/theory/local-stress.md)");
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  app.add_flag("--verbose", arguments.verbose, "Say all that each stage found");
}

// What the arguments ask for, checked.
struct Plan {
  Job job;
  std::optional<AccuracyGoal> goal;  // of --accuracy and --within
  mapping::MapOptions map;
  mapping::CrackOptions crack;
  mapping::RefineOptions refine;
  struct Output {
    std::string path;
    std::optional<mapping::MapOutput> surface;  // nothing: the body, its picture or page
    [[nodiscard]] bool is_picture() const { return extension(path) == "png"; }
    [[nodiscard]] bool is_page() const { return extension(path) == "html" || extension(path) == "htm"; }
  };
  std::vector<Output> outputs;
};

// Where the last good state goes when the simulation diverges: beside the first file that is written.
std::string failed_name(const Plan& plan) {
  for (const Plan::Output& output : plan.outputs) {
    if (output.path == "-") continue;
    const std::string ending = "." + extension(output.path);
    return output.path.substr(0, output.path.size() - ending.size()) + ".failed.vtu";
  }
  return "";
}

void plan_outputs(const DeformArguments& arguments, Plan& plan) {
  if (arguments.json && std::count(arguments.outputs.begin(), arguments.outputs.end(), "-") > 0)
    throw InputError("--json and -o - both write to stdout: name a file with -o");
  if (arguments.outputs.empty() && arguments.needs_output && !arguments.json)
    throw InputError("-o (or --html) is missing: where the result goes");
  for (const std::string& path : arguments.outputs)
    if (const std::string ending = extension(path);
        ending == "vtu" || ending == "png" || ending == "html" || ending == "htm")
      plan.outputs.push_back({path, std::nullopt});
    else
      plan.outputs.push_back(
          {path, mapping::map_output(path == "-" ? arguments.map.format : "", path, arguments.map.ascii, 0,
                                     arguments.map.scale, arguments.map.attributes)});
  check_cad_output(arguments.map, plan.crack,
                   std::any_of(plan.outputs.begin(), plan.outputs.end(), [](const Plan::Output& output) {
                     return output.surface && is_cad(*output.surface);
                   }));
  if (!arguments.body.empty()) plan.outputs.push_back({arguments.body, std::nullopt});
  std::vector<OutputName> names;
  for (const Plan::Output& output : plan.outputs) names.push_back({output.path});
  for (const std::string& path : {arguments.map.report, arguments.summary, failed_name(plan)})
    names.push_back({path});
  if (arguments.json) names.push_back({"-"});
  std::vector<std::string> inputs = arguments.job.parts;
  inputs.push_back(arguments.job.scene);
  check_outputs(names, inputs, arguments.job.force);
}

// What only a written surface has.
void refuse_unused(const DeformArguments& arguments, const Plan& plan) {
  const bool pieces = !plan.crack.pieces.empty();
  const auto any = [&](const auto& is) { return std::any_of(plan.outputs.begin(), plan.outputs.end(), is); };
  if (!arguments.map.format.empty() && !pieces &&
      !any([](const Plan::Output& output) { return output.path == "-"; }))
    throw InputError(
        fmt::format("--format {}: is for -o - and --pieces; a file's format is told by its extension, such "
                    "as -o bent.{}",
                    arguments.map.format, arguments.map.format));
  if (arguments.map.scale != 1 && arguments.needs_output && !pieces &&
      !any([](const Plan::Output& output) { return output.surface.has_value(); }))
    throw InputError(
        "--scale is for surfaces: write one with -o, such as bent.stl; bodies keep their true shape, and "
        "flexel "
        "picture and flexel view draw them with a --scale of their own");
}

// Nothing is asked for: a size is chosen where error bars can judge it.
void plan_usual_goal(const DeformArguments& arguments, const CommandLine& app, Plan& plan) {
  const simulate::Scene& scene = plan.job.scene;
  if (plan.job.voxelize.size || plan.job.voxelize.count || !arguments.estimate ||
      plan.job.voxelize.placement != Placement::corner || scene.run.time || settles(scene) ||
      app.has("--timeout"))
    return;
  plan.goal.emplace();
  plan.goal->by_default = true;
  plan.goal->began = std::chrono::steady_clock::now();
  plan.goal->error = kUsualError;
  plan.goal->within = kUsualSeconds;
}

void plan_goal(const DeformArguments& arguments, const CommandLine& app, Plan& plan) {
  if (arguments.accuracy.empty() && arguments.within.empty()) return plan_usual_goal(arguments, app, plan);
  const std::string option = arguments.accuracy.empty() ? "--within" : "--accuracy";
  if (plan.job.voxelize.size || plan.job.voxelize.count)
    throw InputError(option + " chooses the size: leave --size and --count out");
  if (plan.job.voxelize.placement != Placement::corner)
    throw InputError(option + " needs error bars, which --placement centre does not have");
  if (plan.job.scene.run.time)
    throw InputError(plan.job.scene.name,
                     option + " is for runs to equilibrium, and this scene is a timed run");
  if (!arguments.estimate) throw InputError(option + " needs the error bars: leave --no-estimate out");
  plan.goal.emplace();
  plan.goal->began = std::chrono::steady_clock::now();
  if (!arguments.accuracy.empty()) {
    plan.goal->error = parse_quantity(arguments.accuracy, Dimension::share);
    if (!(*plan.goal->error > 0 && *plan.goal->error < 1))
      throw InputError("--accuracy: must lie above 0 % and below 100 %");
  }
  if (!arguments.within.empty()) plan.goal->within = simulate::parse_timeout(arguments.within, "--within");
}

// The formats that the surface is written in.
std::vector<SurfaceFormat> written_formats_of(const Plan& plan) {
  std::vector<SurfaceFormat> formats;
  for (const Plan::Output& output : plan.outputs)
    if (output.surface && output.surface->format) formats.push_back(*output.surface->format);
  if (!plan.crack.pieces.empty()) formats.push_back(plan.crack.pieces_format);
  return formats;
}

bool writes_mesh(const Plan& plan) {
  const std::vector<SurfaceFormat> formats = written_formats_of(plan);
  return std::any_of(formats.begin(), formats.end(),
                     [](const SurfaceFormat& each) { return !each.file->is_cad; });
}

// Only what is written as a mesh is split.
void plan_refinement(Plan& plan) {
  if (writes_mesh(plan) || plan.refine.mode == mapping::RefineOptions::Mode::off) return;
  if (plan.refine.asked) throw InputError("--refine is for meshes: write one with -o, such as bent.stl");
  plan.refine.mode = mapping::RefineOptions::Mode::off;
}

void refuse_closer_look(const DeformArguments& arguments, const Plan& plan) {
  if (arguments.closer && !simulate::asks_for_quadratic(plan.job.scene))
    throw InputError("--refine-stress is for model \"quadratic\": add --model quadratic");
  if (arguments.closer && !arguments.within.empty())
    throw InputError("--refine-stress takes time of its own: leave --within out");
}

Plan make_plan(const DeformArguments& arguments, const CommandLine& app) {
  Plan plan;
  plan.map = map_options(arguments.map);
  plan.crack = crack_options(arguments.map);
  plan_outputs(arguments, plan);
  refuse_unused(arguments, plan);
  plan.refine = refine_options(arguments.map, app, plan.crack);
  plan_refinement(plan);
  plan.job = plan_job(arguments.job);
  plan_goal(arguments, app, plan);
  refuse_closer_look(arguments, plan);
  return plan;
}

// Returns what is said of CAD files.
std::vector<mapping::CadAnswer> write_outputs(const DeformArguments& arguments, const Plan& plan, Body& body,
                                              const mapping::MappedPart& mapped, Progress& progress) {
  progress.stage("write");
  if (!plan.crack.pieces.empty())
    write_parts(mapped.surface(body), mapped.result.displacement, plan.crack.pieces_format,
                default_unit(body.surface), plan.crack.pieces);
  const auto cad = [](const Plan::Output& output) { return output.surface && is_cad(*output.surface); };
  std::vector<mapping::MapOutput> cad_outputs;
  for (const Plan::Output& output : plan.outputs)
    if (cad(output)) cad_outputs.push_back(*output.surface);
  // first, for --strict may end the run here
  std::vector<mapping::CadAnswer> answers =
      write_cad(body, mapped.report, arguments.map, plan.map, cad_outputs, progress);
  for (const Plan::Output& output : plan.outputs)
    if (cad(output) || output.is_page())  // pages come last: they say what the run said
      continue;
    else if (output.surface)
      write_mapped(mapped.surface(body), body, mapped.result, *output.surface);
    else if (output.is_picture())
      picture::write_bent_picture(body, output.path, progress);
    else
      write_body(body, output.path);
  return answers;
}

// What the largest stress is looked at closer with, where that is asked for. `body`: that the run is given.
simulate::CutBox cut_box(const DeformArguments& arguments, const Plan& plan, const Body& body) {
  if (!arguments.closer) return {};
  const auto voxelizer = std::make_shared<std::optional<voxelize::BoxVoxelizer>>();
  return [voxelizer, &body, heal = plan.job.voxelize.heal](const simulate::LatticeBox& box) {
    if (!*voxelizer) voxelizer->emplace(body.surface, heal);
    return (**voxelizer)(box.lattice, box.lower, box.upper);
  };
}

simulate::SimulateOptions simulate_options(const DeformArguments& arguments, const Plan& plan) {
  simulate::SimulateOptions options;
  options.threads = arguments.threads;
  options.failed_output = failed_name(plan);
  options.estimate = arguments.estimate;
  return options;
}

bool walls_are_thin(const voxelize::VoxelizeResult& voxels) {
  return wall_thickness(voxels) < kThinWalls * voxels.parts.front().spacing.minCoeff();
}

// For model `quadratic` too: nor do a tenth of the cells resolve such walls.
bool walls_are_too_thin(const voxelize::VoxelizeResult& voxels) {
  constexpr double kTooThin = 0.3;  // cells
  return wall_thickness(voxels) <= kTooThin * voxels.parts.front().spacing.minCoeff();
}

// Which model the runs at several sizes have. Where nobody says it, thin walls get `quadratic`, unless that does not take
// the scene.
class ModelChoice {
 public:
  explicit ModelChoice(Job& job)
      : job_(job),
        free_(job.scene.model.empty() &&
              std::none_of(job.scene.parts.begin(), job.scene.parts.end(),
                           [](const auto& part) { return !part.second.model.empty(); })) {}

  void choose(const voxelize::VoxelizeResult& usual) {
    if (!may_be_other() || !walls_are_thin(usual)) return;
    if (walls_are_too_thin(usual)) return keep();
    use_quadratic(
        fmt::format("a fifth of the matter lies in walls thinner than {} of the usual cells", kThinWalls));
  }
  // Nobody named a model, and `cells` is in use.
  [[nodiscard]] bool may_be_other() const { return free_ && !chosen_; }
  void use_quadratic(const std::string& why) {
    set(true);
    why_ = why;
  }
  void use_cells() { set(false); }
  void keep() { free_ = false; }
  [[nodiscard]] bool may_take_back() const { return chosen_ && free_; }
  // False where the model was not chosen here, or has answered already.
  bool take_back(const std::string& why) {
    if (!may_take_back()) return false;
    set(false);
    free_ = false;
    why_not_ = why;
    return true;
  }
  // Why the model that was chosen is not the one that answered; "" if it is.
  [[nodiscard]] const std::string& why_not() const { return why_not_; }
  // Why `quadratic` was chosen.
  [[nodiscard]] const std::string& why() const { return why_; }
  [[nodiscard]] bool quadratic() const { return job_.voxelize.moments; }
  [[nodiscard]] bool chosen() const { return chosen_; }

 private:
  void set(bool chosen) {
    chosen_ = job_.voxelize.moments = chosen;
    job_.scene.model = chosen ? "quadratic" : "";
  }

  Job& job_;
  bool free_;
  bool chosen_ = false;
  std::string why_, why_not_;
};

// The runs at several sizes; warnings of runs that are only tried are held back.
class GoalRuns {
 public:
  GoalRuns(const DeformArguments& arguments, Plan& plan, const Surface& surface, Progress& progress)
      : arguments_(arguments),
        plan_(plan),
        surface_(surface),
        progress_(progress),
        inner_("flexel",
               arguments.quiet || arguments.verbose ? Progress::Mode::quiet : Progress::Mode::automatic),
        model_(plan.job) {}

  SolvedRun operator()(std::optional<double> size, const GoesOn& goes_on) {
    constexpr double kCoarser = 2.2;
    std::optional<StopAfter> limit;
    // what takes too long for model `cells` is its usual size, not that of the model that it stands in for
    if (size && !solved_ && !model_.why_not().empty())
      size = std::min(*size, preferred_number(kCoarser * usual_size_, 20, Rounded::nearest));
    if (size && model_.may_take_back()) limit.emplace(patience(), "--within");
    try {
      if (size) {
        SolvedRun run = surer_of_two(solve(size, goes_on));
        model_.keep();
        return run;
      }
      usual_size_ = made(size).size;
      if (arguments_.closer) refuse_scene_of_closer_look(made_->voxels.body);
      model_.choose(made_->voxels);
      if (model_.chosen()) return size_of(made(size));
      return size_of(*made_);
    } catch (const InputError& error) {
      if (!model_.take_back(error.what())) throw;
    } catch (const simulate::OverloadError&) {
      throw;
    } catch (const DivergedError& error) {
      if (!model_.take_back(error.what())) throw;
    } catch (const TimeoutError&) {
      if (!limit || !limit->passed() || !model_.may_take_back()) throw;
      limit.reset();
      if (std::optional<SolvedRun> run = with_few_cells(*size, goes_on)) return *std::move(run);
      (void)model_.take_back("it takes too long");
    }
    limit.reset();
    return size ? solve(usual_size_, goes_on) : size_of(made(usual_size_));
  }

  [[nodiscard]] mapping::MapResult map(SolvedRun& run, mapping::MapMethod method) {
    mapping::MapOptions options;
    options.method = method;
    return map_part(run.voxels.body, options, {}, inner_).result;
  }
  [[nodiscard]] const ModelChoice& model() const { return model_; }
  void drop_warnings() { (void)warnings_.take(); }
  // In vain: `cells` was surer.
  [[nodiscard]] bool tried_quadratic() const { return tried_quadratic_; }

 private:
  // Where the first answer of model `cells` is not what is asked for, that of `quadratic` if its bar is narrower: a
  // thousand such cells, in a second or two, often answer what `cells` takes hundreds of thousands for.
  SolvedRun surer_of_two(SolvedRun run) {
    constexpr double kRough = 0.2;       // where no error is asked for
    constexpr double kSideTrial = 0.15;  // of the time, which finer cells need as much
    if (run.given_up || !model_.may_be_other()) return run;
    std::vector<SolvedRun> first;
    first.push_back(std::move(run));
    const double guess = error_of(first);
    if (!(guess > plan_.goal->error.value_or(kRough))) return std::move(first.front());
    model_.use_quadratic("the first answer of model cells " + in_words(guess));
    const mapping::MapOptions map = plan_.map;
    std::string why_not;
    try {
      const StopAfter limit(patience(kSideTrial, kSideTrial), "--within");
      std::vector<SolvedRun> other;
      const double size = made(std::nullopt).size;
      other.push_back(solve(size, [](std::size_t) { return true; }));
      const double error = error_of(other);
      why_not = other.front().simulated.strain_warning;  // its bar does not cover that
      if (why_not.empty() && error < guess) return std::move(other.front());
      if (why_not.empty()) why_not = "no surer: its first answer " + in_words(error);
    } catch (const InputError& error) {  // a scene that `quadratic` does not take
      why_not = error.what();
    } catch (const DivergedError& error) {
      why_not = error.what();
    } catch (const TimeoutError&) {  // there is an answer; a limit of the whole command ends what comes next
      why_not = "it takes too long";
    } catch (const std::bad_alloc&) {
      why_not = "it takes too much memory";
    }
    progress_.say(fmt::format("model quadratic, tried beside a first answer of model cells that {}: {}",
                              in_words(guess), why_not));
    drop_warnings();
    plan_.map = map;
    model_.use_cells();
    tried_quadratic_ = true;
    return std::move(first.front());
  }
  // Of error_of().
  static std::string in_words(double error) {
    return std::isfinite(error) ? "was off by up to " + human_share(error) : "had no error bars";
  }
  // Share; of no bar infinite.
  [[nodiscard]] double error_of(const std::vector<SolvedRun>& run) const {
    const StopWaits answered;
    const std::optional<Judged> judged = judge(run, Quantities(plan_.goal->driven));
    return judged ? judged->error : std::numeric_limits<double>::infinity();
  }

  // Of model `quadratic`, where the usual count takes too long: a few such cells bend far better than those of model `cells` do
  // where walls are thin. Nothing where these fail too, or are no fewer than those of the size that was `tried`.
  std::optional<SolvedRun> with_few_cells(double tried, const GoesOn& goes_on) {
    constexpr double kSecondTrial = 0.3;  // of the time
    few_ = true;
    try {
      const StopAfter limit(patience(kSecondTrial, kSecondTrial), "--within");
      if (const double size = made(std::nullopt).size; size > tried) {
        SolvedRun run = solve(size, goes_on);
        model_.keep();
        return run;
      }
    } catch (const InputError&) {
    } catch (const simulate::OverloadError&) {
      throw;
    } catch (const DivergedError&) {
    } catch (const TimeoutError&) {  // a limit of the whole command ends what comes next
    }
    few_ = false;
    return {};
  }

  // s, for the first answer of a model that nobody asked for.
  [[nodiscard]] double patience(double share = 0.3, double usual_share = 0.45) const {
    constexpr double kUsual = 30;  // s, without --within
    const AccuracyGoal& goal = *plan_.goal;
    return (goal.by_default ? usual_share * slowed_by_others(goal.began) : share) *
           goal.within.value_or(kUsual);
  }
  // No more than --max-elements and --max-memory let pass.
  [[nodiscard]] std::size_t usual_count() const {
    constexpr double kElementsPerCell = 2.5, kSpare = 1.25;  // a preferred size may have a fifth more cells
    const bool few = few_ || plan_.goal->within.value_or(kShort) < kShort, quadratic = model_.quadratic();
    const std::size_t count = quadratic ? few ? kFewQuadraticCells : kFirstQuadraticCells
                              : few     ? kFewCells
                                        : kFirstCells;
    const double allowed =
        std::min(element_limit() / kElementsPerCell,
                 voxelize::cells_within(memory_to_use(), Placement::corner, quadratic) / kSpare);
    return static_cast<std::size_t>(std::clamp(allowed, 1.0, static_cast<double>(count)));
  }

  void refuse_scene_of_closer_look(const Body& body) const {
    Job job = plan_.job;
    add_actions(job, body);
    simulate::refuse_closer_look(body, job.scene);
  }

  static SolvedRun size_of(const SolvedRun& made) {
    SolvedRun run;
    run.size = made.size;
    return run;
  }

  // Its lattice; nothing: at the size for a usual count. Kept for solve(), which may ask for it next.
  SolvedRun& made(std::optional<double> size) {
    if (made_ && made_->size == size && made_with_moments_ == plan_.job.voxelize.moments) return *made_;
    made_.reset();
    drop_warnings();
    voxelize::VoxelizeOptions options = plan_.job.voxelize;
    options.size = size;
    if (!size) {
      options.count = usual_count();
      options.rounded = [](double any) { return preferred_number(any, 20, Rounded::nearest); };
    }
    SolvedRun run;
    const double processor = processor_seconds();
    const auto began = std::chrono::steady_clock::now();
    run.voxels = voxelize::voxelize(surface_, options, inner_);
    run.voxelize_seconds = seconds_since(began);
    run.processor_seconds = processor_seconds() - processor;
    run.size = run.voxels.size;
    made_with_moments_ = options.moments;
    return made_.emplace(std::move(run));
  }

  SolvedRun solve(std::optional<double> size, const GoesOn& goes_on) {
    const AccuracyGoal& goal = *plan_.goal;  // without a time of its own the search takes what it needs
    progress_.update(goal.within ? seconds_since(goal.began) / *goal.within : 0,
                     size ? "--size " + size_text(*size) : "");
    SolvedRun run = std::move(made(size));
    made_.reset();
    if (!goes_on(run.voxels.body.cell_count())) {
      run.given_up = true;
      return run;
    }
    const double processor = processor_seconds();
    Job job = plan_.job;  // anew for each body: an action that throws leaves none out
    simulate::SimulateOptions asked = simulate_options(arguments_, plan_);
    if (solved_) asked.failed_output.clear();  // there is a result
    ++tries_;
    try {
      add_actions(job, run.voxels.body);
      run.simulated = simulate::simulate(run.voxels.body, job.scene, asked, inner_);
    } catch (const InputError&) {
      voxelize::report(run.voxels, inner_);  // its warnings may say why
      throw;
    }
    std::error_code ignored;
    if (!solved_ && tries_ > 1) std::filesystem::remove(asked.failed_output, ignored);  // of one before
    solved_ = true;
    const auto began = std::chrono::steady_clock::now();
    use_field(run.voxels.body, arguments_.map, plan_.map);
    run.mapped = map(run, plan_.map.method).displacement;
    run.map_seconds = seconds_since(began);
    run.processor_seconds += processor_seconds() - processor;
    if (!model_.quadratic()) run.wall = wall_thickness(run.voxels);
    run.warnings = warnings_.take();
    return run;
  }

  const DeformArguments& arguments_;
  Plan& plan_;
  const Surface& surface_;
  Progress& progress_;
  Progress inner_;  // of one run: bars and warnings, no lines
  int tries_ = 0;
  bool solved_ = false;  // one of them
  bool few_ = false;     // the usual count takes too long
  bool tried_quadratic_ = false;
  HeldWarnings warnings_;
  ModelChoice model_;
  double usual_size_ = 0;  // m, of a lattice for model `cells`
  std::optional<SolvedRun> made_;
  bool made_with_moments_ = false;
};

// The size that --accuracy or --within asks for, and the run at it. The mapping is `smooth` where that moves
// a vertex by more than a quarter of the error asked for beside what --method says.
SolvedRun solve_to_goal(const DeformArguments& arguments, Plan& plan, const Surface& surface,
                        AccuracyReport& accuracy, Progress& progress) {
  for (const simulate::Tie& tie : plan.job.scene.get<simulate::Supports>().ties)
    plan.goal->driven |= tie.is_move;
  plan.goal->driven |= !plan.job.scene.get<simulate::Indenters>().indenters.empty();
  plan.goal->driven |= !plan.job.moves.empty() || !plan.job.twists.empty() || plan.job.flex;
  GoalRuns runs(arguments, plan, surface, progress);
  SolvedRun run = choose_resolution(*plan.goal, std::ref(runs), accuracy, progress);
  runs.drop_warnings();
  if (plan.goal->error && plan.map.method == &mapping::kBlended &&
      mapping_difference(run.mapped, runs.map(run, &mapping::kSmooth).displacement) >
          0.25 * *plan.goal->error)
    plan.map.method = &mapping::kSmooth;
  accuracy.method = name_of(plan.map.method);
  accuracy.dropped_model = runs.model().why_not();
  accuracy.tried_quadratic = runs.tried_quadratic();
  if (runs.model().chosen())
    progress.say(fmt::format("model quadratic: {} (--model cells is the other)", runs.model().why()));
  return run;
}

// The run that was chosen again, with a closer look at its largest stress. Its bars stay, which other sizes may have widened; so does it
// where that takes more than half of the time left.
SolvedRun with_closer_look(const DeformArguments& arguments, const Plan& plan, const Surface& surface,
                           SolvedRun chosen, Progress& progress) {
  HeldWarnings told;  // by the run that was chosen
  progress.stage("largest stress");
  constexpr double kVoxelized = 0.1;  // of the time
  voxelize::VoxelizeOptions how = plan.job.voxelize;
  how.size = chosen.size;
  const StopAfter limit(0.5 * time_left(), "the closer look");
  try {
    voxelize::VoxelizeResult voxels = [&] {
      ProgressStretch voxelizing(progress, 0, kVoxelized);
      return voxelize::voxelize(surface, how, voxelizing.inner());
    }();
    Job job = plan.job;
    add_actions(job, voxels.body);
    simulate::SimulateOptions asked = simulate_options(arguments, plan);
    asked.failed_output.clear();  // there is a result
    asked.cut_box = cut_box(arguments, plan, voxels.body);
    ProgressStretch solving(progress, kVoxelized, 1);
    simulate::SimulateResult again = simulate::simulate(voxels.body, job.scene, asked, solving.inner());
    const std::optional<simulate::StressBar> stress = again.error_bars.von_mises;
    again.error_bars = std::move(chosen.simulated.error_bars);
    if (stress) again.error_bars.von_mises = stress;  // else time ended the run before its bars
    chosen.voxels = std::move(voxels);
    chosen.simulated = std::move(again);
  } catch (const TimeoutError&) {
    if (!limit.passed()) throw;
    chosen.simulated.no_local_stress = "it did not end in half of the time that was left";
  }
  (void)told.take();
  return chosen;
}

Surface read_part_files(const DeformArguments& arguments, const Plan& plan, Progress& progress) {
  if (arguments.part != nullptr) return *arguments.part;
  const StopEndsProcess at_once;
  return read_parts(arguments.job.parts, plan.job.import, progress);
}

// Lattice and simulation; of --accuracy and --within what they chose.
SolvedRun solve(const DeformArguments& arguments, Plan& plan, std::optional<AccuracyReport>& accuracy,
                Progress& progress) {
  progress.stage("import");
  Surface surface = read_part_files(arguments, plan, progress);
  check_parts(plan.job, surface);
  if (arguments.closer && surface.parts.size() > 1)
    throw InputError(fmt::format("--refine-stress is for one part, and there are {}", surface.parts.size()));
  if (plan.goal) {
    progress.stage("choose the size");
    SolvedRun run = solve_to_goal(arguments, plan, surface, accuracy.emplace(), progress);
    return arguments.closer ? with_closer_look(arguments, plan, surface, std::move(run), progress)
                            : std::move(run);
  }
  SolvedRun run;
  {
    const StopEndsProcess at_once;
    run.voxels = voxelize::voxelize(std::move(surface), plan.job.voxelize, progress);
  }
  voxelize::report(run.voxels, progress);
  add_actions(plan.job, run.voxels.body);
  simulate::SimulateOptions asked = simulate_options(arguments, plan);
  asked.cut_box = cut_box(arguments, plan, run.voxels.body);
  run.simulated = simulate::simulate(run.voxels.body, plan.job.scene, asked, progress);
  use_field(run.voxels.body, arguments.map, plan.map);
  return run;
}

// A wide bar, and walls that the cells of model `cells` are too coarse for.
bool has_thin_walls(const SolvedRun& run) {
  constexpr double kWide = 0.1;  // share
  double worst = 0;
  for (const simulate::ErrorBar& each : run.simulated.error_bars.bars)
    if (each.of != simulate::ErrorBar::Of::elastic_energy && std::abs(each.value) > 0)
      worst = std::max(worst, each.bar.half_width / std::abs(each.value));
  return worst > kWide && walls_are_thin(run.voxels) && !walls_are_too_thin(run.voxels);
}

// Model `quadratic` takes the scene: equilibrium without contact.
bool suits_quadratic(const SolvedRun& run, const simulate::Scene& scene) {
  return !QuadraticField::is_in(run.voxels.body) && !run.simulated.timed && !run.simulated.settled &&
         scene.get<simulate::Indenters>().indenters.empty();
}

// What to do next, of this run.
std::string next_step(const SolvedRun& run, const simulate::Scene& scene,
                      const std::optional<AccuracyReport>& accuracy) {
  if (!accuracy) return "";
  if (suits_quadratic(run, scene) && has_thin_walls(run) && accuracy->dropped_model.empty() &&
      !accuracy->tried_quadratic)
    return "--model quadratic is made for walls as thin as these";
  std::string chosen = accuracy->goal.error ? "for " + human_share(*accuracy->goal.error) : "to end";
  if (accuracy->goal.within) chosen += " within " + human_seconds(*accuracy->goal.within);
  const bool usual = accuracy->method == name_of(&mapping::kBlended) ||
                     accuracy->method == name_of(&mapping::kShapeFunctions);
  const std::string method = usual ? "" : " --method " + accuracy->method;
  const bool quadratic = QuadraticField::is_in(run.voxels.body);
  const std::string repeat =
      fmt::format("--size {}{}{} repeats this run, chosen {}", size_text(accuracy->runs.back().size),
                  quadratic ? " --model quadratic" : "", method, chosen);
  return accuracy->advice.empty() ? repeat : accuracy->advice + "; " + repeat;
}

// Of `flexel flex`; nothing where the surface was cut along cracks, whose vertices are others.
std::optional<FlexAnswer> flex_answer(const SolvedRun& run, const Plan& plan,
                                      const mapping::MappedPart& mapped, Progress& progress) {
  if (!plan.job.flex || mapped.cracked) return std::nullopt;
  FlexAnswer answer{measure_flex(*plan.job.flex, run.voxels.body, mapped.result.displacement), {}};
  // that of the matter: large triangles cut off what is bent
  const mapping::MapReport& report = mapped.report;
  if (report.lattice_volume_before > 0)
    answer.volume_change = report.lattice_volume_after / report.lattice_volume_before - 1;
  const std::string missed = flex_warning(*plan.job.flex, answer);
  if (!missed.empty() && !flex_failed(*plan.job.flex, answer)) progress.warn(missed);
  return answer;
}

std::string summary_text(const SolvedRun& run, const mapping::MapReport& mapped, const Plan& plan,
                         const std::optional<AccuracyReport>& accuracy,
                         const std::optional<FlexAnswer>& flexed, const std::vector<mapping::CadAnswer>& cad,
                         const KeptWarnings& warnings) {
  nlohmann::ordered_json summary;
  summary["voxelize"] = parse_json(voxelize::summary_json(run.voxels));
  summary["simulate"] = parse_json(simulate::summary_json(run.simulated, run.voxels.body,
                                                          known_materials(plan.job.scene, run.voxels.body)));
  summary["map"] = parse_json(mapping::report_json(mapped, plan.map));
  if (accuracy) summary["accuracy"] = parse_json(accuracy->json());
  if (flexed) {
    summary["flex"] = {{"angle", flexed->angle}, {"angle_asked", plan.job.flex->angle}};
    if (flexed->volume_change) summary["flex"]["volume_change"] = *flexed->volume_change;
  }
  for (const mapping::CadAnswer& each : cad) summary["cad"].push_back(parse_json(each.json));
  summary["warnings"] = warnings.lines();
  return json_text(summary, 2) + "\n";
}

// What is said at the end. `infill`: estimates for infill too, where nobody has said them. The last one says what to do
// next.
std::vector<std::string> last_lines(const SolvedRun& run, const Plan& plan,
                                    const std::optional<AccuracyReport>& accuracy, bool infill,
                                    const std::vector<mapping::CadAnswer>& cad) {
  const Body& body = run.voxels.body;
  std::vector<std::string> lines;
  const std::vector<simulate::Material> materials = known_materials(plan.job.scene, body);
  if (infill)
    for (std::size_t p = 0; p < materials.size(); ++p)
      if (const std::string line = infill_line(body.parts[p].name, materials[p]); !line.empty())
        lines.push_back(line);
  for (const std::string& line :
       answer_lines(run.simulated, body, materials, next_step(run, plan.job.scene, accuracy), "--size"))
    lines.push_back(line);
  for (const mapping::CadAnswer& each : cad) lines.insert(lines.end() - 1, "faces      " + each.line);
  return lines;
}

// Returns why a page is missing; the other results are not lost for it.
std::optional<view::PageTooLarge> write_pages(const DeformArguments& arguments, const Plan& plan, Body& body,
                                              const view::RunWords& words, Progress& progress) {
  std::optional<view::PageTooLarge> missing;
  std::string label;
  for (const std::string& part : arguments.job.parts)
    label += (label.empty() ? "" : ", ") + std::filesystem::path(part).filename().string();
  for (const Plan::Output& output : plan.outputs)
    if (output.is_page()) try {
        write_result_page(body, label + ", deformed", words, output.path, progress);
      } catch (const view::PageTooLarge& error) {
        if (missing) progress.warn(missing->what());
        missing = error;
      }
  return missing;
}

void say_dropped_model(const AccuracyReport& accuracy, Progress& progress) {
  if (accuracy.dropped_model.empty()) return;
  progress.say(fmt::format(
      "walls are thin here, and model quadratic, made for such, gave no answer ({}): model cells is used",
      accuracy.dropped_model));
}

Deformed run_stages(const DeformArguments& arguments, Plan& plan, Progress& progress) {
  const KeptWarnings warnings;  // for the summary and the pages
  Deformed result;
  auto& [run, mapped, accuracy, lines, summary, cad] = result;
  {
    const BriefOutput brief(!arguments.verbose);
    run = solve(arguments, plan, accuracy, progress);
  }
  Body& body = run.voxels.body;
  for (const std::string& line : run.warnings) progress.warn(line);
  const StopEndsProcess at_once;
  {
    const BriefOutput brief(!arguments.verbose);
    if (accuracy) report(run.voxels, progress);
    for (const std::string& line : summary_lines(run.simulated)) progress.say(line);
    progress.stage("map");
    mapped =
        map_refined(body, plan.map, plan.crack, plan.refine, nullptr, written_formats_of(plan), progress);
    progress.finish();
    if (!writes_mesh(plan)) mapped.report.chord.reset();  // nobody gets the triangles
    say_report(mapped.report, arguments.map, plan.map, progress);
  }
  if (accuracy) say_dropped_model(*accuracy, progress);
  if (!mapped.split_line.empty()) progress.say(mapped.split_line);
  const mapping::MapReport& found = mapped.report;
  std::vector<std::string> paths{arguments.map.report, arguments.summary, plan.crack.pieces};
  for (const Plan::Output& output : plan.outputs) paths.push_back(output.path);
  OutputsTogether outputs(std::move(paths));
  {
    const BriefOutput brief(!arguments.verbose);
    try {
      write_report(found, arguments.map, plan.map, arguments.map.report);
      cad = write_outputs(arguments, plan, body, mapped, progress);
    } catch (const InvalidMappingError&) {
      outputs.appear();
      throw;
    }
    if (accuracy) {
      accuracy->seconds = seconds_since(plan.goal->began);
      accuracy->met() || accuracy->goal.by_default ? progress.say(accuracy->sentence())
                                                   : progress.warn(accuracy->sentence());
    }
    progress.finish();
  }
  const std::optional<FlexAnswer> flexed = flex_answer(run, plan, mapped, progress);
  summary = summary_text(run, found, plan, accuracy, flexed, cad, warnings);
  if (!arguments.summary.empty()) write_text(summary, arguments.summary);
  // With --verbose simulate() has said what infill is.
  lines = last_lines(run, plan, accuracy, accuracy || !arguments.verbose, cad);
  if (flexed) lines.push_back(flex_line(*plan.job.flex, *flexed));
  const std::optional<view::PageTooLarge> missing =
      write_pages(arguments, plan, body, {warnings.lines(), lines, summary}, progress);
  outputs.appear();
  for (const std::string& line : lines) progress.say(line);
  if (arguments.json) write_text(summary, "-");
  if (missing) throw *missing;
  if (flexed && flex_failed(*plan.job.flex, *flexed))
    throw InvalidMappingError(flex_warning(*plan.job.flex, *flexed) + "; what came of it is written");
  return result;
}

// Nothing: help was asked for.
std::optional<Deformed> run_with(DeformArguments arguments, int argc, char** argv, Progress::Mode mode) {
  const bool flex = arguments.job.flex.has_value();
  CommandLine app{
      flex ? "Bends or twists a part to an angle: its ends are led there, and its material decides what lies "
             "between."
           : "Deforms a part as its material would be: import, lattice, simulation and mapping in one run.",
      flex ? "flexel flex" : "flexel deform"};
  declare_input(app, arguments.job);
  declare_output(app, arguments);
  // Runs in time leave something, and see to it themselves; a time limit, which comes later, leaves the last state.
  const StopEndsProcess nothing_is_left;
  if (!parse_arguments(app, argc, argv)) return {};
  if (!arguments.html.empty()) {
    if (extension(arguments.html) != "html" && extension(arguments.html) != "htm")
      throw InputError(
          fmt::format("--html {}: pages are HTML: name it {}.html", arguments.html, stem(arguments.html)));
    arguments.outputs.push_back(arguments.html);
  }
  Plan plan;
  if (arguments.part != nullptr)
    plan = make_plan(arguments, app);
  else
    plan_after_files(arguments.job, [&] { plan = make_plan(arguments, app); });
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : mode);
  return run_stages(arguments, plan, progress);
}

}  // namespace

int deform_command(int argc, char** argv) {
  (void)run_with({}, argc, argv, Progress::Mode::automatic);
  return kExitDone;
}

int flex_command(int argc, char** argv) {
  DeformArguments arguments;
  arguments.job.flex.emplace();
  (void)run_with(std::move(arguments), argc, argv, Progress::Mode::automatic);
  return kExitDone;
}

Deformed deform(const std::vector<std::string>& arguments, const Surface* part, Progress::Mode mode) {
  std::vector<std::string> words = {"deform"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers(words.size() + 1, nullptr);
  std::transform(words.begin(), words.end(), pointers.begin(), [](std::string& word) { return word.data(); });
  DeformArguments given;
  given.needs_output = false;
  given.part = part;
  std::optional<Deformed> result =
      run_with(std::move(given), static_cast<int>(words.size()), pointers.data(), mode);
  if (!result) throw InputError("help is no result: leave --help out");
  return *std::move(result);
}

}  // namespace flexel::commands
