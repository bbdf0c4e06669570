// What contact, friction and glue remember, from one body to the next that an event has made of it. Points
// have other numbers there, so they are known by their part, place and normal at rest, a plane by -1 and its
// number. First the times when the parts joined, behind their number; then the pairs, both names and what
// they remember.
#include <algorithm>
#include <array>
#include <map>

#include "simulate/contact/contacts.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kOfPoint = 7, kOfPair = 2 * kOfPoint + 6;

using PointName = std::array<double, kOfPoint>;

PointName name_of(const ContactPoint& point) {
  return {static_cast<double>(point.part),
          point.rest.x(),
          point.rest.y(),
          point.rest.z(),
          point.normal.x(),
          point.normal.y(),
          point.normal.z()};
}

}  // namespace

std::vector<double> Contacts::transfer_state() const {
  std::vector<double> kept{static_cast<double>(joined_.size())};
  kept.insert(kept.end(), joined_.begin(), joined_.end());
  for (const Memory& memory : memory_) {
    if (memory.standing == PairPhase::apart && memory.inside == 0) continue;
    const std::uint64_t j = memory.key & 0xffffffff;
    const bool plane = j >= points_.size();
    const PointName one = name_of(points_[memory.key >> 32]);
    const PointName other =
        plane ? PointName{-1, static_cast<double>(j - points_.size())} : name_of(points_[j]);
    kept.insert(kept.end(), one.begin(), one.end());
    kept.insert(kept.end(), other.begin(), other.end());
    kept.insert(kept.end(), memory.stretch.begin(), memory.stretch.end());
    kept.push_back(memory.stuck);
    kept.push_back(static_cast<double>(memory.standing));
    kept.push_back(memory.inside);
  }
  return kept;
}

void Contacts::restore_from(const std::vector<double>& transfer_state) {
  std::map<PointName, std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < points_.size(); ++i) numbers.try_emplace(name_of(points_[i]), i);
  for (std::uint32_t p = 0; p < settings_.planes.size(); ++p)
    numbers.try_emplace({-1, static_cast<double>(p)}, static_cast<std::uint32_t>(points_.size() + p));
  memory_.clear();
  if (transfer_state.empty()) return;
  const double* pairs = transfer_state.data() + 1 + static_cast<std::size_t>(transfer_state[0]);
  joined_.assign(transfer_state.data() + 1, pairs);
  for (std::size_t at = static_cast<std::size_t>(pairs - transfer_state.data());
       at + kOfPair <= transfer_state.size(); at += kOfPair) {
    const double* from = transfer_state.data() + at;
    std::array<std::uint64_t, 2> ends{};
    bool there = true;
    for (std::size_t side = 0; side < 2; ++side, from += kOfPoint) {
      PointName name;
      std::copy(from, from + kOfPoint, name.begin());
      const auto found = numbers.find(name);
      there = there && found != numbers.end();
      if (there) ends[side] = found->second;
    }
    if (!there) continue;
    const Vec3 stretch = (ends[0] < ends[1] ? 1 : -1) * Vec3(from[0], from[1], from[2]);
    memory_.push_back({std::min(ends[0], ends[1]) << 32 | std::max(ends[0], ends[1]), stretch, from[3],
                       static_cast<PairPhase>(static_cast<int>(from[4])), from[5]});
  }
  std::sort(memory_.begin(), memory_.end(), [](const Memory& a, const Memory& b) { return a.key < b.key; });
}

}  // namespace flexel::simulate
