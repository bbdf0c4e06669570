// One input given to a reader, as both drivers do it.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/files/files.h"

namespace flexel::fuzz {

class Trial {
 public:
  enum class Outcome { accepted, refused, failed };

  // `name` of the fuzzer; its inputs are written to one file of the temporary folder (/dev/shm where there is one).
  Trial(std::string name, std::function<void(const std::string& path)> read);

  // Gives it to the reader. failed, and a line on stderr: an exception that is no InputError, or that gives no reason.
  [[nodiscard]] Outcome operator()(std::span<const std::byte> data) const;
  // `corpus` and what lies in tests/fuzz/corpus/NAME, each of which is tried. Ends the program where a good input is
  // not accepted, for that would test nothing, or one of the folder fails.
  [[nodiscard]] std::vector<Bytes> seeds(const std::vector<Bytes>& corpus) const;
  [[nodiscard]] const std::string& path() const { return path_; }
  void clean() const;

 private:
  std::string name_, path_;
  mutable std::string reason_;  // of the last refusal
  std::function<void(const std::string& path)> read_;
};

}  // namespace flexel::fuzz
