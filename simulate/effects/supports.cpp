// Supports: penalty matrices per tied cell or element, and elements that are followed exactly. Tied ones are few
// (a layer under a surface), so their sums run on one thread in a fixed order.
#include "simulate/effects/supports.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/matter/load_distribution.h"
#include "simulate/matter/masses.h"
#include "simulate/matter/surface_points.h"
#include "simulate/models/stability.h"

namespace flexel::simulate {
namespace {

bool share_an_axis(const Tie& a, const Tie& b) {
  return (a.axes[0] && b.axes[0]) || (a.axes[1] && b.axes[1]) || (a.axes[2] && b.axes[2]);
}

bool same_motion(const Tie& one, const Tie& other) {
  const Motion &a = one.motion, &b = other.motion;
  return !one.link && !other.link && a.translation == b.translation && a.angle == b.angle &&
         (a.angle == 0 || (a.axis == b.axis && a.through == b.through && a.arc_from == b.arc_from));
}

bool intersect(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  for (auto x = a.begin(), y = b.begin(); x != a.end() && y != b.end();) {
    if (*x == *y) return true;
    *x < *y ? ++x : ++y;
  }
  return false;
}

void refuse_conflicts(const std::vector<Tie>& ties, const std::vector<Selected>& selected) {
  for (std::size_t i = 0; i < ties.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      if (!share_an_axis(ties[i], ties[j]) || same_motion(ties[i], ties[j])) continue;
      const bool meet = intersect(selected[i].polygons, selected[j].polygons) ||
                        intersect(selected[i].elements, selected[j].elements);
      if (over_pieces(meet ? 1 : 0) > 0)
        throw InputError(ties[i].origin,
                         fmt::format("\"{}\" and \"{}\" ({}) lead the same place to different positions",
                                     ties[i].name, ties[j].name, ties[j].origin));
    }
}

// A point on a cell's face has its weight on the four elements there.
constexpr double kOffFace = 1e-6;
bool lies_on_face(const InterpolationWeights& at) {
  return std::count_if(at.weights.begin(), at.weights.begin() + at.count,
                       [](double w) { return std::abs(w) > kOffFace; }) <= 4;
}

}  // namespace

std::optional<Supports> Supports::make(const Parameters& parameters, const Problem& problem) {
  if (parameters.ties.empty()) return std::nullopt;
  Supports made;
  made.body_ = &problem.body;
  made.start_ = problem.settled;
  made.ties_ = parameters.ties;
  if (problem.duration)
    for (Tie& tie : made.ties_)
      if (tie.is_move && tie.course.time.empty()) tie.course = {{0, *problem.duration}, {0, 1}};
  made.held_elements_.resize(made.ties_.size());
  std::vector<Selected> selected;
  for (const Tie& tie : made.ties_) selected.push_back(resolve(tie.where, problem.body));
  refuse_conflicts(made.ties_, selected);
  for (std::uint32_t t = 0; t < made.ties_.size(); ++t) {
    if (made.ties_[t].link) made.make_link(made.ties_[t], selected[t], problem);
    if (!selected[t].polygons.empty()) made.add_surface_tie(t, selected[t].polygons, problem);
    made.hold(t, selected[t].elements);
  }
  return made;
}

// Adds to the elements that a tie is followed by. A link leaves those to the others that they hold already.
void Supports::hold(std::uint32_t tie, const std::vector<std::uint32_t>& elements) {
  std::vector<std::uint32_t>& held = held_elements_[tie];
  held.insert(held.end(), elements.begin(), elements.end());
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  if (!ties_[tie].link) return;
  for (std::size_t other = 0; other < tie; ++other)
    std::erase_if(held, [&](std::uint32_t e) {
      return std::binary_search(held_elements_[other].begin(), held_elements_[other].end(), e);
    });
}

// The middle and the extent of what the link holds, from its points of the surface or its elements' matter.
void Supports::make_link(Tie& tie, const Selected& selected, const Problem& problem) const {
  if (problem.duration)
    throw InputError(tie.origin,
                     fmt::format("load \"{}\": a rigid link needs equilibrium without contact; in time make "
                                 "the loaded matter a part with rigid = true, or use link = \"averaging\"",
                                 tie.name));
  std::vector<LoadedPoint> points;
  if (!selected.polygons.empty())
    for (const SurfacePoint& point : gathered_surface_points(problem, selected.polygons))
      points.push_back({point.position, point.area_vector.norm()});
  if (!selected.elements.empty()) {
    const std::vector<double> volume = element_volumes(problem);
    for (const std::uint32_t e : selected.elements)
      points.push_back({problem.body.rest[e], std::cbrt(volume[e] * volume[e])});
  }
  double total = 0, squared = 0;
  const auto link = std::make_shared<RigidLink>();
  for (const LoadedPoint& point : points) {
    total += point.weight;
    link->middle += point.weight * point.position;
  }
  if (!(total > 0))
    throw InputError(tie.origin,
                     fmt::format("load \"{}\": no matter lies under what is selected; use a smaller spacing, "
                                 "or another face where this one is of a crumb that hangs on nothing",
                                 tie.name));
  link->middle /= total;
  for (const LoadedPoint& point : points)
    squared += point.weight * (point.position - link->middle).squaredNorm();
  link->reach = std::sqrt(squared / total);
  if (!(link->reach > 1e-9 * bounding_box(problem.body.rest).diagonal()))
    throw InputError(tie.origin,
                     fmt::format("load \"{}\": a rigid link needs more than one element", tie.name));
  link->at = tie.link->at.value_or(link->middle);
  link->force = tie.link->force;
  link->torque = tie.link->torque;
  link->follower = tie.link->follower;
  link->name = tie.name;
  link->origin = tie.origin;
  tie.motion.link = link;
}

void Supports::add_surface_tie(std::uint32_t tie, const std::vector<std::uint32_t>& polygons,
                               const Problem& problem) {
  const std::vector<SurfacePoint> points = shared_evenly(problem, surface_points(problem, polygons));
  if (!(over_pieces(total_area(points)) > 0))
    throw InputError(ties_[tie].origin,
                     fmt::format("\"{}\": no matter lies under the selected surface; use a smaller spacing, "
                                 "or another face where this one is of a crumb that hangs on nothing",
                                 ties_[tie].name));
  using Matrix = decltype(TiedElements::stiffness);
  std::map<std::array<std::uint32_t, 8>, TiedElements> by_elements;
  const std::size_t first = tied_.size();
  const ChangeAround stiffer(problem.body, "stiffness_change");
  for (const SurfacePoint& point : points) {
    if ((problem.duration || ties_[tie].link) && lies_on_face(point.at)) {
      for (std::size_t a = 0; a < point.at.count; ++a)
        if (point.at.weights[a] > kOffFace) held_elements_[tie].push_back(point.at.elements[a]);
      continue;
    }
    const std::uint32_t part = problem.body.surface.polygon_part(point.polygon);
    const double stiffness = kPenalty * stiffer.at(point.at) * problem.materials[part].young /
                             problem.body.parts[part].lattice.spacing.mean() * point.area_vector.norm();
    const auto count = static_cast<Eigen::Index>(point.at.count);
    const Eigen::Map<const Eigen::VectorXd> weights(point.at.weights.data(), count);
    auto [entry, fresh] = by_elements.try_emplace(
        point.at.elements, TiedElements{tie, point.at.count, point.at.elements, Matrix::Zero(count, count)});
    entry->second.stiffness += stiffness * weights * weights.transpose();
  }
  for (const auto& [elements, tied] : by_elements) tied_.push_back(tied);
  if (problem.duration) soften(first, problem);
}

// Lowers the matrices from `first` on so that at no element their rows together are stiffer than omega^2 of
// its part times its mass.
void Supports::soften(std::size_t first, const Problem& problem) {
  const std::vector<double> omega2 = cell_frequencies(problem);
  const std::vector<double> mass = lumped_masses(problem);
  const std::vector<std::uint32_t> part = element_parts(problem.body);
  const QuickerByEdits quicker(problem.body);
  std::map<std::uint32_t, int> sharers;
  for (std::size_t i = first; i < tied_.size(); ++i)
    for (std::size_t a = 0; a < tied_[i].count; ++a) ++sharers[tied_[i].elements[a]];
  for (std::size_t i = first; i < tied_.size(); ++i) {
    double scale = 1;
    for (std::size_t a = 0; a < tied_[i].count; ++a) {
      const std::uint32_t e = tied_[i].elements[a];
      const double row = tied_[i].stiffness.row(static_cast<Eigen::Index>(a)).cwiseAbs().sum();
      if (row > 0) scale = std::min(scale, quicker(e) * omega2[part[e]] * mass[e] / (sharers[e] * row));
    }
    tied_[i].stiffness *= scale;
  }
}

double Supports::added_frequency(const State&, const std::vector<double>& mass) {
  if (added_frequency_) return *added_frequency_;
  std::map<std::uint32_t, double> row_sum;
  for (const TiedElements& tied : tied_)
    for (std::size_t a = 0; a < tied.count; ++a)
      row_sum[tied.elements[a]] += tied.stiffness.row(static_cast<Eigen::Index>(a)).cwiseAbs().sum();
  double largest = 0;
  for (const auto& [e, sum] : row_sum) largest = std::max(largest, sum / mass[e]);
  added_frequency_ = largest;
  return largest;
}

double Supports::factor(const Tie& tie, const State& state) const {
  return tie.is_move ? tie.course.at(state) : state.share;
}

bool Supports::drives() const {
  return std::any_of(ties_.begin(), ties_.end(), [](const Tie& tie) { return tie.is_move || tie.link; });
}

std::string Supports::why() const {
  const auto moves = std::count_if(ties_.begin(), ties_.end(), [](const Tie& tie) { return tie.is_move; });
  const auto links =
      std::count_if(ties_.begin(), ties_.end(), [](const Tie& tie) { return tie.link.has_value(); });
  const std::string rigid = links > 0 ? fmt::format(", {} rigid link(s)", links) : "";
  return fmt::format("{} [[fix]], {} [[move]]{}", static_cast<std::ptrdiff_t>(ties_.size()) - moves - links,
                     moves, rigid);
}

// u_a - d(X_a) on the tied axes, 0 on the others. (count x 3) m
Supports::Displacements Supports::violation(const TiedElements& tied, const State& state) const {
  const Tie& tie = ties_[tied.tie];
  Displacements result(tied.count, 3);
  for (std::size_t a = 0; a < tied.count; ++a) {
    const std::uint32_t e = tied.elements[a];
    const Vec3 start = start_.empty() ? Vec3(Vec3::Zero()) : start_[e];
    const Vec3 off =
        state.displacement[e] - start - tie.motion.displacement(body_->rest[e] + start, factor(tie, state));
    for (std::size_t axis = 0; axis < 3; ++axis)
      result(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(axis)) =
          tie.axes[axis] ? off[static_cast<Eigen::Index>(axis)] : 0;
  }
  return result;
}

double Supports::energy(const State& state) {
  double energy = 0;
  for (const TiedElements& tied : tied_) {
    const Displacements off = violation(tied, state);
    energy += 0.5 * (off.transpose() * tied.stiffness * off).trace();
  }
  return energy;
}

void Supports::add_forces(const State& state, std::vector<Vec3>& forces) {
  for (const TiedElements& tied : tied_) {
    const Displacements force = tied.stiffness * violation(tied, state);
    for (std::size_t a = 0; a < tied.count; ++a)
      forces[tied.elements[a]] -= force.row(static_cast<Eigen::Index>(a)).transpose();
  }
}

void Supports::add_stiffness(const State&, BlockMatrix& matrix) {
  for (const TiedElements& tied : tied_)
    for (std::size_t a = 0; a < tied.count; ++a)
      for (std::size_t b = 0; b < tied.count; ++b) {
        Block& block = matrix.values[position_of(matrix, tied.elements[a], tied.elements[b])];
        for (int axis = 0; axis < 3; ++axis)
          if (ties_[tied.tie].axes[static_cast<std::size_t>(axis)])
            block(axis, axis) += tied.stiffness(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      }
}

void Supports::constrain(Constraints& constraints) {
  constraints.start = start_;
  if (constraints.mask.empty()) {  // a timed run, where nothing else holds elements
    constraints.mask.assign(body_->element_count(), 0);
    constraints.motion.assign(body_->element_count(), {0, 0, 0});
  }
  for (std::size_t t = 0; t < ties_.size(); ++t) {
    const auto motion = static_cast<std::uint32_t>(constraints.motions.size());
    constraints.motions.push_back(ties_[t].motion);
    constraints.courses.push_back(ties_[t].course);
    for (const std::uint32_t e : held_elements_[t])
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (ties_[t].axes[axis]) {
          constraints.mask[e] = static_cast<std::uint8_t>(constraints.mask[e] | 1u << axis);
          constraints.motion[e][axis] = motion;
        }
  }
}

std::vector<Reaction> Supports::reactions(const State& state, const std::vector<Vec3>& unbalanced) const {
  std::vector<Reaction> reaction;
  for (const Tie& tie : ties_)
    reaction.push_back({tie.name, Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), tie.is_move});
  std::vector<double> places(ties_.size(), 0);
  const auto add = [&](std::size_t tie, const Vec3& force, std::uint32_t e) {
    const Vec3 place = body_->rest[e] + state.displacement[e];
    add_at(force, place, reaction[tie].force, reaction[tie].moment);
    reaction[tie].middle += place;
    ++places[tie];
  };
  for (const TiedElements& tied : tied_) {
    const Displacements force = tied.stiffness * violation(tied, state);
    for (std::size_t a = 0; a < tied.count; ++a)
      add(tied.tie, -force.row(static_cast<Eigen::Index>(a)).transpose(), tied.elements[a]);
  }
  std::vector<std::uint8_t> counted(body_->element_count(),
                                    0);  // an element of two ties counts for the first
  for (std::size_t t = 0; t < ties_.size(); ++t)
    for (const std::uint32_t e : held_elements_[t]) {
      if (!counts_element(e)) continue;
      Vec3 held = Vec3::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!ties_[t].axes[axis] || (counted[e] >> axis & 1)) continue;
        counted[e] = static_cast<std::uint8_t>(counted[e] | 1u << axis);
        held[static_cast<Eigen::Index>(axis)] = -unbalanced[e][static_cast<Eigen::Index>(axis)];
      }
      add(t, held, e);
    }
  for (std::size_t t = 0; t < ties_.size(); ++t) {
    places[t] = over_pieces(places[t]);
    for (Vec3* each : {&reaction[t].force, &reaction[t].moment, &reaction[t].middle})
      *each = over_pieces(*each);
    if (places[t] > 0) reaction[t].middle /= places[t];
  }
  return reaction;
}

void Supports::report(const State& state, const std::vector<Vec3>& unbalanced, SimulateResult& result) {
  const std::vector<Reaction> reaction = reactions(state, unbalanced);
  for (std::size_t t = 0; t < ties_.size(); ++t) {
    if (!ties_[t].link) {
      result.reactions.push_back(reaction[t]);
      continue;
    }
    RigidLink& link = *ties_[t].motion.link;
    link.pull = reaction[t].force;
    link.pull_moment = reaction[t].moment - (link.middle + link.translation).cross(link.pull);
    const Vec3 moved = link.displacement(link.at), force = state.share * link.now(link.force);
    result.loads.push_back({ties_[t].name, force,
                            state.share * link.now(link.torque) + (link.at + moved).cross(force), moved,
                            link.turn, link.follower});
  }
}

std::vector<std::string> Supports::history_columns() const {
  std::vector<std::string> columns;
  for (const Tie& tie : ties_)
    for (const auto& [what, unit] : {std::pair{"force", "N"}, {"moment", "N m"}})
      for (const char axis : {'x', 'y', 'z'})
        columns.push_back(fmt::format("{} {} {} [{}]", tie.name, what, axis, unit));
  return columns;
}

std::vector<double> Supports::history_values(const State& state, const std::vector<Vec3>& unbalanced) {
  std::vector<double> values;
  for (const Reaction& reaction : reactions(state, unbalanced))
    for (const Vec3& each : {reaction.force, reaction.moment})
      values.insert(values.end(), each.begin(), each.end());
  return values;
}

}  // namespace flexel::simulate
