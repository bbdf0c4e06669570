// How a program of ours that fails tells its exit code to the next one in a pipe, without a byte in the pipe.
//
// A shell gives the exit code of the last program of a pipe, which sees no more than an empty stdin. So a
// program that fails, and has written nothing, leaves the pipe with a capacity that stands for its exit code
// (fcntl F_SETPIPE_SZ, Linux); one that finds its stdin empty looks for that. Any other reader sees an empty
// pipe. Where the capacity cannot be set, or says nothing, all is as it is without it.
#pragma once
#include <optional>

namespace flexel {

// Safe in a signal handler. Nothing happens where `descriptor` is no pipe, or the code is none of those that
// can be told: 1, 2, 3, 5, 130, 139.
void tell_code_through_pipe(int descriptor, int code) noexcept;

[[nodiscard]] std::optional<int> code_told_through_pipe(int descriptor) noexcept;

}  // namespace flexel
