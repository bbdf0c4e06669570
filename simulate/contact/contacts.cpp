// Each hook first brings list and states of the pairs up to date.
#include "simulate/contact/contacts.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "simulate/contact/initial_overlap.h"

namespace flexel::simulate {
namespace {

// Spacings, that an implicit step goes at most: anywhere, and where surfaces are near one another.
constexpr double kFarthest = 1, kFarthestNear = 0.25;

}  // namespace

Contacts::Contacts(ContactSettings settings, const Problem& problem)
    : settings_(std::move(settings)),
      surface_(problem, settings_.parts),
      list_(settings_, problem, surface_),
      release_(settings_, surface_, list_),
      states_(settings_, surface_, list_, memory_, release_),
      friction_(settings_.damping, surface_, list_, states_, memory_),
      bound_(settings_, surface_, list_, states_),
      loads_(surface_, settings_.parts),
      implicit_(settings_.damping, surface_, list_, states_, friction_, memory_) {
  constexpr int kPatches = 2;  // depths are judged from places half a cell apart
  if (std::count(settings_.parts.begin(), settings_.parts.end(), 1) > 1)
    start_.emplace(problem, settings_.parts, kPatches);
}

void Contacts::update_list(const State& state, bool ahead) {
  if (!list_.update(state, ahead)) return;
  memory_.follow(list_.pairs());
  states_.reset();
}

void Contacts::update(const State& state, bool all) {
  if (is_current_ && !all) return;
  const bool evaluated = !list_.pairs().empty() && states_.is_at(state);
  if (!is_current_ && !evaluated && !stepping_) update_list(state, false);
  states_.update(state, all);
}

// A trial that has led further than the list of pairs reaches, or through something, is no place for a step to end.
double Contacts::energy(const State& state) {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  if (stepping_ && list_.outgrown(state)) return kNowhere;
  update(state);
  double energy = 0;
  for (const std::uint32_t p : states_.active()) energy += states_[p].deep ? kNowhere : states_[p].energy;
  return energy;
}

bool Contacts::act(const State& state) {
  update(state);
  if (states_.active().empty()) loads_.clear();
  return !states_.active().empty();
}

void Contacts::add_forces(const State& state, std::vector<Vec3>& forces) {
  update(state);
  loads_.clear();
  loads_.add(state, list_, states_, false, forces);
}

void Contacts::add_dissipative_forces(const State& state, std::vector<Vec3>& forces) {
  if (stepping_) return implicit_.add_forces(state, forces);
  update(state);
  if (states_.acting().empty()) return;
  friction_.update(state);
  loads_.add(state, list_, states_, true, forces);
}

std::string Contacts::refuses_implicit_steps() const {
  const auto adheres = [](double stick) { return stick > 0; };
  const auto& columns = surface_.body().element_columns;
  if (std::any_of(settings_.stick.begin(), settings_.stick.end(), adheres) ||
      std::any_of(settings_.planes.begin(), settings_.planes.end(),
                  [&](const ContactPlane& plane) { return adheres(plane.stick.value_or(0)); }) ||
      columns.contains("stick_change"))
    return "what sticks: \"stick\" and \"glue\"";
  if (settings_.release_time > 0) return "\"overlap\" = \"part\"";
  const auto ball = [](const ContactPoint& point) { return point.shape == ContactShape::ball; };
  if (std::any_of(points().begin(), points().end(), ball)) return "contact of model \"paper\"";
  if (surface_.broken_cells() > 0) return "contact of broken cells";
  return {};
}

// Phases are those of the state that the step begins with.
double Contacts::begin_implicit_step(const State& before, const State& aimed, double step) {
  stepping_ = false;
  states_.thaw();
  if (points().empty()) return 1;
  const double narrowest = surface_.narrowest();
  double way = list_.way(before, aimed), share = 1;
  const auto go_at_most = [&](double spacings) {
    if (!(way > spacings * narrowest)) return;
    share *= spacings * narrowest / way;
    way = spacings * narrowest;
  };
  go_at_most(kFarthest);
  if (list_.update_ahead(before, way)) {
    memory_.follow(list_.pairs());
    states_.reset();
  }
  if (!list_.pairs().empty()) go_at_most(kFarthestNear);
  states_.update(before, true);
  stored_ = energy(before);
  implicit_.begin(before, step);
  stepping_ = true;
  states_.freeze();
  return share;
}

void Contacts::add_normal_stiffness(const State& trial, ContactTangent kind, BlockMatrix& matrix) {
  update(trial);
  add_contact_stiffness(surface_, list_, states_, kind, matrix);
}

double Contacts::friction_potential(const State& trial) const {
  return stepping_ ? implicit_.potential(trial) : 0;
}

void Contacts::add_friction_stiffness(const State& trial, BlockMatrix& matrix) const {
  implicit_.add_friction_stiffness(trial, matrix);
}

bool Contacts::settles(const State& found) {
  if (points().empty() || !dissipate()) return true;
  update(found);
  return implicit_.take_up(found);
}

// What the energy has grown less than by the work against its forces at the end is lost to the method.
void Contacts::end_implicit_step(const State& state) {
  if (points().empty()) return;
  std::vector<Vec3> forces(state.displacement.size(), Vec3::Zero());
  add_forces(state, forces);
  const std::vector<Vec3>& before = implicit_.before();
  const double work = parallel_sum<double>(
      forces.size(), [&](std::size_t e) { return forces[e].dot(state.displacement[e] - before[e]); });
  numerical_ += stored_ - work - energy(state);
  stepping_ = false;
  states_.thaw();
  states_.update(state);
  implicit_.finish(state);
}

// Without pairs nothing happens in a step; whether there are is asked before the next one.
void Contacts::finish_step(const State& state, double drift) {
  is_current_ = false;
  went_through_ = true;
  if (list_.built() && list_.pairs().empty()) return;
  update_list(state, false);
  states_.go_through(state, drift, dissipate(), settings_.damping);
}

void Contacts::finish_losses(const State& state, double drift) {
  if (!went_through_) finish_step(state, drift);
  went_through_ = false;
  friction_.finish_step(state, drift, dissipate());
}

Contacts::Energies Contacts::take_energies(const State& state) {
  update(state);
  return {release_.take_energy(), states_.take_hardened(), std::exchange(numerical_, 0)};
}

void Contacts::refuse_overlap(const State& state) {
  refuse_initial_overlap(settings_, start_ ? *start_ : surface_, release_.known_parts(), state);
  start_.reset();
}

double Contacts::frequency(const State& state) {
  if (points().empty()) return 0;
  update_list(state, true);
  update(state, true);
  return bound_.frequency();
}

bool Contacts::needs_step_recheck(const State& state) {
  if (points().empty()) return false;
  update_list(state, true);
  if (bound_.moves_too_far(state)) return true;
  states_.update(state);
  is_current_ = true;
  if (!bound_.checked()) update(state, true);
  return bound_.is_exceeded();
}

// Two parts come nearer by no more than both of them move.
void Contacts::add_touches(const State& state, double ahead, std::vector<PartTouch>& touches) {
  if (points().empty()) return;
  update(state, true);
  if (states_.active().empty()) return;
  const std::vector<Part>& parts = surface_.body().parts;
  std::vector<double> way(parts.size(), 0);  // m
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (std::uint32_t e = parts[p].element_begin; e < parts[p].element_end; ++e)
      way[p] = std::max(way[p], ahead * state.velocity[e].norm());
  for (const std::uint32_t n : states_.active()) {
    const ContactPair& pair = list_.pairs()[n];
    const PairState& now = states_[n];
    const std::uint32_t i = list_.point(pair.i).part, j = pair.of_plane() ? i : list_.point(pair.j).part;
    const double soon = now.gap - way[i] - (pair.of_plane() ? 0 : way[j]);
    const auto enter = [&](std::uint32_t part) {
      touches[part].gap = std::min(touches[part].gap, now.gap);
      touches[part].soon = std::min(touches[part].soon, soon);
      touches[part].stored += now.energy;
    };
    enter(i);
    if (j != i) enter(j);
  }
}

std::vector<double> Contacts::memory() const {
  std::vector<double> memory{list_.built() ? 1.0 : 0.0,
                             bound_.bound(),
                             bound_.checked() ? 1.0 : 0.0,
                             bound_.hardening_bound(),
                             friction_.fresh() ? 1.0 : 0.0,
                             release_.energy(),
                             states_.hardened(),
                             numerical_,
                             static_cast<double>(release_.known_parts()),
                             static_cast<double>(release_.share_count()),
                             static_cast<double>(memory_.size())};
  release_.save(memory);
  memory_.save(memory);
  for (const Vec3& at : list_.built_at()) memory.insert(memory.end(), at.begin(), at.end());
  return memory;
}

void Contacts::restore(const std::vector<double>& memory) {
  constexpr std::size_t kHead = 11;
  const auto count = [&](std::size_t at) {
    return memory.size() < kHead ? 0 : static_cast<std::size_t>(memory[at]);
  };
  const std::size_t joined = count(8), releases = joined + 2 * count(9);
  const std::size_t records = PairMemory::kValues * count(10);
  std::vector<Vec3> built_at(list_.built_at().size());
  if (memory.size() != kHead + releases + records + 3 * built_at.size())
    throw InputError("the checkpoint's contacts are not those of its scene");
  const std::span<const double> values(memory);
  release_.restore(values.subspan(kHead, releases), joined, memory[5]);
  memory_.restore(values.subspan(kHead + releases, records));
  const double* from = memory.data() + kHead + releases + records;
  for (Vec3& at : built_at) {
    at = Vec3(from[0], from[1], from[2]);
    from += 3;
  }
  is_current_ = false;
  friction_.set_fresh(memory[4] == 1);
  states_.set_hardened(memory[6]);
  numerical_ = memory[7];
  const bool built = memory[0] != 0;
  list_.rebuild_at(built ? &built_at : nullptr);
  if (!built) return;
  memory_.follow(list_.pairs());
  states_.reset();
  bound_.restore(memory[1], memory[2] == 1, memory[3]);
}

std::vector<double> Contacts::transfer_state() const {
  std::vector<double> values{static_cast<double>(release_.known_parts())};
  values.insert(values.end(), release_.joined().begin(), release_.joined().end());
  memory_.save_by_position(points(), values);
  return values;
}

void Contacts::restore_from(const std::vector<double>& transfer_state) {
  std::span<const double> values(transfer_state);
  if (!values.empty()) {
    const std::span<const double> joined = values.subspan(1, static_cast<std::size_t>(values[0]));
    release_.set_joined({joined.begin(), joined.end()});
    values = values.subspan(1 + joined.size());
  }
  memory_.restore_by_position(points(), settings_.planes.size(), values);
}

std::vector<std::array<std::uint32_t, 2>> Contacts::touching(const State& state) {
  update(state);
  std::vector<std::array<std::uint32_t, 2>> result;
  for (const std::uint32_t p : states_.active())
    if (states_[p].pressure > 0)
      result.push_back({static_cast<std::uint32_t>(list_.pairs()[p].key >> 32),
                        static_cast<std::uint32_t>(list_.pairs()[p].key & 0xffffffff)});
  return result;
}

}  // namespace flexel::simulate
