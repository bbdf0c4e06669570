// A tangent that leaves rigid motions free is singular: its preconditioner is that of K + s M, s far below all else.
#include "simulate/modes/cell_vibration.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/human.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/equilibrium/equilibrium_problem.h"
#include "simulate/equilibrium/newton.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/events/fused.h"
#include "simulate/linear/free_motions.h"
#include "simulate/linear/multigrid.h"
#include "simulate/linear/vector_products.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/masses.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/set_rest_shape.h"
#include "simulate/modes/what_acts.h"
#include "simulate/probes/report.h"

namespace flexel::simulate {
namespace {

// A matrix with more on its diagonal.
class HeldSoftly final : public LinearOperator {
 public:
  // (rows) `more` N/m. Keeps references.
  HeldSoftly(const LinearOperator& matrix, const std::vector<double>& more) : matrix_(matrix), more_(more) {}
  [[nodiscard]] std::span<const std::uint64_t> row_offsets() const override { return matrix_.row_offsets(); }
  [[nodiscard]] std::span<const std::uint32_t> columns() const override { return matrix_.columns(); }
  void multiply(const double* x, double* y) const override {
    matrix_.multiply(x, y);
    for (std::size_t i = 0; i < 3 * more_.size(); ++i) y[i] += more_[i / 3] * x[i];
  }
  [[nodiscard]] const Block* blocks(std::size_t begin, std::size_t end,
                                    std::vector<Block>& room) const override {
    thread_local std::vector<Block> inner;
    const Block* from = matrix_.blocks(begin, end, inner);
    const std::uint64_t first = row_offsets()[begin], last = row_offsets()[end];
    room.assign(from, from + (last - first));
    for (std::size_t row = begin; row < end; ++row)
      for (std::uint64_t q = row_offsets()[row]; q < row_offsets()[row + 1]; ++q)
        if (columns()[q] == row) room[q - first].diagonal().array() += more_[row];
    return room.data();
  }
  [[nodiscard]] std::vector<Block> diagonal() const override {
    std::vector<Block> blocks = matrix_.diagonal();
    for (std::size_t row = 0; row < blocks.size(); ++row) blocks[row].diagonal().array() += more_[row];
    return blocks;
  }

 private:
  const LinearOperator& matrix_;
  const std::vector<double>& more_;
};

// Frequencies have no error bars, which would tell.
void warn_of_thin_walls(const Body& body, const std::string& scene, Progress& progress) {
  constexpr double kMuch = 0.2;
  if (const double thin = share_of_thin_walls(body, 2); thin > kMuch)
    progress.warn(
        fmt::format("{}: {} of the matter lies in walls under 2 cells, which these cells twist too hard, and "
                    "where the surface cuts them bend too hard or too easily: frequencies may be far off; "
                    "use a smaller spacing, or model = \"quadratic\" on a body of flexel-voxelize --moments",
                    scene, human_share(thin)));
}

class CellVibration final : public VibratingBody {
 public:
  CellVibration(const Body& body, const Scene& scene)
      : body_(body),
        fragments_(find_fragments(body)),
        problem_(equilibrium_problem(body, scene, fragments_, unsupported_)) {}

  void prepare(const Scene& scene, const SimulateOptions& options, SimulateResult& result,
               Progress& progress);

  [[nodiscard]] const VibratingNodes& nodes() const override { return nodes_; }
  [[nodiscard]] Pencil pencil() const override;
  void inertia(const double* x, double* y) const override {
    for (std::size_t i = 0; i < 3 * mass_.size(); ++i) y[i] = mass_[i / 3] * x[i];
  }
  [[nodiscard]] State show(const Eigen::VectorXd& shape, Body& body) const override;
  [[nodiscard]] bool prestressed() const override { return prestressed_; }

 private:
  void clear_held(double* y) const {
    for (std::size_t e = 0; e < nodes_.held.size(); ++e)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (nodes_.held[e] >> axis & 1) y[3 * e + axis] = 0;
  }

  const Body& body_;
  Fragments fragments_;
  std::size_t unsupported_ = 0;  // elements that no connection holds
  Problem problem_;
  std::unique_ptr<Mechanics> mechanics_;
  State state_;
  VibratingNodes nodes_;
  std::vector<double> mass_, softly_;  // (elements) kg, N/m
  std::unique_ptr<HeldSoftly> held_softly_;
  std::unique_ptr<Preconditioner> preconditioner_;
  bool prestressed_ = false;
};

void CellVibration::prepare(const Scene& scene, const SimulateOptions& options, SimulateResult& result,
                            Progress& progress) {
  if (std::find(problem_.models.begin(), problem_.models.end(), Model::paper) != problem_.models.end())
    throw InputError(scene.name, "model \"paper\" has no modes; use model \"cells\" or \"quadratic\"");
  report_materials(problem_, progress);
  std::vector<ActiveEffect> effects = active_effects(scene.effects, problem_);
  refuse_what_modes_lack(scene, effects);
  std::vector<FusedPoint> fused = fused_points(body_);
  prestressed_ = drives(effects) || RestShapes(body_).any() || !fused.empty();
  if (!fused.empty()) effects.push_back(activate(FusedPoints(body_, std::move(fused))));
  if (options.explain) report_effects(effects, "natural vibrations of the parts' models", true, progress);
  report_strays(fragments_, result, progress);
  warn_of_thin_walls(body_, scene.name, progress);
  mechanics_ = std::make_unique<Mechanics>(problem_, std::move(effects));
  state_.displacement.assign(body_.element_count(), Vec3::Zero());
  if (prestressed_) {
    refuse_loose_fragments(fragments_, body_, mechanics_->tied_elements(), mechanics_->coupled_elements(),
                           scene.name);
    refuse_free_motions(*mechanics_, state_, scene.name);
    if (RestShapes(body_).any())
      for (std::size_t e = 0; e < state_.displacement.size(); ++e)
        state_.displacement[e] = body_.position[e] - body_.rest[e];
    const EquilibriumResult found = find_equilibrium(*mechanics_, state_, scene.run, progress);
    if (found.buckled) refuse_buckled(scene.name);
    result.load_steps = found.load_steps;
    result.newton_iterations = found.newton_iterations;
    result.cg_iterations = found.cg_iterations;
    result.relative_residual = found.relative_residual;
  }
  mechanics_->assemble(state_);
  mechanics_->eliminate_prescribed();
  const LinearOperator& tangent = mechanics_->tangent();
  const NodeGeometry geometry = node_geometry(body_, state_);
  nodes_.place = geometry.position;
  nodes_.held = mechanics_->constraints().mask;
  if (!prestressed_) nodes_.rigid = free_motions(tangent, geometry).size();
  DisjointSets groups(tangent.rows());
  for (std::uint32_t row = 0; row < tangent.rows(); ++row)
    for (std::uint64_t q = tangent.row_offsets()[row]; q < tangent.row_offsets()[row + 1]; ++q)
      groups.unite(row, tangent.columns()[q]);
  nodes_.group = groups.numbered();
  mass_ = lumped_masses(problem_);
  for (std::size_t e = 0; e < mass_.size(); ++e)
    if (!(mass_[e] > 0)) nodes_.held[e] = 7;  // of loose crumbs
  if (nodes_.rigid > 0) {
    const double soft = kSoftHold * largest_eigenvalue(problem_);
    for (const double mass : mass_) softly_.push_back(soft * mass);
    held_softly_ = std::make_unique<HeldSoftly>(tangent, softly_);
  }
  preconditioner_ = aggregation_multigrid(
      held_softly_ ? static_cast<const LinearOperator&>(*held_softly_) : tangent, geometry);
}

Pencil CellVibration::pencil() const {
  Pencil made;
  made.size = static_cast<Eigen::Index>(3 * mass_.size());
  made.a = [this](const double* x, double* y) {
    mechanics_->tangent().multiply(x, y);
    clear_held(y);
  };
  made.b = [this](const double* x, double* y) {
    inertia(x, y);
    clear_held(y);
  };
  made.precondition = [this](const double* x, double* y) {
    std::vector<Vec3> from(mass_.size()), to;
    std::copy_n(x, 3 * from.size(), from[0].data());
    preconditioner_->apply(from, to);
    std::copy_n(to[0].data(), 3 * to.size(), y);
    clear_held(y);
  };
  made.rounding = kRoundedEigenvalue * largest_eigenvalue(problem_);
  return made;
}

State CellVibration::show(const Eigen::VectorXd& shape, Body& body) const {
  State state = state_;
  for (std::size_t e = 0; e < state.displacement.size(); ++e)
    state.displacement[e] += shape.segment<3>(static_cast<Eigen::Index>(3 * e));
  show_elements(fragments_, problem_, mechanics_->stencil(), state, body);
  return state;
}

}  // namespace

std::unique_ptr<VibratingBody> cell_vibration(const Body& body, const Scene& scene,
                                              const SimulateOptions& options, SimulateResult& result,
                                              Progress& progress) {
  auto made = std::make_unique<CellVibration>(body, scene);
  made->prepare(scene, options, result, progress);
  return made;
}

}  // namespace flexel::simulate
