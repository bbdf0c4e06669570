// How much time a time limit leaves (base/stop.h), for work that is worth only a share of it.
#pragma once

namespace flexel {

// s, until the nearest time limit, whoever set it; infinite without one, below zero once it is over.
[[nodiscard]] double seconds_left() noexcept;

}  // namespace flexel
