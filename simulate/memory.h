// What a run will take, told before it is taken.
#pragma once
#include <cstddef>
#include <optional>
#include <string>

#include "formats/lattice/body.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Bytes of the whole process at the most that it will hold at once, off by up to a third
// (tests/programs/limits_test.py).
struct MemoryNeeded {
  double bytes = 0;
  double with_large_deflections = 0;  // the same, but in model `quadratic`, where cells that turn take more
};

// Nothing where that is not known: contact, rigid parts, implicit steps, several models, vibrations and buckling in model
// `quadratic`. Of model `quadratic` the cells that supports or bonds hold are not counted, which are found by the run:
// some tenth, but where a large face is held.
[[nodiscard]] std::optional<MemoryNeeded> memory_needed(const Body& body, const Scene& scene);

// Of model `quadratic` with `held` cells that supports or bonds hold.
[[nodiscard]] MemoryNeeded quadratic_memory(const Body& body, std::size_t held);

// Throws InputError(scene, ...) where `bytes` are more than --max-memory, or than the memory that is free, by more than the
// estimate may be off; `what` is told in brackets.
void refuse_beyond_memory(double bytes, const std::string& what, const std::string& scene);
// By what the run takes at the least: small deflections.
void refuse_beyond_memory(const Body& body, const Scene& scene);

}  // namespace flexel::simulate
