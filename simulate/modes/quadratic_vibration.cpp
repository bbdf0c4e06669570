// Components of nodes that a box holds are 0 throughout; faces are held by the stiffness itself (Nitsche).
#include "simulate/modes/quadratic_vibration.h"

#include <algorithm>
#include <optional>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/math/greatest.h"
#include "base/parallel.h"
#include "base/stop.h"
#include "simulate/linear/free_motions.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/masses.h"
#include "simulate/models/cells.h"
#include "simulate/models/stiffness.h"
#include "simulate/modes/quadratic_mass.h"
#include "simulate/modes/what_acts.h"
#include "simulate/probes/report.h"
#include "simulate/quadratic/corotation.h"
#include "simulate/quadratic/quadratic_run.h"
#include "simulate/quadratic/quadratic_solve.h"

namespace flexel::simulate {
namespace {

constexpr double kMostSafety = 64;     // of supports
constexpr double kMostStrained = 0.3;  // displacement gradient beyond which nothing is told of buckling
constexpr double kStressedAt =
    1e-4;  // displacement gradient at which stresses are taken: rotations are small there

class QuadraticVibration final : public VibratingBody {
 public:
  QuadraticVibration(const Body& body, const Scene& scene)
      : body_(body),
        scene_(scene),
        fragments_(find_fragments(body)),
        problem_{body,
                 materials_of_parts(scene, body),
                 stray_cells(fragments_),
                 models_of_parts(scene, body),
                 {},
                 {},
                 {},
                 {}} {}

  void prepare(const SimulateOptions& options, SimulateResult& result, Progress& progress);

  [[nodiscard]] const VibratingNodes& nodes() const override { return nodes_; }
  [[nodiscard]] Pencil pencil() const override;
  void inertia(const double* x, double* y) const override { mass_->multiply(x, y); }
  [[nodiscard]] State show(const Eigen::VectorXd& shape, Body& body) const override;
  [[nodiscard]] bool hold_harder() override;
  [[nodiscard]] bool prestressed() const override { return prestressed_; }

 private:
  void at_rest();
  void stressed(SimulateResult& result, Progress& progress);
  void take_stresses(SimulateResult& result, Progress& progress);
  void find_nodes();
  void clear_held(double* y) const {
    for (std::size_t n = 0; n < nodes_.held.size(); ++n)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (nodes_.held[n] >> axis & 1) y[3 * n + axis] = 0;
  }

  const Body& body_;
  const Scene& scene_;
  Fragments fragments_;
  Problem problem_;
  std::optional<QuadraticSystem> system_;
  std::optional<QuadraticMass> mass_;
  QuadraticSolution base_;
  std::optional<Corotation> corotation_;
  double stress_share_ = 1;  // of the stresses of all loads, that the corotation has
  VibratingNodes nodes_;
  bool prestressed_ = false;
};

void QuadraticVibration::prepare(const SimulateOptions& options, SimulateResult& result, Progress& progress) {
  report_materials(problem_, progress);
  const std::vector<ActiveEffect> effects = active_effects(scene_.effects, problem_);
  refuse_what_modes_lack(scene_, effects);
  refuse_what_quadratic_lacks(scene_, body_, effects);
  prestressed_ = drives(effects);
  if (options.explain)
    report_effects(effects, "natural vibrations of cells with quadratic shape functions", true, progress);
  report_strays(fragments_, result, progress);
  system_.emplace(problem_, scene_);
  for (const std::string& warning : system_->warnings()) progress.warn(warning);
  mass_.emplace(*system_);
  if (prestressed_)
    refuse_loose_fragments(fragments_, body_, system_->tied_elements(), system_->bonded_elements(),
                           scene_.name);
  if (scene_.run.buckling)
    take_stresses(result, progress);
  else if (prestressed_)
    stressed(result, progress);
  else
    at_rest();
  find_nodes();
}

void QuadraticVibration::at_rest() {
  base_.displacement.assign(system_->nodes().size(), Vec3::Zero());
  base_.tangent = std::make_unique<QuadraticTangent>(system_->stiffness(base_.safety));
  QuadraticTangent& tangent = *base_.tangent;
  tangent.multigrid.emplace(tangent.stiffness, body_, system_->bonds());
  nodes_.rigid = free_motions(tangent.multigrid->coarse(), tangent.multigrid->geometry()).size();
  if (nodes_.rigid == 0) return;
  std::vector<double> softly = lumped_masses(problem_);
  const double soft = kSoftHold * largest_eigenvalue(problem_);
  for (double& each : softly) each *= soft;
  tangent.multigrid.reset();
  tangent.multigrid.emplace(tangent.stiffness, body_, system_->bonds(), std::vector<Vec3>{}, softly);
}

void QuadraticVibration::stressed(SimulateResult& result, Progress& progress) {
  double seconds = 0;
  base_ = quadratic_equilibrium(*system_, scene_, seconds, progress);
  result.load_steps = std::max(base_.load_steps, 1);
  result.newton_iterations = base_.newton_iterations + 1;
  result.cg_iterations = base_.iterations;
  result.relative_residual = base_.relative_residual;
  if (base_.stable && !*base_.stable) refuse_buckled(scene_.name);
  QuadraticTangent& tangent = *base_.tangent;
  corotation_.emplace(*system_, tangent.stiffness, base_.safety);
  std::vector<Vec3> left;
  if (!corotation_->residual(base_.displacement, 1, left)) refuse_buckled(scene_.name);
  corotation_->set_tangent(true);
  tangent.multigrid.reset();
  tangent.multigrid.emplace(tangent.stiffness, body_, system_->bonds(), base_.displacement);
}

// At a share of the linear answer at which nothing turns to speak of: stresses are in proportion.
void QuadraticVibration::take_stresses(SimulateResult& result, Progress& progress) {
  base_ = solve(*system_, std::min(scene_.run.tolerance, 1e-6), base_.safety, scene_.name,
                [&](int iteration, double) {
                  check_stop();
                  progress.update(0, fmt::format("iteration {}", iteration));
                });
  result.load_steps = result.newton_iterations = 1;
  result.cg_iterations = base_.iterations;
  result.relative_residual = base_.relative_residual;
  const double steepest =
      parallel_sum<Greatest>(system_->nodes().cells.size(), [&](std::size_t c) {
        return Greatest{gradient_at(*system_, base_.displacement, c, system_->middle(c)).norm()};
      }).value;
  if (!(steepest > 0))
    throw InputError(scene_.name, "[run] buckling needs loads that stress the part: nothing does");
  stress_share_ = kStressedAt / steepest;
  std::vector<Vec3> small = base_.displacement, left;
  for (Vec3& each : small) each *= stress_share_;
  corotation_.emplace(*system_, base_.tangent->stiffness, base_.safety);
  if (!corotation_->residual(small, stress_share_, left)) refuse_buckled(scene_.name);
  base_.displacement.assign(small.size(), Vec3::Zero());  // shapes are shown from the part at rest
}

void QuadraticVibration::find_nodes() {
  const QuadraticNodes& nodes = system_->nodes();
  nodes_.place = nodes.rest;
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes_.place[n] += base_.displacement[n];
  nodes_.held = base_.tangent->stiffness.held();
  DisjointSets groups(nodes.size());
  for (const auto& cell : nodes.of_cell)
    for (const std::uint32_t node : cell) groups.unite(cell[0], node);
  for (const BondedCells& bond : system_->bonds())
    groups.unite(nodes.of_cell[bond.cell[0]][0], nodes.of_cell[bond.cell[1]][0]);
  nodes_.group = groups.numbered();
}

bool QuadraticVibration::hold_harder() {
  if (prestressed_ || base_.safety >= kMostSafety ||
      (system_->supports().empty() && system_->bonds().empty()))
    return false;
  base_.safety *= kMoreSafety;
  at_rest();
  return true;
}

Pencil QuadraticVibration::pencil() const {
  Pencil made;
  made.size = static_cast<Eigen::Index>(3 * nodes_.place.size());
  const LinearMap stiffness = [this](const double* x, double* y) {
    base_.tangent->stiffness.forces(x, y);
    clear_held(y);
  };
  const LinearMap mass = [this](const double* x, double* y) {
    mass_->multiply(x, y);
    clear_held(y);
  };
  const LinearMap stress = [this](const double* x, double* y) {
    corotation_->stress_forces(x, y);
    for (std::size_t i = 0; i < 3 * nodes_.place.size(); ++i) y[i] /= stress_share_;
    clear_held(y);
  };
  made.a = scene_.run.buckling ? stress : stiffness;
  made.b = scene_.run.buckling ? stiffness : mass;
  made.inverts_b = scene_.run.buckling.has_value();
  made.precondition = [this](const double* x, double* y) {
    std::vector<Vec3> from(nodes_.place.size()), to;
    std::copy_n(x, 3 * from.size(), from[0].data());
    base_.tangent->multigrid->apply(from, to);
    std::copy_n(to[0].data(), 3 * to.size(), y);
    clear_held(y);
  };
  made.rounding = made.inverts_b ? kStressedAt / stress_share_ / kMostStrained
                                 : kRoundedEigenvalue * largest_eigenvalue(problem_);
  return made;
}

State QuadraticVibration::show(const Eigen::VectorXd& shape, Body& body) const {
  QuadraticSolution moved;
  moved.displacement = base_.displacement;
  for (std::size_t n = 0; n < moved.displacement.size(); ++n)
    moved.displacement[n] += shape.segment<3>(static_cast<Eigen::Index>(3 * n));
  State state;
  state.displacement = element_displacement(*system_, moved);
  const StiffnessPattern pattern =
      stiffness_pattern(body_, active_cells(problem_), connection_rows({}, body_.element_count()), {}, false);
  show_elements(fragments_, problem_, pattern.stencil, state, body);
  write_field(system_->nodes(), moved, state, body);
  return state;
}

}  // namespace

std::unique_ptr<VibratingBody> quadratic_vibration(const Body& body, const Scene& scene,
                                                   const SimulateOptions& options, SimulateResult& result,
                                                   Progress& progress) {
  auto made = std::make_unique<QuadraticVibration>(body, scene);
  made->prepare(options, result, progress);
  return made;
}

}  // namespace flexel::simulate
