// Starting columns are rigid motions, which are exact where they are free, and one step of inverse iteration from noise, which
// has a share of every shape.
#include "simulate/modes/modes_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

#include "base/error.h"
#include "base/stop.h"
#include "formats/lattice/quadratic_field.h"
#include "simulate/modes/cell_vibration.h"
#include "simulate/modes/quadratic_vibration.h"
#include "simulate/modes/what_acts.h"
#include "simulate/probes/probes.h"
#include "simulate/probes/report.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/time/series.h"

namespace flexel::simulate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kShown = 0.05;         // of the part's extent, that shapes go at most where they are written
constexpr std::size_t kMostPieces = 8;  // that may be loose
constexpr Index kLeastGuard = 4;        // columns beside those that are wanted
constexpr int kMostOfBuckling = 100;    // iterations: under loads that pull they do not end
constexpr double kNegative = 1e-6;      // of the largest eigenvalue found
constexpr double kNotRigid = 1e-6;      // likewise, of one that should be 0

// Six motions of each group of nodes.
MatrixXd rigid_motions(const VibratingNodes& nodes, const std::string& scene) {
  const std::size_t n = nodes.place.size();
  std::vector<std::size_t> members(nodes.group.empty() ? 0 : n, 0);
  for (std::size_t i = 0; i < n; ++i)
    if (nodes.held[i] != 7) ++members[nodes.group[i]];
  std::vector<std::uint32_t> pieces;
  for (std::uint32_t g = 0; g < members.size(); ++g)
    if (members[g] > 1) pieces.push_back(g);
  if (pieces.size() > kMostPieces)
    throw InputError(scene,
                     fmt::format("the parts hang in {} loose pieces, and modes are of {} at most: hold them, "
                                 "or simulate them by themselves",
                                 pieces.size(), kMostPieces));
  MatrixXd made = MatrixXd::Zero(static_cast<Index>(3 * n), static_cast<Index>(6 * pieces.size()));
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    Vec3 middle = Vec3::Zero();
    for (std::size_t i = 0; i < n; ++i)
      if (nodes.group[i] == pieces[p] && nodes.held[i] != 7) middle += nodes.place[i];
    middle /= static_cast<double>(members[pieces[p]]);
    for (std::size_t i = 0; i < n; ++i)
      for (int axis = 0; axis < 3 && nodes.group[i] == pieces[p]; ++axis) {
        const Index row = static_cast<Index>(3 * i), column = static_cast<Index>(6 * p) + axis;
        made(row + axis, column) = 1;
        made.block<3, 1>(row, column + 3) = Vec3::Unit(axis).cross(nodes.place[i] - middle);
      }
  }
  return made;
}

void clear_held(const VibratingNodes& nodes, MatrixXd& columns) {
  for (std::size_t i = 0; i < nodes.held.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (nodes.held[i] >> axis & 1) columns.row(static_cast<Index>(3 * i) + axis).setZero();
}

// Orthonormal in B, one after the other.
void orthonormalise(const Pencil& pencil, MatrixXd& columns) {
  VectorXd image(columns.rows());
  for (Index j = 0; j < columns.cols(); ++j)
    for (int time = 0; time < 2; ++time) {
      pencil.b(columns.col(j).data(), image.data());
      for (Index k = 0; k < j; ++k) columns.col(j) -= columns.col(k).dot(image) * columns.col(k);
      pencil.b(columns.col(j).data(), image.data());
      const double length = columns.col(j).dot(image);
      columns.col(j) *= length > 0 ? 1 / std::sqrt(length) : 0;
    }
}

MatrixXd starting_columns(const VibratingBody& body, const Pencil& pencil, Index wanted,
                          const std::string& scene) {
  const VibratingNodes& nodes = body.nodes();
  MatrixXd rigid(pencil.size, 0);
  if (nodes.rigid > 0) {
    rigid = rigid_motions(nodes, scene);
    clear_held(nodes, rigid);
    orthonormalise(pencil, rigid);
  }
  const Index more = std::min(wanted + std::max(kLeastGuard, wanted / 4),
                              std::max<Index>(1, static_cast<Index>(nodes.freedoms()) - rigid.cols()));
  MatrixXd made(pencil.size, rigid.cols() + more);
  made.leftCols(rigid.cols()) = rigid;
  std::mt19937_64 random(1);
  MatrixXd noise(pencil.size, 1);
  VectorXd image(pencil.size);
  for (Index j = 0; j < more; ++j) {
    for (double& value : noise.col(0)) value = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
    clear_held(nodes, noise);
    pencil.b(noise.data(), image.data());
    // what pushes rigid motions would drown the rest
    noise.col(0) -= rigid * (rigid.transpose() * image);
    pencil.b(noise.data(), image.data());
    pencil.precondition(image.data(), made.col(rigid.cols() + j).data());
  }
  return made;
}

[[noreturn]] void refuse_stout(const std::string& scene) {
  throw InputError(
      scene, "nothing buckles under these loads: they pull, or matter would be strained by a third before");
}

Eigenpairs find(VibratingBody& body, const Scene& scene, Progress& progress) {
  const bool buckling = scene.run.buckling.has_value();
  const auto wanted = static_cast<Index>(buckling ? *scene.run.buckling : *scene.run.modes);
  for (;;) {
    const VibratingNodes& nodes = body.nodes();
    const auto rigid = static_cast<Index>(nodes.rigid);
    if (wanted + rigid > static_cast<Index>(nodes.freedoms()))
      throw InputError(
          scene.name,
          fmt::format("[run] {} = {} is more than the body has: {} nodes move in {} ways{}",
                      buckling ? "buckling" : "modes", wanted, nodes.place.size(), nodes.freedoms(),
                      rigid > 0 ? fmt::format(", {} of them as a rigid body", rigid) : ""));
    const Pencil pencil = body.pencil();
    EigenOptions options;
    options.wanted = wanted + rigid;
    if (buckling) options.most_iterations = kMostOfBuckling;
    const Eigenpairs found = lowest_eigenpairs(
        pencil, starting_columns(body, pencil, wanted, scene.name), options, [&](int iteration, Index done) {
          check_stop();
          progress.update(static_cast<double>(done) / static_cast<double>(options.wanted),
                          fmt::format("iteration {}, {} of {} modes", iteration, done, options.wanted));
        });
    const double largest = found.values.size() > 0 ? found.values.cwiseAbs().maxCoeff() : 0;
    if (!buckling && found.values.size() > 0 && found.values[0] < -kNegative * largest) {
      if (body.hold_harder()) continue;
      if (body.prestressed()) refuse_buckled(scene.name);
      throw DivergedError(scene.name +
                          ": the stiffness is not positive; use a smaller --size, or model \"cells\"");
    }
    if (buckling && largest > 0 && found.values[0] > -pencil.rounding) refuse_stout(scene.name);
    if (!found.converged || found.values.size() < options.wanted || !found.vectors.allFinite())
      throw DivergedError(fmt::format("{}: {} did not converge within {} iterations; use a smaller --size",
                                      scene.name, buckling ? "buckling" : "modes", found.iterations));
    if (!buckling && rigid > 0 && found.values[rigid - 1] > kNotRigid * largest)
      throw DivergedError(
          fmt::format("{}: {} rigid motions are free, and not as many modes are at 0 Hz; use a smaller "
                      "--size",
                      scene.name, rigid));
    return found;
  }
}

// kg, of each world axis: (phi . M e)^2, phi normal in mass.
Vec3 effective_mass(const VibratingBody& body, const VectorXd& shape) {
  Vec3 mass;
  VectorXd image(shape.size()), along(shape.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (Index i = 0; i < along.size(); ++i) along[i] = i % 3 == axis ? 1 : 0;
    body.inertia(along.data(), image.data());
    const double share = shape.dot(image);
    mass[axis] = share * share;
  }
  return mass;
}

// As far as it is shown, its largest component positive: an eigenvector has neither length nor sign.
VectorXd shown(const VectorXd& shape, double reach) {
  Index largest = 0;
  shape.cwiseAbs().maxCoeff(&largest);
  double most = 0;
  for (Index i = 0; i < shape.size(); i += 3) most = std::max(most, shape.segment<3>(i).norm());
  return shape * ((shape[largest] < 0 ? -reach : reach) / (most > 0 ? most : 1));
}

// m, of a probe, in the field between elements where the body has one.
Vec3 measure_there(const ProbePoints& probe, const Body& body, const State& state) {
  if (!probe.cell || !QuadraticField::is_in(body)) return measure(probe, state).displacement;
  const Part& part = body.parts[cell_parts(body)[*probe.cell]];
  return QuadraticField(body, state.displacement)
      .displacement(*probe.cell, cell_coordinates(body, part, *probe.cell, probe.where));
}

// The shapes one by one: figures, and a frame of the series for each. Leaves the body in the first.
void tell(const VibratingBody& vibrating, const Eigenpairs& found, const SimulateOptions& options,
          const std::vector<ProbePoints>& probes, Body& body, ModesSummary& summary) {
  std::optional<Series> series;
  if (!options.series.empty()) series.emplace(options.series, options.compress);
  std::vector<Vec3> still;
  {
    const State state = vibrating.show(VectorXd::Zero(found.vectors.rows()), body);
    for (const ProbePoints& probe : probes) still.push_back(measure_there(probe, body, state));
  }
  for (auto j = static_cast<Index>(summary.rigid); j < found.values.size(); ++j) {
    check_stop();
    if (summary.buckling && !(found.values[j] < -vibrating.pencil().rounding)) break;
    Mode mode;
    if (summary.buckling)
      mode.load_factor = -1 / found.values[j];
    else
      mode.frequency = std::sqrt(found.values[j]) / (2 * std::numbers::pi);
    mode.error = found.errors[j] * found.errors[j] / (summary.buckling ? 1 : 2);
    if (!summary.buckling) mode.effective_mass = effective_mass(vibrating, found.vectors.col(j));
    const VectorXd shape = shown(found.vectors.col(j), summary.shape);
    const State state = vibrating.show(shape, body);
    for (std::size_t p = 0; p < probes.size(); ++p)
      mode.probes.push_back(measure_there(probes[p], body, state) - still[p]);
    summary.modes.push_back(mode);
    if (series) series->add(body, static_cast<double>(summary.modes.size()));
  }
  (void)vibrating.show(shown(found.vectors.col(static_cast<Index>(summary.rigid)), summary.shape), body);
}

void refuse_outputs(const Scene& scene, const SimulateOptions& options) {
  const char* what = scene.run.buckling ? "buckling" : "modes";
  const auto refuse = [&](const char* option) {
    throw InputError(scene.name, fmt::format("{} is for timed runs: [run] {} has none", option, what));
  };
  if (!options.history.empty()) refuse("--history");
  if (!options.live.empty()) refuse("--live");
  if (!options.checkpoint.empty()) refuse("--checkpoint");
  if (!options.isa.empty()) refuse("--isa");
  if (options.on_frame)
    throw InputError(scene.name, fmt::format("frames are of timed runs: [run] {} has none", what));
}

}  // namespace

SimulateResult run_modes(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress) {
  const auto began = std::chrono::steady_clock::now();
  refuse_outputs(scene, options);
  SimulateResult result;
  const bool quadratic = is_quadratic(scene, body);
  if (scene.run.buckling && !quadratic)
    throw InputError(scene.name, "[run] buckling needs model \"quadratic\" (flexel-voxelize --moments)");
  if (!quadratic) body.cell_columns.erase(kQuadraticColumn);
  const Problem problem{body, materials_of_parts(scene, body),
                        std::vector<std::uint8_t>(body.cell_count(), 0), models_of_parts(scene, body)};
  const std::vector<ProbePoints> probes = place_probes(scene, problem);
  const std::unique_ptr<VibratingBody> vibrating =
      quadratic ? quadratic_vibration(body, scene, options, result, progress)
                : cell_vibration(body, scene, options, result, progress);
  const Eigenpairs found = find(*vibrating, scene, progress);
  name_materials(body, problem.materials);
  ModesSummary& summary = result.modes.emplace();
  summary.rigid = vibrating->nodes().rigid;
  summary.shape = kShown * body_extent(body);
  summary.iterations = found.iterations;
  summary.buckling = scene.run.buckling.has_value();
  summary.prestressed = vibrating->prestressed() && !summary.buckling;
  tell(*vibrating, found, options, probes, body, summary);
  result.mass = mass_of(problem);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

}  // namespace flexel::simulate
