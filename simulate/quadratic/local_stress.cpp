// Elements of the whole are elements of every submodel around them, so what is found there is theirs.
#include "simulate/quadratic/local_stress.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/human.h"
#include "base/math/area_vector.h"
#include "base/math/dense.h"
#include "base/program/progress.h"
#include "base/resources.h"
#include "base/stop.h"
#include "simulate/estimate/stress_singularity.h"
#include "simulate/linear/conjugate_gradients.h"
#include "simulate/linear/vector_products.h"
#include "simulate/quadratic/quadratic_stress.h"
#include "simulate/quadratic/submodel.h"
#include "simulate/result/memory_limit.h"

namespace flexel::simulate {
namespace {

constexpr int kBoxReach = 2;           // cells of the parent that a box has on each side of the one looked at
constexpr int kRatio = 2;              // of the spacings
constexpr std::size_t kMostLooks = 6;  // at one place, each on cells half as large
constexpr std::size_t kMostPlaces = 8;
constexpr double kLeastBar = 0.015;     // share: of what facets of the surface make of it
constexpr double kBelowLargest = 1e-9;  // share: below the largest, so that its place is the one
constexpr double kMostGrowth = 2.4;     // of a stress on cells half as large: no notch or edge has more
constexpr double kClear = kBesideInField + 1;  // spacings: a support is told by the far side of its cells
constexpr double kNarrow = 0.01;               // share: a bar that needs no further look
constexpr double kDoubts = 1.5;                // times a doubt: what field_stress_bar() takes it for
constexpr double kGrowsOn =
    0.7;  // of the last difference but one: values that come to a limit differ by less
constexpr double kLeastFacetTurn = 0.0175;  // rad, between facets of a notch: less is a flat face
constexpr double kLeastFacetWidth = 1e-3;   // spacings, of such facets: less is a sliver of the tessellation
constexpr double kSeen = 4;                 // cells: the radius of a notch whose peak the whole's cells have
constexpr double kSameRadius = 0.2;         // share: notches that coarse cells see alike,
constexpr double kLieOtherwise = 0.3;       // share: but for how they lie among the cells
constexpr double kResolved = 3;             // cells that a notch's radius has where its peak is seen
constexpr double kShareOfTime = 0.5;        // of what a time limit leaves
constexpr int kMostCorrections = 16;        // of a parent
constexpr double kInBalance = 0.03;         // of the first one
constexpr double kComing = 0.2;             // of the first one: where the corrections are used up
constexpr double kHardly = 1e-4;            // of what the box pulls
constexpr double kCorrection = 1e-3;        // residual of one
constexpr int kMostCorrectionSteps = 400;

// A field that boxes are cut out of, as it is corrected by them.
struct ParentField {
  const QuadraticSystem& system;
  const QuadraticTangent& tangent;
  double safety;
  bool turns;                      // its cells have turned
  std::vector<Vec3> displacement;  // (nodes x 3) m
};

Lattice lattice_of(const QuadraticSystem& system) {
  return system.problem().body.parts.front().lattice;
}

// Cells around a point, within the parent's own box.
LatticeBox box_around(const QuadraticSystem& parent, const Vec3& at) {
  LatticeBox box;
  box.lattice = lattice_of(parent);
  const Vec3 inside = box.lattice.to_lattice(at);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    auto low = static_cast<std::int32_t>(std::floor(inside[a])) - kBoxReach;
    if (const VoxelRange* range = parent.box())
      low = std::clamp(low, static_cast<std::int32_t>(range->lower[a]),
                       std::max(static_cast<std::int32_t>(range->lower[a]),
                                static_cast<std::int32_t>(range->upper[a]) - 2 * kBoxReach - 1));
    box.lower[axis] = low;
    box.upper[axis] = low + 2 * kBoxReach + 1;
    if (const VoxelRange* range = parent.box())
      box.upper[axis] = std::min(box.upper[axis], static_cast<std::int32_t>(range->upper[a]));
  }
  return box;
}

// Faces of the surface that lie nearly in planes of the lattice. Which cells lie under one that is on a face of a box the box alone
// does not tell.
class FacesOnPlanes {
 public:
  FacesOnPlanes(const Surface& surface, const Lattice& lattice) {
    for (std::uint32_t p = 0; p < surface.polygon_count(); ++p) {
      const auto corners = surface.polygon(p);
      const Vec3 normal = (lattice.axes.transpose() * area_vector(surface.vertices, corners)).normalized();
      Eigen::Index axis = 0;
      if (!(normal.cwiseAbs().maxCoeff(&axis) > kAcross)) continue;
      Eigen::AlignedBox3d around;
      for (const std::uint32_t v : corners) {
        const Vec3 at = lattice.to_lattice(surface.vertices[v]);
        around.extend(at);
        at_[static_cast<std::size_t>(axis)].emplace(at[axis], around_.size());
      }
      around_.push_back(around);
    }
  }
  // Moves faces of the box, of a lattice `times` as fine and inside of `range`, outwards until they are clear of them.
  void keep_clear(std::int32_t times, const VoxelRange* range, LatticeBox& box) const {
    bool moved = true;
    for (int n = 0; n < kMostSteps && moved; ++n) {
      moved = false;  // what is on one side may come to another with a side that moves
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        std::int32_t &lower = box.lower[axis], &upper = box.upper[axis];
        if (lies_on(axis, lower, times, box) && (range == nullptr || lower > range->lower[a])) {
          --lower;
          moved = true;
        }
        if (lies_on(axis, upper, times, box) && (range == nullptr || upper < range->upper[a])) {
          ++upper;
          moved = true;
        }
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (lies_on(axis, box.lower[axis], times, box) || lies_on(axis, box.upper[axis], times, box))
        throw InputError("faces of the part lie in every plane of cells around the place that is looked at");
  }

 private:
  static constexpr double kAcross = 0.9;  // of a normal, along the axis
  static constexpr double kOn = 0.02;     // spacings: slivers of less matter are no cells
  static constexpr int kMostSteps = 6;
  // A face lies on the box's side in that plane.
  [[nodiscard]] bool lies_on(std::size_t axis, std::int32_t plane, std::int32_t times,
                             const LatticeBox& box) const {
    Eigen::AlignedBox3d side;
    for (const Index3& end : {box.lower, box.upper}) side.extend(Vec3(end[0], end[1], end[2]) / times);
    const auto a = static_cast<Eigen::Index>(axis);
    side.min()[a] = -std::numeric_limits<double>::infinity();
    side.max()[a] = std::numeric_limits<double>::infinity();
    for (auto found = at_[axis].lower_bound((plane - kOn) / times);
         found != at_[axis].end() && found->first <= (plane + kOn) / times; ++found)
      if (around_[found->second].intersects(side)) return true;
    return false;
  }
  std::array<std::multimap<double, std::size_t>, 3> at_;  // lattice coordinates of the whole -> of around_
  std::vector<Eigen::AlignedBox3d> around_;               // faces across an axis
};

// Where a submodel's field counts: a cell of its parent away from the cut faces.
VoxelRange core_of(const Submodel& model) {
  VoxelRange core = *model.system().box();
  core.lower.array() += kRatio;
  core.upper.array() -= kRatio;
  return core;
}

// The largest in the core, of points that count.
LargestStress largest_in(const Submodel& model, const Stresses& field,
                         const std::function<bool(const Vec3&)>& counts) {
  const VoxelRange core = core_of(model);
  const Lattice lattice = lattice_of(model.system());
  LargestStress most;
  for (std::size_t e = 0; e < field.element.size(); ++e) {
    const double value = von_mises(field.element[e]);
    if (!(value > most.value) || !core.contains(lattice.to_lattice(field.element_at[e])) ||
        !counts(field.element_at[e]))
      continue;
    most = {value, field.element_at[e], 0, field.element_doubt[e]};
  }
  return most;
}

// (nodes of the parent x 3) N: what the box pulls more than the parent's own cells there do, and was not given yet.
std::vector<Vec3> lacking_of(const ParentField& parent, const Submodel& fine, Submodel& own,
                             const std::vector<Vec3>& given) {
  own.take(parent.displacement, parent.safety, parent.turns);
  std::vector<Vec3> lacking(given.size(), Vec3::Zero());
  fine.add_pull(1, lacking);
  own.add_pull(-1, lacking);
  for (std::size_t i = 0; i < given.size(); ++i) lacking[i] -= given[i];
  parent.tangent.stiffness.clear_held(lacking);
  return lacking;
}

// N, what a box pulls.
double box_pull(const Submodel& fine, std::size_t nodes) {
  std::vector<Vec3> pull(nodes, Vec3::Zero());
  fine.add_pull(1, pull);
  return std::sqrt(dot(pull, pull));
}

// The next forces to give, of a map of such forces to what they leave over that is nearly linear: least squares over the last ones
// (Anderson, J. ACM 12, 1965). By itself what is lacking falls to a seventh each time, but where a sliver of matter that
// the parent hardly holds is firm in the finer cells it grows.
class Mixing {
 public:
  std::vector<Vec3> next(const std::vector<Vec3>& given, const std::vector<Vec3>& lacking) {
    std::vector<Vec3> to(given.size());
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = given[i] + lacking[i];
    if (!last_given_.empty()) {
      steps_.push_back(difference(given, last_given_));
      changes_.push_back(difference(lacking, last_lacking_));
      const auto count = static_cast<Eigen::Index>(steps_.size());
      Eigen::MatrixXd normal(count, count);
      Eigen::VectorXd right(count);
      for (Eigen::Index a = 0; a < count; ++a) {
        right[a] = dot(changes_[static_cast<std::size_t>(a)], lacking);
        for (Eigen::Index b = 0; b < count; ++b)
          normal(a, b) = dot(changes_[static_cast<std::size_t>(a)], changes_[static_cast<std::size_t>(b)]);
      }
      const Eigen::VectorXd share = solve_least_norm(normal, right);
      for (Eigen::Index a = 0; a < count; ++a)
        for (std::size_t i = 0; i < to.size(); ++i)
          to[i] -=
              share[a] * (steps_[static_cast<std::size_t>(a)][i] + changes_[static_cast<std::size_t>(a)][i]);
    }
    last_given_ = given;
    last_lacking_ = lacking;
    return to;
  }

 private:
  static std::vector<Vec3> difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    std::vector<Vec3> made(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) made[i] = a[i] - b[i];
    return made;
  }

  std::vector<Vec3> last_given_, last_lacking_;
  std::vector<std::vector<Vec3>> steps_, changes_;
};

// The equilibrium of a box and its parent together: the box beside the parent's field, then the parent with
// what the box pulls, in turn.
void couple(ParentField& parent, Submodel& fine, Submodel& own) {
  std::vector<Vec3> given(parent.displacement.size(), Vec3::Zero());
  Mixing mixing;
  double first = 0;
  for (int n = 0;; ++n) {
    check_stop();
    fine.solve(parent.displacement, parent.turns);
    const std::vector<Vec3> lacking = lacking_of(parent, fine, own, given);
    const double left = std::sqrt(dot(lacking, lacking));
    if (n == 0) first = left;
    if (left <= std::max(kInBalance * first, kHardly * box_pull(fine, given.size()))) return;
    if (n == kMostCorrections && left <= kComing * first) return;
    std::vector<Vec3> next = mixing.next(given, lacking), step = next, change;
    for (std::size_t i = 0; i < given.size(); ++i) step[i] -= given[i];
    if (n == kMostCorrections ||
        !conjugate_gradients(parent.tangent.stiffness, step, change, *parent.tangent.multigrid, kCorrection,
                             kMostCorrectionSteps)
             .converged)
      throw DivergedError("cells of two sizes around the largest stress did not come to one equilibrium");
    for (std::size_t i = 0; i < given.size(); ++i) parent.displacement[i] += change[i];
    given = std::move(next);
  }
}

// What was found at one place.
struct LookedPlace {
  LargestStress largest;
  SymmetricStress stress = SymmetricStress::Zero();
  std::vector<double> values;  // Pa, the whole's first
  double doubt_of_whole = 0;   // Pa
  bool grows_on = false;       // the values do not come to a limit
  double spacing = 0;          // m, of the finest cells
  double radius = 0;           // m, of the smallest notch around; infinite: there is none
  std::string beside;          // of singular_beside()
  std::size_t cells = 0;       // of all submodels
  // Lattice coordinates of the whole: where the first look counts, and the last one
  VoxelRange first_core, last_core;
  std::optional<Bar> bar;
};

Sequence sequence_of(const std::vector<double>& values) {
  Sequence made;
  for (std::size_t i = 0; i < 3; ++i)
    made.value[i] = values[values.size() - 1 - std::min(i, values.size() - 1)];
  made.ratio = {kRatio, kRatio};
  return made;
}

// Where somebody may look: Pa, what the whole's cells say there and what it may be.
struct Candidate {
  double value = 0, may_be = 0, doubt = 0;
  Vec3 at = Vec3::Zero();
};

// A hole or fillet so small that the whole's cells see too little of its peak.
struct SmallNotch {
  ReEntrantEdge edge;
  double radius = 0;  // m
  // Between the ends of the edge, where the run has most: Pa, 0 on a short edge
  double most = 0;
  Vec3 most_at = Vec3::Zero();
};

// The run's stresses between the ends of edges: a fillet along a part has vertices at its ends alone.
class StressAlongEdges {
 public:
  StressAlongEdges(const Body& body, const Lattice& lattice, const Stresses& field)
      : lattice_(lattice), field_(field) {
    for (std::uint32_t e = 0; e < body.element_count(); ++e) of_.emplace(body.lattice_index[e], e);
  }
  // Of points less than a spacing apart that count, each of the elements around it.
  void find(const std::function<bool(const Vec3&)>& counts, SmallNotch& notch) const {
    notch.most = 0;
    const auto& [a, b] = notch.edge.ends;
    const double parts = std::ceil((b - a).norm() / lattice_.spacing.minCoeff());
    for (double k = 1; k < parts; ++k) {
      const Vec3 at = a + k / parts * (b - a);
      const double value = around(at);
      if (value > notch.most && counts(at)) notch.most = value, notch.most_at = at;
    }
  }

 private:
  [[nodiscard]] double around(const Vec3& at) const {
    const Vec3 inside = lattice_.to_lattice(at);
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      Index3 index;
      for (int axis = 0; axis < 3; ++axis)
        index[static_cast<std::size_t>(axis)] =
            static_cast<std::int32_t>(std::floor(inside[axis])) + ((corner >> axis) & 1);
      const auto [first, last] = of_.equal_range(index);
      for (auto each = first; each != last; ++each)
        if ((field_.element_at[each->second] - at).norm() <= lattice_.spacing.maxCoeff())
          most = std::max(most, von_mises(field_.element[each->second]));
    }
    return most;
  }
  const Lattice lattice_;
  const Stresses& field_;
  std::multimap<Index3, std::uint32_t> of_;  // elements, by where they are
};

// How many times as large as the stress of coarse cells its peak may be, of what was measured: near 3 at the smallest holes, more at the fillet of a step,
// whose corner the coarse cells see as a sharp one; 1.6 at a radius of one cell, 1.3 at one and a quarter, 1.2 at two and a half.
double concentration(double radius, double spacing) {
  constexpr double kAtOneCell = 1.65, kSmallest = 3;
  const double cells = radius / spacing;
  if (cells > 1) return 1 + (kAtOneCell - 1) * std::max(0.0, kSeen - cells) / (kSeen - 1);
  return std::max(kSmallest + (kAtOneCell - kSmallest) * cells, std::sqrt(1 / cells));
}

bool grows_on(const std::vector<double>& values) {
  if (values.size() < 4) return false;
  const std::size_t n = values.size() - 1;
  const double last = values[n] - values[n - 1], before = values[n - 1] - values[n - 2];
  return last > kNarrow * values[n] && last > kGrowsOn * before;
}

// `value` of the field of a submodel where it counts, put into that of the whole.
class FieldMerger {
 public:
  // `taken`: whether a point was looked at already, and stays as it is.
  FieldMerger(const Body& body, std::function<bool(const Vec3&)> taken, Stresses& field)
      : body_(body), taken_(std::move(taken)), field_(field) {}

  void take(const Submodel& model, const Stresses& found, std::int32_t times) {
    const VoxelRange core = core_of(model);
    const Lattice& lattice = model.box().lattice;
    std::map<Index3, std::uint32_t> at;
    for (std::uint32_t e = 0; e < model.body().element_count(); ++e)
      at.emplace(model.body().lattice_index[e], e);
    for (std::uint32_t e = 0; e < body_.element_count(); ++e) {
      const Vec3& place = field_.element_at[e];
      if (!core.contains(lattice.to_lattice(place)) || taken_(place)) continue;
      Index3 index = body_.lattice_index[e];
      for (std::int32_t& each : index) each *= times;
      const auto same = at.find(index);
      const std::uint32_t from = same != at.end() ? same->second : nearest(model.body(), body_.rest[e]);
      field_.element[e] = found.element[from];
      field_.element_at[e] = found.element_at[from];
      field_.element_doubt[e] = found.element_doubt[from];
    }
    for (std::uint32_t v = 0; v < field_.vertex.size(); ++v)
      if (const Vec3& place = body_.surface.vertices[v];
          core.contains(lattice.to_lattice(place)) && !taken_(place))
        field_.vertex[v] = found.vertex[v];
  }

  // The largest is also that of the nearest element and vertex.
  void pin(const LargestStress& most, const SymmetricStress& stress) {
    if (taken_(most.at)) return;
    const std::uint32_t e = nearest(body_, most.at);
    field_.element[e] = stress;
    field_.element_at[e] = most.at;
    field_.element_doubt[e] = most.doubt;
    std::uint32_t vertex = 0;
    for (std::uint32_t v = 0; v < field_.vertex.size(); ++v)
      if ((body_.surface.vertices[v] - most.at).squaredNorm() <
          (body_.surface.vertices[vertex] - most.at).squaredNorm())
        vertex = v;
    if (!field_.vertex.empty()) field_.vertex[vertex] = stress;
  }

 private:
  static std::uint32_t nearest(const Body& body, const Vec3& at) {
    std::uint32_t best = 0;
    for (std::uint32_t e = 0; e < body.element_count(); ++e)
      if ((body.rest[e] - at).squaredNorm() < (body.rest[best] - at).squaredNorm()) best = e;
    return best;
  }

  const Body& body_;
  std::function<bool(const Vec3&)> taken_;
  Stresses& field_;
};

class CloserLook {
 public:
  CloserLook(const QuadraticSystem& system, const QuadraticSolution& solution, const Scene& scene,
             const CutBox& cut, const Stresses& field, const std::vector<std::uint8_t>& singular,
             Progress& progress)
      : system_(system),
        solution_(solution),
        scene_(scene),
        cut_(cut),
        progress_(progress),
        merged_(field),
        faces_(body().surface, lattice_of(system)) {
    for (ReEntrantEdge& edge : re_entrant_edges(body().surface, kLeastFacetTurn)) {
      const double radius = edge.width / edge.turn;
      if (edge.turn > kSharpTurn) {
        sharp_.push_back(edge);
        continue;
      }
      facets_.push_back(edge);
      if (radius < kSeen * spacing() && edge.width > kLeastFacetWidth * spacing())
        notches_.push_back({edge, radius});
    }
    for (std::uint32_t e = 0; e < singular.size(); ++e)
      if (singular[e] >= 2) tied_.push_back(body().rest[e]);
    find_along_notches();
  }

  LocalStressField operator()() {
    const auto began = std::chrono::steady_clock::now();
    look_around();
    LocalStressField made;
    sum_up(made);
    made.field = std::move(merged_);
    made.found.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return made;
  }

 private:
  [[nodiscard]] const Body& body() const { return system_.problem().body; }
  [[nodiscard]] double spacing() const { return lattice_of(system_).spacing.maxCoeff(); }

  // Before anything finer is merged.
  void find_along_notches() {
    if (notches_.empty()) return;
    const StressAlongEdges along(body(), lattice_of(system_), merged_);
    for (SmallNotch& each : notches_) {
      check_stop();
      along.find([this](const Vec3& at) { return !is_singular(at); }, each);
    }
  }

  // At the largest stress, and where there may be more, in a share of the time that is left: what was found is to be told.
  void look_around() {
    const StopAfter limit(kShareOfTime * time_left(), "the closer look");
    try {
      for (std::size_t n = 0; n < kMostPlaces; ++n) {
        const std::optional<Candidate> next = next_place();
        if (!next) return;
        progress_.update(static_cast<double>(n) / kMostPlaces, fmt::format("place {}", n + 1));
        try {
          places_.push_back(look(*next));
        } catch (const InputError&) {
          give_up(*next);
        } catch (const DivergedError&) {
          give_up(*next);
        }
      }
    } catch (const TimeoutError&) {
      // what was found counts; a limit of the whole command ends what comes next
      if (places_.empty()) throw TimeoutError("it did not end in half of the time that was left");
    }
  }

  // Called where an error is handled: without a first place there is none.
  void give_up(const Candidate& at) {
    if (places_.empty()) throw;
    given_up_.push_back(at.at);
  }
  [[nodiscard]] bool was_given_up(const Vec3& at) const {
    return std::any_of(given_up_.begin(), given_up_.end(),
                       [&](const Vec3& each) { return (each - at).norm() <= spacing(); });
  }
  [[nodiscard]] bool was_looked_at(const Vec3& at) const {
    const Vec3 inside = lattice_of(system_).to_lattice(at);
    return std::any_of(places_.begin(), places_.end(),
                       [&](const LookedPlace& each) { return each.last_core.contains(inside); });
  }
  // On cells half as large at least.
  [[nodiscard]] bool was_seen(const Vec3& at) const {
    const Vec3 inside = lattice_of(system_).to_lattice(at);
    return std::any_of(places_.begin(), places_.end(),
                       [&](const LookedPlace& each) { return each.first_core.contains(inside); });
  }
  // The place of the largest stress so far.
  [[nodiscard]] const LookedPlace& best() const {
    return *std::max_element(places_.begin(), places_.end(), [](const LookedPlace& a, const LookedPlace& b) {
      return a.largest.value < b.largest.value;
    });
  }
  // Pa, half of what is told of it.
  [[nodiscard]] static double bar_of(const LookedPlace& place) {
    return std::max(place.bar ? place.bar->half_width : 0, kLeastBar * place.largest.value);
  }
  // What the largest stress may be where nobody looked closer; nothing: no more than the bar of what was found says.
  // `in_vain`: where it could not be looked too.
  [[nodiscard]] std::optional<Candidate> most_elsewhere(bool in_vain) const {
    std::vector<Candidate> above;
    const double found = best().largest.value + bar_of(best());
    const auto add = [&](double value, double may_be, double doubt, const Vec3& at) {
      if (may_be > found && !was_seen(at) && (in_vain || !was_given_up(at)))
        above.push_back({value, may_be, doubt, at});
    };
    for (std::size_t e = 0; e < merged_.element.size(); ++e) {
      const double value = von_mises(merged_.element[e]), doubt = merged_.element_doubt[e];
      add(value, sure_share(value, doubt) * value + kDoubts * doubt, doubt, merged_.element_at[e]);
    }
    for (const SmallNotch& each : notches_)
      for (std::size_t i = 0; i < 2; ++i) {
        const double value = von_mises(merged_.vertex[each.edge.vertices[i]]);
        add(value, growth(each.radius) * value, 0, each.edge.ends[i]);
      }
    for (const SmallNotch& each : notches_)
      if (each.most > 0 && !was_seen_elsewhere(each))
        add(each.most, growth(each.radius) * each.most, 0, each.most_at);
    std::sort(above.begin(), above.end(),
              [](const Candidate& a, const Candidate& b) { return a.may_be > b.may_be; });
    for (const Candidate& each : above) {
      check_stop();
      if (!is_singular(each.at)) return each;
    }
    return std::nullopt;
  }
  // Somebody looked at another place along the notch, where the run has as much.
  [[nodiscard]] bool was_seen_elsewhere(const SmallNotch& notch) const {
    return std::any_of(places_.begin(), places_.end(), [&](const LookedPlace& each) {
      return each.values.front() * (1 + kNarrow) >= notch.most &&
             distance_to(notch.edge, each.largest.at) <= kBesideInField * spacing();
    });
  }
  // How many times what the run's cells have at a notch the stress there may be: as at those of its radius that were looked at, the less beyond the more
  // these are; else as any notch.
  [[nodiscard]] double growth(double radius) const {
    const double any = concentration(radius, spacing());
    double most = 0;
    int alike = 0;
    for (const LookedPlace& each : places_) {
      if (!each.beside.empty() || !(std::abs(each.radius / radius - 1) < kSameRadius)) continue;
      ++alike;
      most = std::max(most, each.largest.value / each.values.front());
    }
    return alike == 0 ? any : std::min(any, most * (1 + kLieOtherwise / (alike + 1)));
  }
  // Of a stress of the run's own cells: without what they have too large. A place that is less in doubt than the first one was counts less too
  // large: a field that the run's cells hold, as along an even bar, is as it is.
  [[nodiscard]] double sure_share(double value, double doubt) const {
    const LookedPlace& first = places_.front();
    const double whole = first.values.front(), too_large = 1 - std::min(1.0, first.largest.value / whole);
    if (!(value > 0 && first.doubt_of_whole > 0)) return 1;
    return 1 - too_large * std::min(1.0, doubt / value * (whole / first.doubt_of_whole));
  }
  [[nodiscard]] bool is_singular(const Vec3& at) const {
    const double reach = kBesideInField * spacing();
    return std::any_of(tied_.begin(), tied_.end(),
                       [&](const Vec3& each) { return (each - at).squaredNorm() <= reach * reach; }) ||
           std::any_of(sharp_.begin(), sharp_.end(), [&](const ReEntrantEdge& each) {
             return distance_to(each, at) <= (beyond_ ? kClear * spacing() : reach);
           });
  }
  // m: the smallest of holes and fillets around, of the small ones.
  [[nodiscard]] double notch_radius(const Vec3& at) const {
    double least = std::numeric_limits<double>::infinity();
    for (const SmallNotch& each : notches_)
      if (distance_to(each.edge, at) <= kBesideInField * spacing()) least = std::min(least, each.radius);
    return least;
  }

  // m: of the widest facets of a notch around a place; 0: there are none.
  [[nodiscard]] double facet_width(const Vec3& at, double reach) const {
    double widest = 0;
    for (const ReEntrantEdge& each : facets_)
      if (each.width > widest && distance_to(each, at) <= reach) widest = each.width;
    return widest;
  }

  // Its cells show the peak of the smallest notch there.
  [[nodiscard]] static bool is_resolved(const LookedPlace& place) {
    return place.radius >= kResolved * place.spacing;
  }

  // The place of the largest stress; then those where it may be larger still.
  std::optional<Candidate> next_place() {
    if (!places_.empty()) return best().beside.empty() ? most_elsewhere(false) : std::nullopt;
    const std::optional<LargestStress> most = largest_stress(body(), merged_);
    if (!most || !(most->value > 0)) return std::nullopt;
    if (is_singular(most->at)) return largest_beyond();
    return Candidate{most->value, most->value, most->doubt, most->at};
  }
  // Where the largest stress has no limit, the largest away from there.
  std::optional<Candidate> largest_beyond() {
    beyond_ = true;
    find_along_notches();
    std::vector<std::pair<double, std::uint32_t>> falling;
    for (std::uint32_t e = 0; e < merged_.element.size(); ++e)
      if (const double value = von_mises(merged_.element[e]); value > 0) falling.emplace_back(-value, e);
    std::sort(falling.begin(), falling.end());
    for (const auto& [value, e] : falling) {
      check_stop();
      if (!is_singular(merged_.element_at[e]))
        return Candidate{-value, -value, merged_.element_doubt[e], merged_.element_at[e]};
    }
    return std::nullopt;
  }
  // Whether what is there counts for the largest.
  [[nodiscard]] bool counts(const Vec3& at) const { return !beyond_ || !is_singular(at); }

  LookedPlace look(const Candidate& from) {
    LookedPlace place;
    place.values.push_back(from.value);
    place.doubt_of_whole = from.doubt;
    place.largest = {from.value, from.at, 0, 0};
    place.radius = notch_radius(from.at);
    Descent descent{
        {},
        {system_, *solution_.tangent, solution_.safety, !solution_.turn.empty(), solution_.displacement},
        {},
        1};
    const auto stands = [&] { return place.values.size() > 1 && is_resolved(place); };
    try {
      while (descent.models.size() < kMostLooks && look_finer(descent, place)) {
      }
    } catch (const InputError&) {  // what coarser boxes found counts where they see the peak
      if (!stands()) throw;
    } catch (const DivergedError&) {
      if (!stands()) throw;
    } catch (const TimeoutError&) {
      if (!stands()) throw;
    }
    return place;
  }

  // The boxes at one place, one in the other.
  struct Descent {
    std::vector<std::unique_ptr<Submodel>> models;
    ParentField whole;
    std::optional<ParentField> last;  // the field of the last box
    std::int32_t times = 1;           // as fine as the whole
  };

  // The next box; false where it is the last.
  bool look_finer(Descent& descent, LookedPlace& place) {
    const bool first = descent.models.empty();
    // cells smaller than the facets see their edges, and tell nothing of the shape that these stand for
    const double coming = spacing() / (kRatio * descent.times);
    if (coming < facet_width(place.largest.at, kRatio * coming)) {
      if (first) throw InputError("the facets of the surface there are as wide as its cells");
      return false;
    }
    ParentField& above = first ? descent.whole : *descent.last;
    LatticeBox box = box_around(above.system, place.largest.at);
    faces_.keep_clear(descent.times, above.system.box(), box);
    Submodel own(above.system, cut_(Submodel::finer(box, 1)), box, 1, scene_);
    descent.models.push_back(
        std::make_unique<Submodel>(above.system, cut_(Submodel::finer(box, kRatio)), box, kRatio, scene_));
    Submodel& fine = *descent.models.back();
    refuse_beyond_memory(quadratic_memory(body(), 0).bytes + quadratic_memory(fine.body(), 0).bytes,
                         "a closer look at the largest stress", scene_.name);
    couple(above, fine, own);
    if (!first) descent.models[descent.models.size() - 2]->forget();
    descent.times *= kRatio;
    if (!take(fine, descent.times, place)) return false;
    if (first) place.first_core = place.last_core;
    if (!place.beside.empty()) return false;
    const bool resolved = is_resolved(place);
    if (resolved && place.values.size() > 2 && place.bar->half_width <= kNarrow * place.largest.value)
      return false;
    // surely not the largest
    if (resolved && !places_.empty() && place.largest.value + place.bar->half_width < best().largest.value)
      return false;
    descent.last.emplace(ParentField{fine.system(), *fine.solution().tangent, fine.solution().safety,
                                     descent.whole.turns, fine.solution().displacement});
    return true;
  }

  // What a submodel says of the place; false where it is less sure than the one before though that saw the notch: its
  // cells see the edges of the surface's facets, or what has no limit.
  bool take(const Submodel& fine, std::int32_t times, LookedPlace& place) {
    State state;
    state.displacement = element_displacement(fine.system(), fine.solution());
    const VoxelRange core = core_of(fine);
    const Stresses found = field_stresses(fine.system(), fine.solution(), state, &core);
    LookedPlace now = place;
    now.largest = largest_in(fine, found, [this](const Vec3& at) { return counts(at); });
    if (now.largest.value > kMostGrowth * place.largest.value)
      throw DivergedError("finer cells around the largest stress do not find what the run's own have there");
    now.values.push_back(now.largest.value);
    now.last_core = core_of(fine);
    now.last_core.lower /= times;
    now.last_core.upper /= times;
    now.spacing = fine.box().lattice.spacing.maxCoeff();
    now.cells += fine.body().cell_count();
    now.beside = singular_beside(fine.body(), fine.system().tied_elements(), now.largest.at,
                                 kBesideInField * now.spacing);
    now.bar = field_stress_bar(sequence_of(now.values), std::min<std::size_t>(now.values.size(), 3),
                               now.largest.doubt, false);
    now.grows_on = grows_on(now.values);
    place.cells = now.cells;
    place.grows_on = now.grows_on;
    if (now.beside.empty() && now.values.size() > 3 && is_resolved(place) &&
        now.bar->half_width > place.bar->half_width)
      return false;
    place = now;
    FieldMerger merger(
        body(), [this](const Vec3& at) { return was_looked_at(at) || !counts(at); }, merged_);
    merger.take(fine, found, times);
    for (std::size_t e = 0; e < found.element.size(); ++e)
      if (found.element_at[e] == place.largest.at && von_mises(found.element[e]) == place.largest.value)
        place.stress = found.element[e];
    merger.pin(place.largest, place.stress);
    return true;
  }

  // What coarser cells say beyond the largest that finer ones found is what they are off by, but where there is no limit.
  void lower_to(double found) {
    const auto lower = [&](SymmetricStress& stress, const Vec3& at) {
      if (const double value = von_mises(stress); value > found && !is_singular(at)) stress *= found / value;
    };
    for (std::size_t e = 0; e < merged_.element.size(); ++e) lower(merged_.element[e], merged_.element_at[e]);
    for (std::size_t v = 0; v < merged_.vertex.size(); ++v)
      lower(merged_.vertex[v], body().surface.vertices[v]);
  }

  // Pa: what it may be at other places, those that were looked at too; 0: no more than was found.
  [[nodiscard]] double largest_elsewhere() const {
    const std::optional<Candidate> unseen = most_elsewhere(true);
    double most = unseen ? unseen->may_be : 0;
    for (const LookedPlace& each : places_)
      if (&each != &best() && each.bar) most = std::max(most, each.largest.value + each.bar->half_width);
    return most;
  }

  void sum_up(LocalStressField& to) {
    LocalStress& made = to.found;
    for (const LookedPlace& each : places_) made.cells += each.cells;
    made.places = places_.size();
    if (places_.empty()) return;
    const LookedPlace& place = best();
    const double elsewhere = largest_elsewhere();
    if (!beyond_) lower_to((1 - kBelowLargest) * place.largest.value);
    FieldMerger(
        body(), [](const Vec3&) { return false; }, merged_)
        .pin(place.largest, place.stress);
    made.stress.value = place.largest.value;
    made.stress.at = place.largest.at;
    made.stress.part = body().parts.front().name;
    made.stress.beside = place.beside;
    made.stress.doubt = place.largest.doubt;
    made.values.assign(place.values.rbegin(), place.values.rend());
    made.spacing = place.spacing;
    made.beside = place.beside;
    if (!place.beside.empty() || !place.bar || place.grows_on) return;
    made.bar = place.bar;
    made.bar->half_width = std::max(bar_of(place), elsewhere - place.largest.value);
  }

  const QuadraticSystem& system_;
  const QuadraticSolution& solution_;
  const Scene& scene_;
  const CutBox& cut_;
  Progress& progress_;
  Stresses merged_;
  FacesOnPlanes faces_;
  std::vector<LookedPlace> places_;
  std::vector<Vec3> given_up_;  // m
  bool beyond_ = false;         // the largest has no limit: what is beside such places is left out
  std::vector<ReEntrantEdge> sharp_, facets_;
  std::vector<SmallNotch> notches_;
  std::vector<Vec3> tied_;  // m, at rest: elements that supports or bonds hold
};

}  // namespace

double clear_of_singular(const LocalStress& local) {
  return kClear * local.spacing * std::pow(kRatio, static_cast<double>(local.values.size()) - 1);
}

std::string local_stress_lacks(const QuadraticSystem& system) {
  const Problem& problem = system.problem();
  if (problem.body.parts.size() != 1) return "more than one part";
  if (std::any_of(problem.body.broken.begin(), problem.body.broken.end(),
                  [](std::uint8_t each) { return each != 0; }))
    return "broken cells";
  if (!problem.settled.empty()) return "the shape that an earlier run left";
  if (!system.linked().empty()) return "rigid links and rigid parts";
  if (system.follows()) return "loads that follow the shape";
  if (system.heated()) return "heat and shrinkage";
  for (const NodalLoad& load : system.loads())
    if (load.on_elements) return fmt::format("loads on boxes of elements (\"{}\")", load.name);
  for (const NitscheSupport& support : system.supports())
    if (!support.nodes.empty())
      return fmt::format("fixes and moves by boxes of elements (\"{}\")", support.tie->name);
  return "";
}

LocalStressField look_closer(const QuadraticSystem& system, const QuadraticSolution& solution,
                             const Scene& scene, const CutBox& cut, const Stresses& field,
                             const std::vector<std::uint8_t>& singular, Progress& progress) {
  return CloserLook(system, solution, scene, cut, field, singular, progress)();
}

}  // namespace flexel::simulate
