// Describes the machine that a study's times were measured on.
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <thread>

#include "base/error.h"
#include "base/version.h"
#include "flexel/study/runs/machine.h"

namespace flexel::study {

Machine this_machine() {
  Machine machine;
  machine.version = version();
  machine.cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  machine.memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  std::ifstream processors("/proc/cpuinfo");
  machine.processor = "unknown processor";
  for (std::string line; std::getline(processors, line);)
    if (line.rfind("model name", 0) == 0) {
      machine.processor = line.substr(line.find(':') + 2);
      break;
    }
  utsname names = {};
  if (uname(&names) == 0) machine.system = fmt::format("{} {}", names.sysname, names.release);
  std::ifstream("/proc/loadavg") >> machine.load_at_start;
  const std::time_t now = std::time(nullptr);
  std::tm utc = {};
  gmtime_r(&now, &utc);
  char text[32] = {};
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  machine.date = text;
  return machine;
}

}  // namespace flexel::study
