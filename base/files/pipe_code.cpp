// Capacities are powers of two from a page to a megabyte. Three of them encode nothing: the default (64 KiB),
// the one that OutputFile sets (1 MiB), and the one left to a user of very many pipes (8 KiB).
#include "base/files/pipe_code.h"

#include <fcntl.h>

#include <utility>

#include "base/error.h"

namespace flexel {
namespace {

constexpr int kCrashed = 128 + 11;
constexpr std::pair<int, int> kCapacityOfCode[] = {{kExitOurFault, 4096},      {kExitInput, 16384},
                                                   {kExitDiverged, 32768},     {kExitTimeout, 131072},
                                                   {kExitInterrupted, 262144}, {kCrashed, 524288}};

}  // namespace

void tell_code_through_pipe(int descriptor, int code) noexcept {
  for (const auto& [each, capacity] : kCapacityOfCode)
    if (each == code) (void)::fcntl(descriptor, F_SETPIPE_SZ, capacity);
}

std::optional<int> code_told_through_pipe(int descriptor) noexcept {
  const int found = ::fcntl(descriptor, F_GETPIPE_SZ);
  for (const auto& [code, capacity] : kCapacityOfCode)
    if (found == capacity) return code;
  return std::nullopt;
}

}  // namespace flexel
