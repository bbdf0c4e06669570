// Two passes over the body per step: chunks with what they own, then the elements that several chunks share.
#include "simulate/stepping/stepper.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/instruction_set.h"
#include "base/parallel.h"
#include "simulate/kernels/scratch.h"
#include "simulate/matter/masses.h"

namespace flexel::simulate {
namespace {

// Those that this machine runs, the best one first. The others are not so much as asked for: what fills in a
// table is compiled for its instruction set too.
std::vector<const step::KernelTable*> tables() {
  std::vector<const step::KernelTable*> found;
#if defined(__x86_64__)
  if (runs(InstructionSet::avx512)) found.push_back(&step::kernels_avx512());
  if (runs(InstructionSet::avx2)) found.push_back(&step::kernels_avx2());
#endif
  found.push_back(&step::kernels_portable());
  return found;
}

struct Lowest {
  double value = std::numeric_limits<double>::infinity();
  std::uint32_t part = 0;
  double elastic = 0, plastic_work = 0, released = 0;
  std::uint64_t broken = 0;
  Lowest& operator+=(const Lowest& other) {
    if (other.value < value) {
      value = other.value;
      part = other.part;
    }
    elastic += other.elastic;
    plastic_work += other.plastic_work;
    released += other.released;
    broken += other.broken;
    return *this;
  }
};

constexpr int kTimedRuns = 5;

void move_element(std::size_t e, const double* force, const step::StateView& view,
                  const step::Advance& advance) {
  double* u = view.displacement + 3 * e;
  double* v = view.velocity + 3 * e;
  const double gain = advance.kick * view.inverse_mass[e];
  for (std::size_t c = 0; c < 3; ++c) {
    const double before = v[c];
    v[c] = before + gain * (view.outer ? force[c] + view.outer[3 * e + c] : force[c]);
    u[c] += advance.drift * (advance.explicit_drift ? before : v[c]);
  }
}

void add_slots(const std::vector<double>& values, std::span<const std::uint32_t> slots, double* sum) {
  sum[0] = sum[1] = sum[2] = 0;
  for (const std::uint32_t slot : slots)
    for (std::size_t c = 0; c < 3; ++c) sum[c] += values[3 * std::size_t{slot} + c];
}

}  // namespace

const step::KernelTable& kernel_table(const std::string& isa) {
  std::string have;
  for (const step::KernelTable* table : tables()) {
    if (isa.empty() || isa == table->isa) return *table;
    have += have.empty() ? table->isa : fmt::format(", {}", table->isa);
  }
  throw InputError(fmt::format("--isa \"{}\": this machine runs {}", isa, have));
}

Stepper::Stepper(const Problem& problem, const KernelEffects& plan, bool book, const std::string& isa)
    : layout_(step_layout(problem, plan)),
      table_(&kernel_table(isa)),
      mass_(lumped_masses(problem)),
      inverse_mass_(mass_.size()),
      shared_force_(3 * layout_.shared.size()),
      book_(book) {
  for (std::size_t e = 0; e < mass_.size(); ++e) inverse_mass_[e] = mass_[e] > 0 ? 1 / mass_[e] : 0;
  choose_kernels(problem, plan);
  if (book_) make_room_for_books();
}

void Stepper::make_room_for_books() {
  shared_damping_.resize(shared_force_.size());
  damping_force_.resize(inverse_mass_.size(), Vec3::Zero());
}

void Stepper::choose_kernels(const Problem& problem, const KernelEffects& plan) {
  bool damped = false, plastic = false;
  bool cells_flow = false, springs_flow = false, springs_break = false;
  plastic = plan.rest_shapes;  // flows nowhere without a yield stress
  for (const PlasticFlow& flow : plan.plasticity) plastic = plastic || std::isfinite(flow.yield);
  for (const FractureLimits& limits : plan.fracture) fractures_ = fractures_ || limits.any();
  fractures_ = fractures_ || plan.broken_springs;
  for (std::size_t kind = 0; kind < layout_.constants.size(); ++kind) {
    step::CellConstants& c = layout_.constants[kind];
    const std::uint32_t p = layout_.kind_part[kind];
    const PlasticFlow flow = plan.plasticity.empty() ? PlasticFlow{} : plan.plasticity[p];
    const FractureLimits limits = plan.fracture.empty() ? FractureLimits{} : plan.fracture[p];
    const bool springs = problem.models.size() > p && problem.models[p] == Model::springs;
    const CellFactors& factors = layout_.kind_factors[kind];
    c.yield = factors.yield * flow.yield;
    c.hardening = flow.hardening;
    c.saturation = flow.saturation;
    c.rate = flow.rate;
    c.strength = factors.strength * (flow.saturation > 0 ? limits.flowing_strength : limits.strength);
    c.elongation = factors.strength * limits.elongation;
    step::Composition has{plan.damping[p] > 0 ? step::Damping::plain : step::Damping::none,
                          std::isfinite(flow.yield) || plan.rest_shapes,
                          limits.any() || (springs && plan.broken_springs)};
    damped = damped || plan.damping[p] > 0;
    (springs ? springs_flow : cells_flow) |= has.plasticity;
    const step::ChunkKernel* kernels = springs ? table_->springs : table_->cells;
    // Cells' kernels tell the elastic energy only with fracture or plasticity: where one part needs it, all
    // do.
    step::Composition booking = has;
    booking.damping = step::Damping::book;
    const bool tells = steps_by_connection(problem, plan, p);
    booking.fracture = has.fracture || (!tells && (plastic || fractures_));
    springs_break = springs_break || (springs && booking.fracture);
    if (book_ && (plastic || fractures_ || plan.damping[p] > 0)) has = booking;
    kernel_.push_back(kernels[step::variant_number(has)]);
    composition_.push_back(has);
    booking_.push_back(kernels[step::variant_number(booking)]);
  }
  book_ = book_ && (damped || plastic || fractures_);
  inelastic_ = plastic || fractures_;
  const std::size_t blocks = layout_.blocks.size();
  if (cells_flow) plastic_.assign(blocks, step::PlasticBlock{});
  if (springs_flow) spring_flow_.assign(blocks, step::SpringFlow{});
  if (springs_break) springs_.assign(blocks, step::SpringBlock{});
}

std::optional<double> Stepper::elastic_energy(const State& state) {
  if (!inelastic_) return std::nullopt;
  const Memory kept = memory();
  const std::vector<step::ChunkKernel> kernels = kernel_;
  const bool book = book_;
  kernel_ = booking_;
  book_ = true;
  make_room_for_books();
  State copy = state;
  const StepOutcome outcome = advance(copy, {}, {0, 0, false});
  kernel_ = kernels;
  book_ = book;
  restore(kept);
  return outcome.elastic;
}

KernelShares Stepper::time_shares(const State& state) {
  const Memory kept = memory();
  const std::vector<step::ChunkKernel> kernels = kernel_;
  State copy = state;
  // `with`: damping, plasticity, fracture in this order, as many of them
  const auto seconds = [&](int with) {
    for (std::size_t kind = 0; kind < kernels.size(); ++kind) {
      step::Composition has = composition_[kind];
      const bool springs = std::find(table_->springs, table_->springs + step::kVariants, kernels[kind]) !=
                           table_->springs + step::kVariants;
      if (with < 1) has.damping = step::Damping::none;
      if (with < 2 && !springs) has.plasticity = false;
      if (with < 3 && !springs) has.fracture = false;
      kernel_[kind] = (springs ? table_->springs : table_->cells)[step::variant_number(has)];
    }
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kTimedRuns; ++i) {
      const auto began = std::chrono::steady_clock::now();
      (void)advance(copy, {}, {0, 0, false});
      least =
          std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
      restore(kept);
    }
    return least;
  };
  (void)seconds(3);
  const double all = seconds(3), flowing = seconds(2), damped = seconds(1), bare = seconds(0);
  kernel_ = kernels;
  const auto share = [&](double more, double less) { return std::max(0.0, (more - less) / all); };
  return {share(damped, bare), share(flowing, damped), share(all, flowing)};
}

std::size_t Stepper::bytes() const {
  return layout_.bytes() +
         sizeof(double) * (mass_.capacity() + inverse_mass_.capacity() + shared_force_.capacity() +
                           shared_damping_.capacity()) +
         plastic_.capacity() * sizeof(step::PlasticBlock) +
         spring_flow_.capacity() * sizeof(step::SpringFlow) + springs_.capacity() * sizeof(step::SpringBlock);
}

StepOutcome Stepper::advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance) {
  const step::StateView view{state.displacement.data()->data(), state.velocity.data()->data(),
                             outer.empty() ? nullptr : outer.data()->data(), inverse_mass_.data(),
                             book_ ? damping_force_.data()->data() : nullptr};
  const std::size_t doubles = step::kScratchColumns * step::scratch_stride(layout_.largest_chunk) +
                              step::kScratchAlignment / sizeof(double);
  const Lowest lowest = parallel_sum<Lowest>(
      layout_.chunks.size(),
      [&](std::size_t i) {
        thread_local std::vector<double> scratch;
        if (scratch.size() < doubles) scratch.resize(doubles);
        const StepLayout::Chunk& chunk = layout_.chunks[i];
        const step::ChunkView chunk_view{
            layout_.blocks.data() + chunk.block_begin,
            layout_.corners.data() + chunk.corner_begin,
            plastic_.empty() ? nullptr : plastic_.data() + chunk.block_begin,
            springs_.empty() ? nullptr : springs_.data() + chunk.block_begin,
            spring_flow_.empty() ? nullptr : spring_flow_.data() + chunk.block_begin,
            chunk.block_end - chunk.block_begin,
            layout_.runs.data() + chunk.run_begin,
            chunk.run_end - chunk.run_begin,
            layout_.cell_fill.data() + chunk.fill_begin,
            layout_.elements.data() + chunk.element_begin,
            chunk.element_end - chunk.element_begin,
            layout_.owned.data() + chunk.owned_begin,
            layout_.shared.data() + chunk.shared_begin,
            chunk.owned_end - chunk.owned_begin,
            chunk.shared_end - chunk.shared_begin,
            shared_force_.data() + 3 * chunk.shared_begin,
            book_ ? shared_damping_.data() + 3 * chunk.shared_begin : nullptr,
            &layout_.constants[chunk.kind]};
        const step::ChunkOutcome outcome =
            kernel_[chunk.kind](chunk_view, view, advance, step::first_aligned(scratch));
        return Lowest{outcome.smallest_jacobian, chunk.part,       outcome.elastic,
                      outcome.plastic_work,      outcome.released, outcome.broken};
      },
      1);
  StepOutcome outcome;
  outcome.smallest_jacobian = lowest.value;
  outcome.part = lowest.part;
  outcome.plastic_work = lowest.plastic_work;
  outcome.released = lowest.released;
  outcome.broken = lowest.broken;
  if (book_ && inelastic_) outcome.elastic = lowest.elastic;
  advance_shared(view, advance);
  advance_lone(view, advance);
  return outcome;
}

void Stepper::advance_shared(const step::StateView& view, const step::Advance& advance) {
  parallel_for_each(layout_.shared_elements.size(), [&](std::size_t i) {
    const std::span slots(layout_.slots.data() + layout_.slot_offsets[i],
                          layout_.slot_offsets[i + 1] - layout_.slot_offsets[i]);
    const std::uint32_t e = layout_.shared_elements[i];
    double force[3];
    add_slots(shared_force_, slots, force);
    move_element(e, force, view, advance);
    if (book_) add_slots(shared_damping_, slots, damping_force_[e].data());
  });
}

void Stepper::advance_lone(const step::StateView& view, const step::Advance& advance) {
  constexpr double none[3] = {0, 0, 0};
  parallel_for_each(layout_.lone_elements.size(),
                    [&](std::size_t i) { move_element(layout_.lone_elements[i], none, view, advance); });
}

}  // namespace flexel::simulate
