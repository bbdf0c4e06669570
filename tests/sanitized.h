// Long simulations test numbers, and under the sanitizers take twenty times as long: there a shorter one goes the
// same ways through memory.
#pragma once
#include <cstdio>

// Asked when the program runs: the tests' own objects may be those of a tree without sanitizers (FLEXEL_TEST_OBJECTS).
extern "C" void __asan_init() __attribute__((weak));

namespace flexel {

// Whether the code under test is under the address sanitizer.
inline bool sanitized() {
  return __asan_init != nullptr;
}

// `whole`, or under the sanitizers `less`, and a line that says so.
template <class T>
T less_if_sanitized(T whole, T less, const char* what) {
  if (sanitized()) std::printf("under the sanitizers %s\n", what);
  return sanitized() ? less : whole;
}

}  // namespace flexel
