// Long simulations test numbers, and under the sanitizers take twenty times as long: there a shorter one goes the
// same ways through memory.
#pragma once
#include <cstdio>

namespace flexel {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// `whole`, or under the sanitizers `less`, and a line that says so.
template <class T>
T less_if_sanitized(T whole, T less, const char* what) {
  if (kSanitized) std::printf("under the sanitizers %s\n", what);
  return kSanitized ? less : whole;
}

}  // namespace flexel
