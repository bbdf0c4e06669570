// Elements of the whole are elements of every submodel around them, so what is found there is theirs.
#include "simulate/quadratic/local_stress.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/human.h"
#include "base/program/progress.h"
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
constexpr std::size_t kMostLooks = 4;  // at one place, each on cells half as large
constexpr std::size_t kMostPlaces = 4;
constexpr double kLeastBar = 0.015;   // share: of what facets of the surface make of it
constexpr double kRounding = 1e-9;    // share: below the largest, so that its place is the one
constexpr double kNarrow = 0.01;      // share: a bar that needs no further look
constexpr double kDoubts = 1.5;       // times a doubt: what field_stress_bar() takes it for
constexpr int kMostCorrections = 16;  // of a parent
constexpr double kInBalance = 0.03;   // of the first one
constexpr double kComing = 0.2;       // of the first one: where the corrections are used up
constexpr double kHardly = 1e-4;      // of what the box pulls
constexpr double kCorrection = 1e-5;  // residual of one
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

// Where a submodel's field counts: a cell of its parent away from the cut faces.
VoxelRange core_of(const Submodel& model) {
  VoxelRange core = *model.system().box();
  core.lower.array() += kRatio;
  core.upper.array() -= kRatio;
  return core;
}

// The largest in the core.
LargestStress largest_in(const Submodel& model, const Stresses& field) {
  const VoxelRange core = core_of(model);
  const Lattice lattice = lattice_of(model.system());
  LargestStress most;
  for (std::size_t e = 0; e < field.element.size(); ++e) {
    const double value = von_mises(field.element[e]);
    if (!(value > most.value) || !core.contains(lattice.to_lattice(field.element_at[e]))) continue;
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
      const Eigen::VectorXd share = normal.completeOrthogonalDecomposition().solve(right);
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
  double spacing = 0;          // m, of the finest cells
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
        singular_(singular),
        progress_(progress),
        merged_(field) {}

  LocalStressField operator()() {
    const auto began = std::chrono::steady_clock::now();
    for (std::size_t n = 0; n < kMostPlaces; ++n) {
      const std::optional<LargestStress> next = next_place();
      if (!next) break;
      progress_.update(static_cast<double>(n) / kMostPlaces, fmt::format("place {}", n + 1));
      places_.push_back(look(*next));
    }
    LocalStressField made;
    made.found = summed_up();
    made.field = std::move(merged_);
    made.found.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    return made;
  }

 private:
  [[nodiscard]] const Body& body() const { return system_.problem().body; }
  [[nodiscard]] double spacing() const { return lattice_of(system_).spacing.maxCoeff(); }

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
  // Pa: what the largest stress may be where nobody looked closer, and where; 0: no more than was found. What the run's own cells had too
  // large at the first place they have too large elsewhere.
  [[nodiscard]] LargestStress most_elsewhere() const {
    std::vector<LargestStress> above;
    const double found = best().largest.value;
    const double share = std::min(1.0, places_.front().largest.value / places_.front().values.front());
    for (std::size_t e = 0; e < merged_.element.size(); ++e) {
      const double may_be = share * von_mises(merged_.element[e]) + kDoubts * merged_.element_doubt[e];
      if (may_be > found && !was_seen(merged_.element_at[e]))
        above.push_back({may_be, merged_.element_at[e], 0, merged_.element_doubt[e]});
    }
    std::sort(above.begin(), above.end(),
              [](const LargestStress& a, const LargestStress& b) { return a.value > b.value; });
    for (const LargestStress& each : above) {
      check_stop();
      if (!is_singular(each.at)) return each;
    }
    return {};
  }
  [[nodiscard]] bool is_singular(const Vec3& at) const {
    return !singular_beside(body(), singular_, at, kBesideInField * spacing()).empty();
  }

  // The place of the largest stress; then those where it may be larger still.
  [[nodiscard]] std::optional<LargestStress> next_place() const {
    if (places_.empty()) {
      const std::optional<LargestStress> most = largest_stress(body(), merged_);
      return most && most->value > 0 && !is_singular(most->at) ? most : std::nullopt;
    }
    if (!best().beside.empty()) return std::nullopt;
    const LargestStress most = most_elsewhere();
    return most.value > 0 ? std::optional(most) : std::nullopt;
  }

  LookedPlace look(const LargestStress& from) {
    LookedPlace place;
    place.values.push_back(places_.empty() ? from.value : from.value - kDoubts * from.doubt);
    place.largest = from;
    const bool turns = !solution_.turn.empty();
    std::vector<std::unique_ptr<Submodel>> models;
    ParentField parent{system_, *solution_.tangent, solution_.safety, turns, solution_.displacement};
    std::int32_t times = 1;
    std::optional<ParentField> next;
    for (std::size_t n = 0; n < kMostLooks; ++n) {
      ParentField& above = next ? *next : parent;
      const LatticeBox box = box_around(above.system, place.largest.at);
      Submodel own(above.system, cut_(Submodel::finer(box, 1)), box, 1, scene_);
      models.push_back(
          std::make_unique<Submodel>(above.system, cut_(Submodel::finer(box, kRatio)), box, kRatio, scene_));
      Submodel& fine = *models.back();
      refuse_beyond_memory(quadratic_memory(body(), 0).bytes + quadratic_memory(fine.body(), 0).bytes,
                           "a closer look at the largest stress", scene_.name);
      couple(above, fine, own);
      if (n > 0) models[n - 1]->forget();
      times *= kRatio;
      if (!take(fine, times, place)) break;
      if (n == 0) place.first_core = place.last_core;
      if (!place.beside.empty()) break;
      if (place.values.size() > 2 && place.bar->half_width <= kNarrow * place.largest.value) break;
      next.emplace(ParentField{fine.system(), *fine.solution().tangent, fine.solution().safety, turns,
                               fine.solution().displacement});
    }
    return place;
  }

  // What a submodel says of the place; false where it is less sure than the one before: its cells see the edges
  // of the surface's facets.
  bool take(const Submodel& fine, std::int32_t times, LookedPlace& place) {
    State state;
    state.displacement = element_displacement(fine.system(), fine.solution());
    const VoxelRange core = core_of(fine);
    const Stresses found = field_stresses(fine.system(), fine.solution(), state, &core);
    LookedPlace now = place;
    now.largest = largest_in(fine, found);
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
    place.cells = now.cells;
    if (now.beside.empty() && now.values.size() > 3 && now.bar->half_width > place.bar->half_width)
      return false;
    place = now;
    FieldMerger merger(
        body(), [this](const Vec3& at) { return was_looked_at(at); }, merged_);
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

  LocalStress summed_up() {
    LocalStress made;
    for (const LookedPlace& each : places_) made.cells += each.cells;
    made.places = places_.size();
    if (places_.empty()) return made;
    const LookedPlace& place = best();
    const double elsewhere = most_elsewhere().value;
    lower_to((1 - kRounding) * place.largest.value);
    FieldMerger(
        body(), [](const Vec3&) { return false; }, merged_)
        .pin(place.largest, place.stress);
    const std::optional<LargestStress> most = largest_stress(body(), merged_);
    if (most && most->value > place.largest.value) {
      made.beside = singular_beside(body(), singular_, most->at, kBesideInField * spacing());
      return made;
    }
    made.values.assign(place.values.rbegin(), place.values.rend());
    made.spacing = place.spacing;
    made.beside = place.beside;
    if (!place.beside.empty() || !place.bar) return made;
    made.bar = place.bar;
    made.bar->half_width =
        std::max({made.bar->half_width, kLeastBar * place.largest.value, elsewhere - place.largest.value});
    return made;
  }

  const QuadraticSystem& system_;
  const QuadraticSolution& solution_;
  const Scene& scene_;
  const CutBox& cut_;
  const std::vector<std::uint8_t>& singular_;
  Progress& progress_;
  Stresses merged_;
  std::vector<LookedPlace> places_;
};

}  // namespace

std::string local_stress_lacks(const QuadraticSystem& system) {
  if (system.problem().body.parts.size() != 1) return "more than one part";
  if (!system.linked().empty()) return "rigid links and rigid parts";
  if (system.follows()) return "loads that follow the shape";
  if (system.heated()) return "heat and shrinkage";
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
