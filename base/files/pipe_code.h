// Passes the exit code of a failed Flexel program to the next one in a pipe, without writing to the pipe.
//
// A shell reports the exit code of the last program of a pipe, which sees only an empty stdin. So a program
// that fails before it has written anything sets the pipe's capacity (fcntl F_SETPIPE_SZ, Linux) to a value
// that encodes its exit code, and a program whose stdin is empty reads the capacity. Other readers just see
// an empty pipe. Where the capacity cannot be set, no code is passed.
#pragma once
#include <optional>

namespace flexel {

// Safe in a signal handler. Does nothing where `descriptor` is no pipe, or `code` is not one of 1, 2, 3, 5,
// 130, 139.
void tell_code_through_pipe(int descriptor, int code) noexcept;

[[nodiscard]] std::optional<int> code_told_through_pipe(int descriptor) noexcept;

}  // namespace flexel
