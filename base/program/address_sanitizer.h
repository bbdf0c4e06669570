// FLEXEL_ADDRESS_SANITIZER is defined where the address sanitizer is compiled in: GCC and clang say so each in its own way.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define FLEXEL_ADDRESS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define FLEXEL_ADDRESS_SANITIZER
#endif
#endif
