// Which pairs a step has to look at: most candidates are far from touching, and bounds on the motion since a
// pair was looked at last tell that they still are.
//
// Bodies are the parts and, behind them, the planes as one. In a step a body goes by at most its path p beside a
// way common to all, by at most its spread s beside its own mean way, and the deformation gradients of its cells
// change by at most t. A pair (a, b) sleeps until the sums of p_a + p_b (within a part: 2 s) or of t_a + t_b since
// then have reached what it can bear.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace flexel::simulate {

struct BodyMotion {
  double path = 0, spread = 0;  // m
  double turn = 0;
};

// What a pair can bear before it may press.
struct SafeMotion {
  double path = 0;  // m
  double turn = std::numeric_limits<double>::infinity();
};

class PairSchedule {
 public:
  using Bodies = std::array<std::uint32_t, 2>;

  // To a new list of pairs of those bodies, all of them awake; `spacing` [m]: the narrowest.
  void reset(const std::vector<Bodies>& pairs, std::size_t bodies, double spacing);
  // After a step; the next one may go twice as far.
  void advance(std::span<const BodyMotion> motions);
  void wake_all();

  // Lets the pair sleep if that is worth while; whether it does. Parallel, one call a pair.
  bool sleep(std::uint32_t pair, const SafeMotion& safe);
  void keep_awake(std::uint32_t pair) { due_[pair] = {0, 0}; }  // likewise
  // A pair that is evaluated anyway is in awake() no more; and again from the next advance() on.
  void rest(std::uint32_t pair) {
    due_[pair].path = due_[pair].turn = std::numeric_limits<double>::infinity();
  }
  void wake(std::uint32_t pair);
  [[nodiscard]] bool sleeps(std::uint32_t pair) const { return !due(pair, next_); }
  // Ascending; of the last advance().
  [[nodiscard]] const std::vector<std::uint32_t>& awake() const { return awake_; }

 private:
  // Sums of a couple of bodies, to compare with what its pairs are due at.
  [[nodiscard]] static SafeMotion sums(const Bodies& of, const std::vector<BodyMotion>& motions);
  void find_sums();
  [[nodiscard]] bool due(std::uint32_t pair, const std::vector<SafeMotion>& limits) const {
    const SafeMotion &at = due_[pair], &limit = limits[couple_[pair]];
    return at.path <= limit.path || at.turn <= limit.turn;
  }

  std::vector<Bodies> couples_;         // of bodies that have pairs
  std::vector<std::uint32_t> couple_;   // (pairs) in couples_
  std::vector<SafeMotion> now_, next_;  // (couples_) sums so far, and those that the next step may lead to
  std::vector<SafeMotion> ahead_;       // (couples_) next_ and what is left
  std::vector<SafeMotion> due_;         // (pairs) sums at which it has to be looked at
  std::vector<BodyMotion> sum_;         // (bodies) since reset()
  std::vector<BodyMotion> reach_;       // (bodies) of the next step
  std::vector<std::uint32_t> soon_;     // those that may be due before left_ is used up, ascending
  std::vector<std::uint32_t> awake_;    // those that may be due in the next step
  SafeMotion left_{0, 0};               // m
  double spacing_ = 0;
};

}  // namespace flexel::simulate
