// Run-time choice of the instruction set, for kernels that are compiled once for each.
#pragma once

namespace flexel {

enum class InstructionSet { portable, avx2, avx512 };

// Whether this machine supports it.
[[nodiscard]] inline bool runs(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2");
#endif
  return set == InstructionSet::portable;
}

// The table of the best instruction set that this machine supports. The other functions are not called: they
// may themselves contain instructions that it lacks.
template <class Table>
[[nodiscard]] const Table& best_table(const Table& (*portable)(), const Table& (*avx2)(),
                                      const Table& (*avx512)()) {
  if (runs(InstructionSet::avx512)) return avx512();
  if (runs(InstructionSet::avx2)) return avx2();
  return portable();
}

}  // namespace flexel
