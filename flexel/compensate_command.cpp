// flexel compensate: the part to be made so that the scene bends it into the shape of PART. Fixed-point iteration on the
// vertices: m <- m - (m + u(m) - x), u(m) the displacement of the part made as m, each on a lattice of its own.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/files/json.h"
#include "base/files/output_file.h"
#include "base/files/outputs.h"
#include "base/human.h"
#include "base/math/area_vector.h"
#include "base/parallel.h"
#include "base/program/brief_output.h"
#include "base/program/progress_stretch.h"
#include "base/program/termination.h"
#include "base/stop.h"
#include "base/units.h"
#include "flexel/commands.h"
#include "flexel/compensate/inverse_field.h"
#include "flexel/job.h"
#include "formats/common/file_format.h"
#include "formats/lattice/body_file.h"
#include "mapping/cad_output.h"
#include "mapping/output.h"
#include "simulate/effects/rigid.h"
#include "simulate/indent/indenters.h"
#include "simulate/input/side_places.h"
#include "simulate/result/options.h"
#include "simulate/simulate.h"
#include "simulate/time/dynamic_relaxation.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

constexpr double kStopsAt = 1e-3, kAllowed = 0.01;  // of the largest displacement: to stop at; to be told of
constexpr int kMostIterations = 12;
constexpr double kOwnLattice = 0.8;                 // spacing of the check, of that of the iteration
constexpr double kFirstRun = 0.1, kIterated = 0.8;  // of the time, at most
constexpr double kLeastFacing = 0.1;  // cosine between a face as it is to be and as it is to be made

struct CompensateArguments {
  JobArguments job;
  std::vector<std::string> outputs;
  std::string summary;
  mapping::MapArguments map;
  int threads = 0;
  bool quiet = false, json = false;
};

struct Output {
  std::string path;
  std::optional<mapping::MapOutput> surface;  // nothing: the body
};

// The vertex that is furthest from where it should be.
struct Rest {
  double largest = 0, mean_square = 0;  // m, m^2
  Vec3 at = Vec3::Zero();               // m, of the shape wanted
  [[nodiscard]] double rms() const { return std::sqrt(mean_square); }
};

std::string place(const Vec3& at) {
  return fmt::format("({}, {}, {}) mm", human_number(1e3 * at.x()), human_number(1e3 * at.y()),
                     human_number(1e3 * at.z()));
}

class Compensation {
 public:
  Compensation(const CompensateArguments& arguments, Job job, Progress& progress)
      : arguments_(arguments), job_(std::move(job)), progress_(progress) {}

  // Iterates, then checks on a lattice of its own.
  void find(Surface wanted) {
    wanted_ = std::move(wanted);
    made_ = wanted_.vertices;
    progress_.stage("compensate");
    run(kIteration, 0, kFirstRun);
    if (job_.voxelize.count || !job_.voxelize.size) {
      job_.voxelize.count.reset();
      job_.voxelize.size = std::cbrt(body_.parts.front().lattice.spacing.prod());
    }
    lattice_ = body_;
    split();
    largest_ = rest().largest;  // nothing is compensated yet
    if (!(largest_ > 0)) throw InputError("the scene moves nothing: there is nothing to compensate");
    iterate();
    field_ = body_;
    run(kOwnLattice, kIterated, 1);
    pass_on(warnings_);
    check_ = rest();
    refuse_worse(check_);
  }

  void write(const std::vector<Output>& outputs) {
    progress_.stage("write");
    Body& body = lattice_;
    take_inverse_field(field_, body);
    mapping::MapOptions options;
    mapping::MappedPart mapped = map_part(body, options, {}, quiet_);
    std::vector<mapping::MapOutput> cad;
    for (const Output& output : outputs)
      if (output.surface && is_cad(*output.surface)) cad.push_back(*output.surface);
    for (const mapping::CadAnswer& answer :
         write_cad(body, mapped.report, arguments_.map, options, cad, progress_))
      progress_.say(answer.line);
    if (wanted_.vertices.size() != body.surface.vertices.size()) {
      body.surface = wanted_;
      mapped.result = {};
    }
    mapped.result.displacement.resize(wanted_.vertices.size());
    for (std::size_t v = 0; v < made_.size(); ++v)
      mapped.result.displacement[v] = made_[v] - wanted_.vertices[v];
    for (const Output& output : outputs)
      if (!output.surface)
        write_body(body, output.path);
      else if (!is_cad(*output.surface))
        write_mapped(wanted_, body, mapped.result, *output.surface);
  }

  void tell() const {
    progress_.say(fmt::format("largest displacement {}; {} iterations", human_length(largest_), iterations_));
    const std::string left = fmt::format(
        "checked on a lattice of its own: {} remain at {}, {} of the largest displacement (rms {})",
        human_length(check_.largest), place(check_.at), human_share(check_.largest / largest_),
        human_length(check_.rms()));
    if (check_.largest > kAllowed * largest_)
      progress_.warn(left + "; use a smaller --size" + other_model());
    else
      progress_.say(left);
  }

  [[nodiscard]] std::string summary() const {
    nlohmann::ordered_json json;
    json["largest_displacement"] = largest_;
    json["iterations"] = iterations_;
    json["remaining"] = check_.largest;
    json["remaining_rms"] = check_.rms();
    json["remaining_at"] = {check_.at.x(), check_.at.y(), check_.at.z()};
    json["remaining_share"] = check_.largest / largest_;
    return json_text(json, 2) + "\n";
  }

 private:
  static constexpr double kIteration = 1;

  // The part as it is made now, on a lattice whose spacing is `finer` times the usual one, under the scene; `from`, `to`:
  // of the whole time.
  void run(double finer, double from, double to) {
    constexpr double kVoxelized = 0.1, kSimulated = 0.9;  // of the run's time
    const auto at = [&](double share) { return from + share * (to - from); };
    check_stop();
    Surface surface = wanted_;
    surface.vertices = made_;
    name_sides_as_wanted(surface);
    voxelize::VoxelizeOptions options = job_.voxelize;
    if (options.size) *options.size *= finer;
    voxelize::VoxelizeResult voxels = [&] {
      ProgressStretch stretch(progress_, at(0), at(kVoxelized), kProgram);
      return voxelize::voxelize(std::move(surface), options, stretch.inner());
    }();
    if (!reported_) report(voxels);
    HeldWarnings held;  // of a run that fails they are printed
    ProgressStretch simulating(progress_, at(kVoxelized), at(kSimulated), kProgram);
    Body body = std::move(voxels.body);
    Job job = job_;
    add_actions(job, body);
    simulate::SimulateOptions how;
    how.threads = arguments_.threads;
    how.estimate = how.stress = false;
    (void)simulate::simulate(body, job.scene, how, simulating.inner());
    body.surface.vertex_columns.erase(simulate::kSidePlacesColumn);
    mapping::MapOptions map;
    use_field(body, arguments_.map, map);
    ProgressStretch placing(progress_, at(kSimulated), at(1), kProgram);
    mapping::MappedPart mapped = map_part(body, map, {}, placing.inner());
    moved_ = std::move(mapped.result.displacement);
    body_ = std::move(body);
    last_ = std::move(mapped.result);
    warnings_ = held.take();
  }

  // Bent into the shape to be made it has the sides that it has in the shape that is wanted.
  void name_sides_as_wanted(Surface& surface) const {
    Column places{3, {}};
    for (const Vec3& each : wanted_.vertices)
      places.values.insert(places.values.end(), each.data(), each.data() + 3);
    surface.vertex_columns[simulate::kSidePlacesColumn] = std::move(places);
  }

  // What is wrong with the part that was given; those made of it share that.
  void report(const voxelize::VoxelizeResult& voxels) {
    std::vector<std::string> lines;
    {
      HeldWarnings held;
      voxelize::report(voxels, quiet_);
      lines = held.take();
    }
    pass_on(lines);
    reported_ = true;
  }

  void pass_on(const std::vector<std::string>& warnings) {
    for (const std::string& line : warnings) progress_.warn(line);
  }

  // Triangles that are too large to show the deformation are split, so that what is made can bend.
  void split() {
    last_.displacement = moved_;
    const std::optional<Body> finer = mapping::split_where_coarse(body_, last_, progress_);
    if (!finer) return;
    wanted_ = finer->surface;
    made_ = wanted_.vertices;
    run(kIteration, kFirstRun, kFirstRun);
  }

  // How much of the way to kStopsAt is gone when so much remains [m].
  [[nodiscard]] double gone(double remains) const {
    return std::clamp(std::log(remains / largest_) / std::log(kStopsAt), 0.0, 1.0);
  }

  // Each iteration is thought to go as far as the last.
  void iterate() {
    double before = largest_, done = 0, step = 0.3;
    const auto at = [](double share) { return kFirstRun + share * (kIterated - kFirstRun); };
    std::vector<Vec3> best = made_;
    for (iterations_ = 1; iterations_ <= kMostIterations; ++iterations_) {
      for (std::size_t v = 0; v < made_.size(); ++v) made_[v] -= made_[v] + moved_[v] - wanted_.vertices[v];
      refuse_folded();
      const double expected = done + std::min(step, (1 - done) / 2);
      run(kIteration, at(done), at(expected));
      const Rest left = rest();
      const double now = left.largest;
      if (iterations_ == 1 && !(now < before)) {
        pass_on(warnings_);
        refuse_worse(left);
      }
      step = std::max(gone(now) - gone(before), 1.0 / kMostIterations);
      done = std::max(expected, gone(now));
      progress_.update(at(done), fmt::format("{} remain", human_length(now)));
      if (now >= before) {  // what is left is that of the lattices
        made_ = best;
        run(kIteration, at(done), at(1));
        return;
      }
      best = made_;
      if (now <= kStopsAt * largest_) return;
      before = now;
    }
    iterations_ = kMostIterations;
  }

  [[nodiscard]] Rest rest() const {
    Rest found;
    for (std::size_t v = 0; v < made_.size(); ++v) {
      const double away = (made_[v] + moved_[v] - wanted_.vertices[v]).norm();
      found.mean_square += away * away / static_cast<double>(made_.size());
      if (away <= found.largest) continue;
      found.largest = away;
      found.at = wanted_.vertices[v];
    }
    return found;
  }

  // Made as it is wanted the part would be nearer to its shape.
  void refuse_worse(const Rest& left) const {
    if (left.largest < largest_) return;
    throw DivergedError(fmt::format(
        "no part was found that becomes this shape: {} remain at {}, and {} where PART is made as it is; use "
        "smaller loads, or a smaller --size{}",
        human_length(left.largest), place(left.at), human_length(largest_), other_model()));
  }

  [[nodiscard]] std::string other_model() const {
    return job_.voxelize.moments ? "" : ", or --model quadratic";
  }

  void refuse_folded() const {
    for (std::size_t p = 0; p < wanted_.polygon_count(); ++p) {
      const Vec3 is = area_vector(wanted_.vertices, wanted_.polygon(p)),
                 made = area_vector(made_, wanted_.polygon(p));
      if (made.allFinite() && made.dot(is) >= kLeastFacing * made.norm() * is.norm()) continue;
      throw InputError(fmt::format("no part can be made that becomes this shape: it would fold at {}",
                                   place(wanted_.vertices[wanted_.polygon(p)[0]])));
    }
  }

  const CompensateArguments& arguments_;
  Job job_;
  Progress& progress_;
  static constexpr const char* kProgram = "flexel";
  Progress quiet_{kProgram, Progress::Mode::quiet};
  std::vector<std::string> warnings_;  // of the last run
  bool reported_ = false;
  Surface wanted_;
  std::vector<Vec3> made_, moved_;  // (vertices x 3) m: where they are made; how far the scene moves them
  Body body_, lattice_, field_;  // of the last run; of the shape wanted, and of the part as made, at the end
  mapping::MapResult last_;
  double largest_ = 0;  // m
  int iterations_ = 0;
  Rest check_;
};

std::vector<Output> plan_outputs(const CompensateArguments& arguments) {
  if (arguments.outputs.empty()) throw InputError("-o is missing: where the part to be made goes");
  std::vector<Output> outputs;
  std::vector<OutputName> names;
  bool cad = false;
  for (const std::string& path : arguments.outputs) {
    if (means_stdout(path))
      throw InputError(
          fmt::format("-o {}: compensate writes files, not to stdout: name one, such as make.stl", path));
    Output output{path, std::nullopt};
    if (extension(path) != "vtu") {
      output.surface = mapping::map_output("", path, arguments.map.ascii, 0, 1, false);
      cad = cad || is_cad(*output.surface);
    }
    outputs.push_back(output);
    names.push_back({path});
  }
  check_cad_output(arguments.map, {}, cad);
  names.push_back({arguments.summary});
  if (arguments.json) names.push_back({"-"});
  std::vector<std::string> inputs = arguments.job.parts;
  inputs.push_back(arguments.job.scene);
  check_outputs(names, inputs, arguments.job.force);
  return outputs;
}

void refuse_uncompensated(const simulate::Scene& scene) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(scene.name, "compensation is for runs to equilibrium, and " + what);
  };
  if (scene.run.time) refuse("this scene is a timed run");
  if (!scene.get<simulate::Indenters>().indenters.empty())
    throw InputError(
        scene.name,
        "[[indenter]] pushes the part out of the shape that is wanted, whatever is made: leave it out");
  if (!settles(scene)) return;
  const auto& rigid = scene.get<simulate::RigidParts>();
  if (!rigid.parts.empty()) refuse("rigid parts come to rest by a run in time: leave them out");
  if (!rigid.manipulators.empty()) refuse("manipulators act by a run in time: leave them out");
  refuse("[contact] comes to rest by a run in time: leave it out");
}

}  // namespace

int compensate_command(int argc, char** argv) {
  CompensateArguments arguments;
  CommandLine app{"Finds the part to be made so that the scene bends it into the shape of PART.",
                  "flexel compensate"};
  declare_job(app, arguments.job);
  app.add_option("-o,--output", arguments.outputs,
                 "The part to be made (.stl, .obj, .step ...) or its body (.vtu); again for more")
      .type_name("FILE")
      .one_value_each();
  app.add_option("--summary", arguments.summary, "Write what remains as JSON, in m").type_name("FILE");
  app.add_flag("--json", arguments.json, "Print the summary as JSON to stdout (docs/reference/json.md)");
  app.add_flag("--ascii", arguments.map.ascii, "Write text where a format has both");
  add_threads_option(app, arguments.threads);
  app.add_flag("--quiet", arguments.quiet, "Say only warnings and errors");
  const StopEndsProcess nothing_is_left;
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  std::vector<Output> outputs;
  Job job;
  plan_after_files(arguments.job, [&] {
    outputs = plan_outputs(arguments);
    job = plan_job(arguments.job);
    refuse_uncompensated(job.scene);
  });
  const ThreadLimit limit(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  progress.stage("import");
  Surface wanted = read_parts(arguments.job.parts, job.import, progress);
  check_parts(job, wanted);
  Compensation compensation(arguments, std::move(job), progress);
  compensation.find(std::move(wanted));
  std::vector<std::string> paths{arguments.summary};
  for (const Output& output : outputs) paths.push_back(output.path);
  OutputsTogether together(std::move(paths));
  compensation.write(outputs);
  if (!arguments.summary.empty()) write_text(compensation.summary(), arguments.summary);
  together.appear();
  progress.finish();
  compensation.tell();
  if (arguments.json) write_text(compensation.summary(), "-");
  return kExitDone;
}

}  // namespace flexel::commands
