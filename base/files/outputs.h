// The files that a command writes: checked against each other and its inputs before it starts, and renamed to
// their final names together when it ends.
#pragma once
#include <string>
#include <vector>

#include "base/files/output_file.h"

namespace flexel {

struct OutputName {
  // "": none; with "{part}" or "{frame}" a pattern, which is not compared with other outputs; NAME.pvd: its frames too
  std::string path;
  bool binary = false;   // refused where stdout is a terminal
  bool literal = false;  // braces are part of the name
};

// Files that are there and that a result to `path` would replace or, of many files, may: frames NAME_00012.vtu of NAME.pvd,
// any text in place of "{part}" and "{frame}".
[[nodiscard]] std::vector<std::string> files_replaced(const std::string& path, bool literal = false);

// Throws InputError: an output that cannot be written, two that are one file (by links too) or both stdout,
// and, without `force`, one that is an input or may replace one (files_replaced). Devices may be given twice.
void check_outputs(const std::vector<OutputName>& outputs, const std::vector<std::string>& inputs,
                   bool force);

}  // namespace flexel
