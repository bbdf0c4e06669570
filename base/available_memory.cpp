// Linux says it in /proc/meminfo.
#include "base/available_memory.h"

#include <fstream>
#include <limits>
#include <string>

namespace flexel {

double available_memory() {
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  double kibibytes = 0;
  while (file >> name >> kibibytes) {
    if (name == "MemAvailable:") return kibibytes * 1024;
    std::getline(file, unit);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace flexel
