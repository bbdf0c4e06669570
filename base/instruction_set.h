// Which instruction set the kernels that are compiled several times run with.
#pragma once

namespace flexel {

enum class InstructionSet { portable, avx2, avx512 };

// Whether this machine has it.
[[nodiscard]] inline bool runs(InstructionSet set) {
#if defined(__x86_64__)
  if (set == InstructionSet::avx512)
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
  if (set == InstructionSet::avx2) return __builtin_cpu_supports("avx2");
#endif
  return set == InstructionSet::portable;
}

// Calls the best one's function; the others are not so much as asked for, since what fills in a table may be
// compiled for its instruction set too.
template <class Table>
[[nodiscard]] const Table& best_table(const Table& (*portable)(), const Table& (*avx2)(),
                                      const Table& (*avx512)()) {
  if (runs(InstructionSet::avx512)) return avx512();
  if (runs(InstructionSet::avx2)) return avx2();
  return portable();
}

}  // namespace flexel
