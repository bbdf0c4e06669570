// How much memory a run may take.
#pragma once

namespace flexel {

// Bytes that can be used without swapping (MemAvailable); infinite where the system does not say.
[[nodiscard]] double available_memory();

}  // namespace flexel
