// What a run will take beside what it may.
#pragma once
#include <cstddef>
#include <string>

#include "formats/lattice/body.h"

namespace flexel::simulate {

// Bytes of the whole process at the most that it will hold at once, off by up to a third
// (tests/programs/limits_test.py).
struct MemoryNeeded {
  double bytes = 0;
  double with_large_deflections =
      0;  // the same, but in model `quadratic`, where cells that turn take more: up to this
};

// Of model `quadratic` with `held` cells that supports or bonds hold.
[[nodiscard]] MemoryNeeded quadratic_memory(const Body& body, std::size_t held);

// Of a timed run with explicit steps, without contact.
[[nodiscard]] double moving_memory(double elements);

// Throws InputError(scene, ...) where `bytes` are more than --max-memory, or than the memory that is free, by more than the
// estimate may be off; `what` is told in brackets.
void refuse_beyond_memory(double bytes, const std::string& what, const std::string& scene);

}  // namespace flexel::simulate
