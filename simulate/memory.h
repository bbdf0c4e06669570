// What a run will take, told before it is taken.
#pragma once
#include <optional>

#include "formats/lattice/body.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Bytes of the whole process at the most that it will hold at once: within a third of what was measured
// (tests/programs/limits_test.py). Nothing where that is not known: contact, rigid parts, implicit steps, several
// models, vibrations and buckling in model `quadratic`.
[[nodiscard]] std::optional<double> memory_needed(const Body& body, const Scene& scene);

// Throws InputError(scene, ...) where that is beyond memory_to_use() (base/resources.h) by more than the
// estimate may be off.
void refuse_beyond_memory(const Body& body, const Scene& scene);

}  // namespace flexel::simulate
