// A last vector that has no other beside it is added twice: least and largest stay as they are.
#include "simulate/contact/pairs/element_runs.h"

#include <algorithm>
#include <cstring>

namespace flexel::simulate {
namespace {

constexpr std::size_t kBytes = sizeof(Vec3);
static_assert(kBytes == 3 * sizeof(double));

}  // namespace

std::vector<ElementRun> element_runs(const std::vector<std::uint32_t>& elements,
                                     const std::vector<Part>& parts) {
  std::vector<ElementRun> runs;
  std::uint32_t part = 0;
  for (std::uint32_t place = 0; place < elements.size(); ++place) {
    const std::uint32_t element = elements[place], before = part;
    while (element >= parts[part].element_end) ++part;
    if (runs.empty() || part != before || element != runs.back().first + runs.back().count)
      runs.push_back({part, element, place, 0});
    ++runs.back().count;
  }
  return runs;
}

void gather(const std::vector<ElementRun>& runs, const std::vector<Vec3>& values, std::vector<Vec3>& listed) {
  for (const ElementRun& run : runs)
    std::copy_n(values.begin() + run.first, run.count, listed.begin() + run.place);
}

bool same_bits(const std::vector<ElementRun>& runs, const std::vector<Vec3>& values,
               const std::vector<Vec3>& listed) {
  return std::all_of(runs.begin(), runs.end(), [&](const ElementRun& run) {
    return std::memcmp(values[run.first].data(), listed[run.place].data(), kBytes * run.count) == 0;
  });
}

void WideBox::add(std::span<const Vec3> values) {
  const auto take = [&](const Two& two) {
    min_ = min_.min(two);
    max_ = max_.max(two);
  };
  std::size_t n = 0;
  for (; n + 1 < values.size(); n += 2) take(Eigen::Map<const Two>(values[n].data()));
  if (n < values.size()) take((Two() << values[n], values[n]).finished());
}

void WideBox::add_differences(std::span<const Vec3> values, std::span<const Vec3> from) {
  const auto take = [&](const Two& two) {
    min_ = min_.min(two);
    max_ = max_.max(two);
  };
  std::size_t n = 0;
  for (; n + 1 < values.size(); n += 2)
    take(Eigen::Map<const Two>(values[n].data()) - Eigen::Map<const Two>(from[n].data()));
  if (n < values.size()) {
    const Vec3 last = values[n] - from[n];
    take((Two() << last, last).finished());
  }
}

Box WideBox::box() const {
  Box box;
  box.min = min_.head<3>().min(min_.tail<3>());
  box.max = max_.head<3>().max(max_.tail<3>());
  return box;
}

}  // namespace flexel::simulate
