// Sums over the body at samples; powers at every step.
#include "simulate/time/energy_history.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <utility>

#include "base/error.h"
#include "base/files/append_text.h"
#include "base/files/csv.h"
#include "base/parallel.h"
#include "simulate/stepping/failure_messages.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kFirstJudged =
    20;                            // row; at the start energies are small and steps meet what moves at once
constexpr double kMostLost = 0.5;  // of the largest energy, that the books may lack
constexpr double kLeastStrain = 1e-6;  // of all matter, whose energy is too little to be judged

const char* called(Account::Kind kind) {
  switch (kind) {
    case Account::Kind::work:
      return "work";
    case Account::Kind::dissipation:
      return "dissipated";
    case Account::Kind::storage:
      break;
  }
  return "stored";
}

Account::Kind kind_of(EnergyAccount account) {
  return account == EnergyAccount::stored        ? Account::Kind::storage
         : account == EnergyAccount::dissipation ? Account::Kind::dissipation
                                                 : Account::Kind::work;
}

}  // namespace

std::size_t EnergyBalance::account(const std::string& name, Account::Kind kind) {
  for (std::size_t a = 0; a < accounts.size(); ++a)
    if (accounts[a].name == name) return a;
  accounts.push_back({name, kind, 0});
  return accounts.size() - 1;
}

std::string EnergyBalance::csv() const {
  std::string text = "time [s],kinetic [J],elastic [J],potential [J],work [J],dissipated [J],residual [J]";
  for (const Account& account : accounts) append_text(text, ",{} {} [J]", account.name, called(account.kind));
  for (const char* name : {"momentum", "angular momentum"})
    for (const char axis : {'x', 'y', 'z'})
      append_text(text, ",{} {} [{}]", name, axis, std::string(name) == "momentum" ? "kg m/s" : "kg m2/s");
  const auto name_column = [&](const std::string& name) {
    text += ',';
    text += csv_field(name);
  };
  for (const std::string& probe : probes)
    for (const char axis : {'x', 'y', 'z'}) name_column(fmt::format("{} {} [m]", probe, axis));
  for (const std::string& column : columns) name_column(column);
  text += '\n';
  for (const BookRow& row : rows) {
    const Energies& e = row.energies;
    append_text(text, "{:.17g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.3g}", row.time, e.kinetic, e.elastic,
                e.potential, e.work, e.dissipated, e.residual);
    for (std::size_t a = 0; a < accounts.size(); ++a)
      append_text(text, ",{:.9g}", a < row.accounts.size() ? row.accounts[a] : 0.0);
    for (const Vec3& vector : {row.momentum, row.angular})
      for (const double value : vector) append_text(text, ",{:.12g}", value);
    for (const double value : row.probes) append_text(text, ",{:.12g}", value);
    for (const double value : row.values) append_text(text, ",{:.9g}", value);
    text += '\n';
  }
  return text;
}

std::vector<std::pair<std::string, double>> EnergyBalance::sums() const {
  const Energies& last = rows.back().energies;
  return {{"kinetic", last.kinetic},
          {"elastic", last.elastic},
          {"potential", last.potential},
          {"work", last.work},
          {"dissipated", last.dissipated},
          {"worst_residual", worst_residual},
          {"worst_contact_error", worst_unstored},
          {"largest_term", largest_term}};
}

EnergyHistory::EnergyHistory(const Problem& problem, const std::vector<ActiveEffect>& effects,
                             const std::vector<ProbePoints>& probes, const std::vector<double>& mass,
                             const PaperModel* paper, const KernelEffects& plan, EnergyBalance balance)
    : problem_(problem),
      effects_(effects),
      probes_(probes),
      mass_(mass),
      paper_(paper),
      cells_(problem, no_stencil_),
      forces_(effects.size()),
      remembers_(plan.remembers()),
      balance_(std::move(balance)) {
  own_.assign(effects.size(), 0);
  stored_.assign(effects.size(), 0);
  for (const Part& part : problem.body.parts)
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      const Material& material =
          problem.materials[static_cast<std::size_t>(&part - problem.body.parts.data())];
      least_ += kLeastStrain * kLeastStrain * material.young * mass[e] / material.density;
    }
  for (std::size_t p = 0; p < effects.size(); ++p) {
    const EnergyAccount account = effects[p]->account();
    if (account == EnergyAccount::none || account == EnergyAccount::potential) continue;
    forces_[p].assign(problem.body.element_count(), Vec3::Zero());
    own_[p] = balance_.account(effects[p].name, kind_of(account));
  }
  supports_ = balance_.account("supports", Account::Kind::work);
  damping_ = balance_.account("damping", Account::Kind::dissipation);
  if (!plan.plasticity.empty()) plasticity_ = balance_.account("plasticity", Account::Kind::dissipation);
  if (!plan.fracture.empty()) fracture_ = balance_.account("fracture", Account::Kind::dissipation);
  balance_.probes.clear();
  for (const ProbePoints& probe : probes) balance_.probes.push_back(probe.name);
  balance_.columns.clear();
  for (const ActiveEffect& effect : effects)
    for (std::string& column : effect->history_columns()) balance_.columns.push_back(std::move(column));
}

void EnergyHistory::before(const State& state, bool sample, double folding) {
  for (std::size_t p = 0; p < effects_.size(); ++p)
    for (const EnergyTransfer& each : effects_[p]->take_transfers(state)) {
      if (each.energy == 0) continue;
      balance_.accounts[own_[p]].energy -= each.energy;
      balance_.accounts[balance_.account(each.from, kind_of(each.kind))].energy += each.energy;
    }
  velocity_ = state.velocity;
  sample_ = sample;
  time_ = *state.time;
  if (!sample) return;
  sampled_.displacement = state.displacement;
  sampled_.time = state.time;
  // with plasticity, fracture or rest shapes the step tells that of the cells
  elastic_ = (remembers_ ? folding : cells_.energy(state)) + (paper_ ? paper_->energy(state) : 0);
  potential_ = 0;
  for (std::size_t p = 0; p < effects_.size(); ++p) {
    const EnergyAccount account = effects_[p]->account();
    if (account == EnergyAccount::potential) potential_ += effects_[p]->energy(state);
    if (account == EnergyAccount::stored) stored_[p] = effects_[p]->energy(state);
  }
}

void EnergyHistory::after(const State& state, const StepOutcome& outcome, const std::vector<Vec3>& damping,
                          const std::vector<Vec3>& supports, double previous_step, double step,
                          bool half_kick) {
  // A half kick from v(0) makes v(1/2); the same forces for as long before it would have made v(0) from
  // v(-1/2) = 2 v(0) - v(1/2), and with that one the kinetic energy changes by the work of whole kicks.
  if (half_kick)
    parallel_for_each(velocity_.size(),
                      [&](std::size_t e) { velocity_[e] = 2 * velocity_[e] - state.velocity[e]; });
  const auto add_powers = [&](const std::vector<Vec3>& velocity, double time, bool behind) {
    for (const ActiveEffect& effect : effects_)
      for (const EffectPower& each : effect->powers(behind))
        balance_.accounts[balance_.account(each.account, kind_of(each.kind))].energy += time * each.power;
    const auto enter = [&](std::size_t account, const std::vector<Vec3>& forces) {
      balance_.accounts[account].energy += time * parallel_sum<double>(forces.size(), [&](std::size_t e) {
                                             return forces[e].dot(velocity[e]);
                                           });
    };
    for (std::size_t p = 0; p < effects_.size(); ++p)
      if (!forces_[p].empty()) enter(own_[p], forces_[p]);
    enter(supports_, supports);
    enter(damping_, damping);
    enter(damping_, connection_damping_);
  };
  // before an event the half step to it was entered
  if (!balance_.changed) add_powers(velocity_, 0.5 * previous_step, false);
  const std::vector<Account> kept = closing_ ? balance_.accounts : std::vector<Account>();
  if (plasticity_) balance_.accounts[*plasticity_].energy -= outcome.plastic_work;
  if (fracture_) balance_.accounts[*fracture_].energy -= outcome.released;
  if (outcome.elastic) elastic_ += *outcome.elastic;
  if (sample_) add_row(state, supports, half_kick);
  if (!closing_) return add_powers(state.velocity, 0.5 * step, true);
  for (std::size_t a = 0; a < kept.size(); ++a)  // what an event gave is of the row
    if (kept[a].name != "events") balance_.accounts[a] = kept[a];
}

void EnergyHistory::add_row_of(const State& state, const std::vector<Vec3>& supports) {
  before(state, true);
  if (remembers_) elastic_ += cells_.energy(state);  // no step tells it
  add_row(state, supports, false);
}

void EnergyHistory::enter(const std::vector<Vec3>& moved, const std::vector<Vec3>& damping,
                          const std::vector<Vec3>& supports, double numerical) {
  const auto add = [&](std::size_t account, const std::vector<Vec3>& forces) {
    balance_.accounts[account].energy +=
        parallel_sum<double>(forces.size(), [&](std::size_t e) { return forces[e].dot(moved[e]); });
  };
  for (std::size_t p = 0; p < effects_.size(); ++p)
    if (!forces_[p].empty()) add(own_[p], forces_[p]);
  add(supports_, supports);
  add(damping_, damping);
  balance_.accounts[balance_.account("numerical", Account::Kind::dissipation)].energy -= numerical;
}

// What an event changed of what is stored, it gave or took: the sum of what stores lack stays what it was.
void EnergyHistory::book_stored_by_event() {
  double lacking = balance_.unstored_now - balance_.unstored;
  std::optional<std::size_t> store;
  for (std::size_t p = 0; p < effects_.size(); ++p) {
    if (effects_[p]->account() != EnergyAccount::stored || forces_[p].empty()) continue;
    store = own_[p];
    lacking += balance_.accounts[own_[p]].energy + stored_[p];
  }
  if (store) balance_.accounts[*store].energy -= lacking;
}

// Of the elements, but of free rigid parts as a whole.
EnergyHistory::Momenta EnergyHistory::momenta(const State& state, bool half_kick) const {
  std::vector<RigidMomenta> rigid;
  for (const ActiveEffect& effect : effects_)
    for (const RigidMomenta& each : effect->rigid_momenta(half_kick)) rigid.push_back(each);
  std::vector<std::uint8_t> counted(mass_.size(), 1);
  for (const RigidMomenta& each : rigid)
    std::fill(counted.begin() + each.begin, counted.begin() + each.end, std::uint8_t{0});
  Momenta sum = parallel_sum<Momenta>(mass_.size(), [&](std::size_t e) {
    if (!counted[e]) return Momenta{};
    const Vec3 mean = 0.5 * (velocity_[e] + state.velocity[e]);
    const Vec3 at = problem_.body.rest[e] + sampled_.displacement[e];
    return Momenta{0.5 * mass_[e] * velocity_[e].dot(state.velocity[e]), mass_[e] * mean,
                   mass_[e] * at.cross(mean)};
  });
  for (const RigidMomenta& each : rigid) sum += Momenta{each.kinetic, each.momentum, each.angular};
  return sum;
}

void EnergyHistory::add_row(const State& state, const std::vector<Vec3>& supports, bool half_kick) {
  const Momenta sum = momenta(state, half_kick);
  BookRow row;
  row.time = time_;
  row.momentum = sum.linear;
  row.angular = sum.angular;
  Energies& now = row.energies;
  now = {sum.kinetic, elastic_, potential_, 0, 0, 0};
  if (balance_.changed && !balance_.rows.empty()) book_stored_by_event();
  double unstored = 0;
  for (std::size_t p = 0; p < effects_.size(); ++p) {
    if (effects_[p]->account() != EnergyAccount::stored || forces_[p].empty()) continue;
    if (!balance_.start) balance_.accounts[own_[p]].energy -= stored_[p];  // that it begins with
    if (stored_[p] == 0 && balance_.accounts[own_[p]].energy != 0) {
      const double left = std::exchange(balance_.accounts[own_[p]].energy, 0);
      balance_.accounts[balance_.account("numerical", Account::Kind::dissipation)].energy += left;
      balance_.unstored -= left;
    }
    unstored -= balance_.accounts[own_[p]].energy + stored_[p];
  }
  balance_.unstored_now = balance_.unstored + unstored;
  balance_.worst_unstored = std::max(balance_.worst_unstored, std::abs(balance_.unstored_now));
  double book = now.kinetic + now.elastic + now.potential;
  for (const Account& account : balance_.accounts) book -= account.energy;
  if (balance_.changed && !balance_.rows.empty())
    balance_.accounts[balance_.account("events", Account::Kind::work)].energy +=
        book - *balance_.start - balance_.rows.back().energies.residual;
  balance_.changed = false;
  for (const Account& account : balance_.accounts) {
    const bool gives = account.kind == Account::Kind::work;
    double& term = gives                                        ? now.work
                   : account.kind == Account::Kind::dissipation ? now.dissipated
                                                                : now.potential;
    term += gives ? account.energy : -account.energy;
    row.accounts.push_back(gives ? account.energy : 0.0 - account.energy);
  }
  book = now.kinetic + now.elastic + now.potential + now.dissipated - now.work;
  if (!balance_.start) balance_.start = book;
  now.residual = book - *balance_.start;
  balance_.worst_residual = std::max(balance_.worst_residual, std::abs(now.residual));
  for (const double term : {now.kinetic, now.elastic, now.potential, now.work, now.dissipated})
    balance_.largest_term = std::max(balance_.largest_term, std::abs(term));
  for (const ProbePoints& probe : probes_)
    for (const double value : measure(probe, sampled_).displacement) row.probes.push_back(value);
  std::vector<Vec3> unbalanced(problem_.body.element_count(), Vec3::Zero());
  for (std::size_t e = 0; e < supports.size(); ++e) unbalanced[e] = -supports[e];
  for (const ActiveEffect& effect : effects_)
    for (const double value : effect->history_values(sampled_, unbalanced)) row.values.push_back(value);
  balance_.rows.push_back(std::move(row));
}

void EnergyHistory::refuse_broken_books(const State& state) const {
  if (!balance_.rows.empty() &&
      !std::isfinite(balance_.rows.back().energies.residual + balance_.unstored_now))
    throw DivergedError(
        fmt::format("an energy is no number any more, the fastest element rests near {}: give a shorter "
                    "[run] step or load "
                    "it more slowly",
                    fastest_near(problem_.body, state)));
  if (balance_.rows.size() < kFirstJudged || !(balance_.largest_term > least_)) return;
  const double lost =
      std::max(std::abs(balance_.rows.back().energies.residual), std::abs(balance_.unstored_now));
  if (lost < kMostLost * balance_.largest_term) return;
  throw DivergedError(fmt::format(
      "{:.3g} J of at most {:.3g} J in the books of energy have come from nowhere or gone there, the "
      "fastest element rests near {}: give a shorter [run] step, load it more slowly or damp it "
      "([damping])",
      lost, balance_.largest_term, fastest_near(problem_.body, state)));
}

}  // namespace flexel::simulate
