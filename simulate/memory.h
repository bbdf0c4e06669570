// What a run will take, told before it is taken.
#pragma once
#include <optional>

#include "formats/lattice/body.h"
#include "simulate/result/memory_limit.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Nothing where that is not known: vibrations and buckling in model `quadratic`, `quadratic` or `paper` beside another model. Of model `quadratic` the cells that supports or bonds hold are not counted, which are found by the run:
// some tenth, but where a large face is held.
[[nodiscard]] std::optional<MemoryNeeded> memory_needed(const Body& body, const Scene& scene);

// Throws InputError as in memory_limit.h; by what the run takes at the least: small deflections.
void refuse_beyond_memory(const Body& body, const Scene& scene);

}  // namespace flexel::simulate
