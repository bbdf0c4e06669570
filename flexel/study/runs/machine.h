// The machine that a study ran on.
#pragma once
#include <string>

namespace flexel::study {

struct Machine {
  std::string processor, system, version;  // of Flexel
  int cores = 1;
  double memory = 0;         // bytes
  double load_at_start = 0;  // runnable processes, mean of a minute
  std::string date;          // UTC, ISO 8601
};
[[nodiscard]] Machine this_machine();

}  // namespace flexel::study
