// The memory that a kernel computes in (time/kernel.h).
#pragma once
#include <cstdint>
#include <vector>

#include "simulate/kernels/kernel.h"

namespace flexel::simulate::step {

// The first double of `scratch` whose address is a multiple of kScratchAlignment.
[[nodiscard]] inline double* first_aligned(std::vector<double>& scratch) {
  const auto address = reinterpret_cast<std::uintptr_t>(scratch.data());
  return scratch.data() +
         (kScratchAlignment - address % kScratchAlignment) % kScratchAlignment / sizeof(double);
}

}  // namespace flexel::simulate::step
