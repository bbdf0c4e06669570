// Records as rows of numbers, by the numbers of points or by their positions.
#include "simulate/contact/pairs/pair_memory.h"

#include <algorithm>
#include <array>
#include <map>

namespace flexel::simulate {
namespace {

constexpr std::size_t kPerPoint = 7, kPerRecord = 7;

using PointName = std::array<double, kPerPoint>;

PointName name_of(const ContactPoint& point) {
  return {static_cast<double>(point.part),
          point.rest.x(),
          point.rest.y(),
          point.rest.z(),
          point.normal.x(),
          point.normal.y(),
          point.normal.z()};
}

void append(const PairRecord& record, std::vector<double>& values) {
  values.insert(values.end(), record.slip.begin(), record.slip.end());
  values.push_back(record.adhesion);
  values.push_back(static_cast<double>(record.phase));
  values.push_back(record.penetration);
  values.push_back(record.soft);
}

PairRecord record_of(std::uint64_t key, const double* values) {
  return {key,       Vec3(values[0], values[1], values[2]),
          values[3], static_cast<PairPhase>(static_cast<int>(values[4])),
          values[5], values[6]};
}

}  // namespace

void PairMemory::follow(const std::vector<ContactPair>& pairs) {
  std::vector<PairRecord> kept;
  kept.reserve(pairs.size());
  auto old = records_.begin();
  for (const ContactPair& pair : pairs) {
    while (old != records_.end() && old->key < pair.key) ++old;
    const bool known = old != records_.end() && old->key == pair.key;
    kept.push_back(known ? *old : PairRecord{pair.key});
    if (!(pair.properties.pull_off > 0)) kept.back().release_adhesion();
  }
  records_ = std::move(kept);
}

void PairMemory::save(std::vector<double>& values) const {
  for (const PairRecord& record : records_) {
    values.push_back(static_cast<double>(record.key >> 32));
    values.push_back(static_cast<double>(record.key & 0xffffffff));
    append(record, values);
  }
}

void PairMemory::restore(std::span<const double> values) {
  records_.clear();
  for (; values.size() >= kValues; values = values.subspan(kValues))
    records_.push_back(
        record_of(static_cast<std::uint64_t>(values[0]) << 32 | static_cast<std::uint64_t>(values[1]),
                  values.data() + 2));
}

void PairMemory::save_by_position(const std::vector<ContactPoint>& points,
                                  std::vector<double>& values) const {
  for (const PairRecord& record : records_) {
    if (record.phase == PairPhase::separated && record.penetration == 0) continue;
    const std::uint64_t j = record.key & 0xffffffff;
    const PointName one = name_of(points[record.key >> 32]);
    const PointName other =
        j >= points.size() ? PointName{-1, static_cast<double>(j - points.size())} : name_of(points[j]);
    values.insert(values.end(), one.begin(), one.end());
    values.insert(values.end(), other.begin(), other.end());
    append(record, values);
  }
}

void PairMemory::restore_by_position(const std::vector<ContactPoint>& points, std::size_t planes,
                                     std::span<const double> values) {
  std::map<PointName, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < points.size(); ++i) numbers.try_emplace(name_of(points[i]), i);
  for (std::size_t p = 0; p < planes; ++p)
    numbers.try_emplace({-1, static_cast<double>(p)}, static_cast<std::uint32_t>(points.size() + p));
  const auto number = [&](std::size_t at) {
    PointName name;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(at), kPerPoint, name.begin());
    return numbers.find(name);
  };
  records_.clear();
  for (; values.size() >= 2 * kPerPoint + kPerRecord; values = values.subspan(2 * kPerPoint + kPerRecord)) {
    const auto one = number(0), other = number(kPerPoint);
    if (one == numbers.end() || other == numbers.end()) continue;
    const std::uint64_t i = one->second, j = other->second;
    PairRecord record = record_of(std::min(i, j) << 32 | std::max(i, j), values.data() + 2 * kPerPoint);
    if (!(i < j)) record.slip = -1 * record.slip;
    records_.push_back(record);
  }
  std::sort(records_.begin(), records_.end(),
            [](const PairRecord& a, const PairRecord& b) { return a.key < b.key; });
}

}  // namespace flexel::simulate
