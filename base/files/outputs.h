// The files that a command writes: checked against each other and its inputs before it starts, and renamed to
// their final names together when it ends.
#pragma once
#include <string>
#include <vector>

namespace flexel {

struct OutputName {
  std::string path;     // "": none; with "{part}" or "{frame}" a pattern, which is not compared
  bool binary = false;  // refused where stdout is a terminal
};

// Throws InputError: an output that cannot be written, two that are one file (by links too) or both stdout,
// and, without `force`, one that is an input. Devices may be given twice.
void check_outputs(const std::vector<OutputName>& outputs, const std::vector<std::string>& inputs,
                   bool force);

// While one lives, OutputFiles to `paths` are written, but appear under their names only by appear(): a disk
// that is full at the second leaves the first as it was. Not to be nested.
class OutputsTogether {
 public:
  explicit OutputsTogether(std::vector<std::string> paths);
  ~OutputsTogether();
  OutputsTogether(const OutputsTogether&) = delete;
  OutputsTogether& operator=(const OutputsTogether&) = delete;
  // Throws InputError: a file cannot be renamed.
  void appear();

 private:
  friend class OutputFile;
  struct Waiting {
    std::string path, temporary, target;
  };
  static bool takes(const std::string& path, const std::string& temporary, const std::string& target);
  static OutputsTogether* present_;
  std::vector<std::string> paths_;
  std::vector<Waiting> waiting_;
};

}  // namespace flexel
