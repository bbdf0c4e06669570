// All pairs are looked through only now and then, for those that are due soon.
#include "simulate/contact/pairs/pair_schedule.h"

#include <algorithm>
#include <iterator>
#include <numeric>

namespace flexel::simulate {
namespace {

constexpr double kLeastPath = 0.001, kLeastTurn = 0.0002;   // spacings and changes, of a body in a step
constexpr double kHorizonPath = 0.05, kHorizonTurn = 0.02;  // of a pair

}  // namespace

void PairSchedule::reset(const std::vector<Bodies>& pairs, std::size_t bodies, double spacing) {
  couples_.clear();
  std::unique_copy(pairs.begin(), pairs.end(), std::back_inserter(couples_));
  std::sort(couples_.begin(), couples_.end());
  couples_.erase(std::unique(couples_.begin(), couples_.end()), couples_.end());
  couple_.resize(pairs.size());
  for (std::size_t p = 0; p < pairs.size(); ++p)
    couple_[p] = p > 0 && pairs[p] == pairs[p - 1]
                     ? couple_[p - 1]
                     : static_cast<std::uint32_t>(
                           std::lower_bound(couples_.begin(), couples_.end(), pairs[p]) - couples_.begin());
  spacing_ = spacing;
  due_.resize(pairs.size());
  sum_.assign(bodies, {});
  reach_.assign(bodies, {kLeastPath * spacing, kLeastPath * spacing, kLeastTurn});
  find_sums();
  wake_all();
}

void PairSchedule::wake_all() {
  std::fill(due_.begin(), due_.end(), SafeMotion{0, 0});
  awake_.resize(couple_.size());
  std::iota(awake_.begin(), awake_.end(), std::uint32_t{0});
  left_ = {0, 0};
  soon_.clear();
}

void PairSchedule::wake(std::uint32_t pair) {
  keep_awake(pair);
  const auto at = std::lower_bound(soon_.begin(), soon_.end(), pair);
  if (at == soon_.end() || *at != pair) soon_.insert(at, pair);
}

SafeMotion PairSchedule::sums(const Bodies& of, const std::vector<BodyMotion>& motions) {
  const BodyMotion &a = motions[of[0]], &b = motions[of[1]];
  return {of[0] == of[1] ? 2 * a.spread : a.path + b.path, a.turn + b.turn};
}

void PairSchedule::find_sums() {
  now_.resize(couples_.size());
  next_.resize(couples_.size());
  for (std::size_t c = 0; c < couples_.size(); ++c) {
    const SafeMotion next = sums(couples_[c], reach_);
    now_[c] = sums(couples_[c], sum_);
    next_[c] = {now_[c].path + next.path, now_[c].turn + next.turn};
  }
}

bool PairSchedule::sleep(std::uint32_t pair, const SafeMotion& safe) {
  const SafeMotion& now = now_[couple_[pair]];
  due_[pair] = {now.path + safe.path, now.turn + safe.turn};
  return sleeps(pair);
}

void PairSchedule::advance(std::span<const BodyMotion> motions) {
  SafeMotion most{0, 0};
  for (std::size_t b = 0; b < sum_.size(); ++b) {
    const BodyMotion& now = motions[b];
    sum_[b].path += now.path;
    sum_[b].spread += now.spread;
    sum_[b].turn += now.turn;
    reach_[b] = {2 * now.path + kLeastPath * spacing_, 2 * now.spread + kLeastPath * spacing_,
                 2 * now.turn + kLeastTurn};
    most = {std::max({most.path, reach_[b].path, reach_[b].spread}), std::max(most.turn, reach_[b].turn)};
  }
  find_sums();
  // reach_ is more than twice the motion: it pays for what the sums grow by and for the next reach
  left_.path -= 2 * most.path;
  left_.turn -= 2 * most.turn;
  if (!(left_.path > 0) || !(left_.turn > 0)) {
    left_ = {kHorizonPath * spacing_, kHorizonTurn};
    ahead_ = next_;
    for (SafeMotion& each : ahead_) each = {each.path + left_.path, each.turn + left_.turn};
    soon_.clear();
    for (std::uint32_t p = 0; p < couple_.size(); ++p)
      if (due(p, ahead_)) soon_.push_back(p);
  }
  awake_.clear();
  for (const std::uint32_t p : soon_)
    if (due(p, next_)) awake_.push_back(p);
}

}  // namespace flexel::simulate
