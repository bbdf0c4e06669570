// The files that a command writes: checked against each other and its inputs before it starts, and renamed to
// their final names together when it ends.
#pragma once
#include <string>
#include <vector>

#include "base/files/output_file.h"

namespace flexel {

struct OutputName {
  std::string path;     // "": none; with "{part}" or "{frame}" a pattern, which is not compared
  bool binary = false;  // refused where stdout is a terminal
};

// Throws InputError: an output that cannot be written, two that are one file (by links too) or both stdout,
// and, without `force`, one that is an input, or a series (.pvd) with a frame that is one. Devices may be given twice.
void check_outputs(const std::vector<OutputName>& outputs, const std::vector<std::string>& inputs,
                   bool force);

}  // namespace flexel
