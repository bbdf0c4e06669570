// Two passes over the body per step: chunks with what they own, then the elements that several chunks share.
#include "simulate/time/stepper.h"

#include <fmt/format.h>

#include <limits>

#include "formats/error.h"
#include "formats/parallel.h"

namespace flexel {
namespace {

bool machine_has(const char* isa) {
#if defined(__x86_64__)
  const std::string name = isa;
  if (name == "avx512")
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  if (name == "avx2") return __builtin_cpu_supports("avx2");
  return name == "portable";
#else
  return std::string(isa) == "portable";
#endif
}

std::vector<const step::KernelTable*> tables() {  // the best one first
#if defined(__x86_64__)
  return {&step::kernels_avx512(), &step::kernels_avx2(), &step::kernels_portable()};
#else
  return {&step::kernels_portable()};
#endif
}

struct Lowest {
  double value = std::numeric_limits<double>::infinity();
  std::uint32_t part = 0;
  Lowest& operator+=(const Lowest& other) {
    if (other.value < value) {
      value = other.value;
      part = other.part;
    }
    return *this;
  }
};

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
    if (!machine_has(table->isa)) continue;
    if (isa.empty() || isa == table->isa) return *table;
    have += have.empty() ? table->isa : fmt::format(", {}", table->isa);
  }
  throw InputError(fmt::format("--isa \"{}\": this machine runs {}", isa, have));
}

Stepper::Stepper(const Setting& setting, const std::vector<double>& damping, bool book,
                 const std::string& isa)
    : layout_(step_layout(setting, damping)),
      table_(&kernel_table(isa)),
      mass_(lumped_masses(setting)),
      inverse_mass_(mass_.size()),
      shared_force_(3 * layout_.shared.size()),
      book_(book) {
  for (std::size_t e = 0; e < mass_.size(); ++e) inverse_mass_[e] = mass_[e] > 0 ? 1 / mass_[e] : 0;
  bool damped = false;
  for (std::size_t p = 0; p < damping.size(); ++p) {
    const bool springs = setting.models.size() > p && setting.models[p] == Model::springs;
    const step::Damping kind =
        damping[p] > 0 ? book ? step::Damping::book : step::Damping::plain : step::Damping::none;
    damped = damped || damping[p] > 0;
    kernel_.push_back((springs ? table_->springs : table_->cells)[static_cast<std::size_t>(kind)]);
  }
  book_ = book && damped;
  if (book_) {
    shared_damping_.assign(shared_force_.size(), 0);
    damping_force_.assign(mass_.size(), Vec3::Zero());
  }
}

std::size_t Stepper::bytes() const {
  return layout_.bytes() + sizeof(double) * (mass_.capacity() + inverse_mass_.capacity() +
                                             shared_force_.capacity() + shared_damping_.capacity());
}

StepOutcome Stepper::advance(State& state, const std::vector<Vec3>& outer, const step::Advance& advance) {
  const step::StateView view{state.displacement.data()->data(), state.velocity.data()->data(),
                             outer.empty() ? nullptr : outer.data()->data(), inverse_mass_.data(),
                             book_ ? damping_force_.data()->data() : nullptr};
  const std::size_t doubles = step::kScratchColumns * step::scratch_stride(layout_.largest_chunk);
  const Lowest lowest = parallel_sum<Lowest>(
      layout_.chunks.size(),
      [&](std::size_t i) {
        thread_local std::vector<double> scratch;
        if (scratch.size() < doubles) scratch.resize(doubles);
        const StepLayout::Chunk& chunk = layout_.chunks[i];
        const step::ChunkView chunk_view{layout_.blocks.data() + chunk.block_begin,
                                         chunk.block_end - chunk.block_begin,
                                         layout_.elements.data() + chunk.element_begin,
                                         chunk.element_end - chunk.element_begin,
                                         layout_.owned.data() + chunk.owned_begin,
                                         layout_.shared.data() + chunk.shared_begin,
                                         chunk.owned_end - chunk.owned_begin,
                                         chunk.shared_end - chunk.shared_begin,
                                         shared_force_.data() + 3 * chunk.shared_begin,
                                         book_ ? shared_damping_.data() + 3 * chunk.shared_begin : nullptr,
                                         &layout_.constants[chunk.part]};
        const step::ChunkOutcome outcome = kernel_[chunk.part](chunk_view, view, advance, scratch.data());
        return Lowest{outcome.smallest_jacobian, chunk.part};
      },
      1);
  StepOutcome outcome;
  outcome.smallest_jacobian = lowest.value;
  outcome.part = lowest.part;
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

}  // namespace flexel
