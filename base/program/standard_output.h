// Text for stdout whose reader may be gone or whose disk may be full.
#pragma once
#include <string>

namespace flexel {

// Returns when what was printed to stdout has arrived. Throws ReaderClosedPipe, InputError("stdout", why).
void flush_stdout();
// Prints and flushes.
void print_to_stdout(const std::string& text);

}  // namespace flexel
