// Linux says what is free in /proc/meminfo, and counts private writable memory against RLIMIT_DATA (4.7 and later).
#include "base/resources.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <thread>

#include "base/error.h"
#include "base/stop.h"
#include "base/units.h"

namespace flexel {
namespace {

double most_bytes = std::numeric_limits<double>::infinity();
double most_elements = std::numeric_limits<double>::infinity();

double free_memory() {
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  double kibibytes = 0;
  while (file >> name >> kibibytes) {
    if (name == "MemAvailable:") return kibibytes * 1024;
    std::getline(file, unit);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

double available_memory() {
  return std::min(free_memory(), most_bytes);
}

void limit_memory(double bytes) {
  most_bytes = bytes;
  constexpr double kStack = 8.4e6;  // bytes a thread, reserved and hardly used
  const double all = bytes + kStack * (1 + std::thread::hardware_concurrency());
  rlimit limit = {};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(std::min(all, 1e18)));
  setrlimit(RLIMIT_DATA, &limit);
}

double memory_limit() {
  return most_bytes;
}

double memory_to_use() {
  return std::isfinite(most_bytes) ? most_bytes : .8 * free_memory();
}

void limit_elements(std::size_t elements) {
  most_elements = static_cast<double>(elements);
}

double element_limit() {
  return most_elements;
}

void check_elements(double elements, const std::string& where) {
  if (elements <= most_elements) return;
  throw InputError(
      where, fmt::format("{} elements are more than --max-elements {}: take a larger spacing, or raise it",
                         human_count(static_cast<std::size_t>(std::min(elements, 1e18))),
                         human_count(static_cast<std::size_t>(most_elements))));
}

double time_left() noexcept {
  const std::int64_t limit = stop_detail::nearest_limit.load(std::memory_order_relaxed);
  return limit == stop_detail::kNever ? std::numeric_limits<double>::infinity()
                                      : 1e-9 * static_cast<double>(limit - stop_detail::now());
}

}  // namespace flexel
