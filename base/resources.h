// What this process may take: memory, elements and time (--max-memory, --max-elements, --timeout; base/program/arguments.h).
#pragma once
#include <cstddef>
#include <string>

namespace flexel {

// Bytes that can be used without swapping (MemAvailable), and no more than limit_memory() allows; infinite
// where neither says.
[[nodiscard]] double available_memory();

// From now on allocations beyond so many bytes fail with std::bad_alloc, here and in children started later, the stacks of
// threads not counted. `bytes` > 0.
void limit_memory(double bytes);
[[nodiscard]] double memory_limit();  // infinite: none
// Bytes that work may be sure to need before it is refused: the limit, or 80 % of what is free.
[[nodiscard]] double memory_to_use();

// From now on bodies of more elements are refused.
void limit_elements(std::size_t elements);
[[nodiscard]] double element_limit();  // infinite: none
// Throws InputError(where, ...): `elements` are more than the limit. For estimates before the work, and for what a file says.
void check_elements(double elements, const std::string& where);

// s, until the nearest time limit (base/stop.h), whoever set it: for work that is worth only a share of it. Infinite without one,
// below zero once it is over.
[[nodiscard]] double time_left() noexcept;

}  // namespace flexel
