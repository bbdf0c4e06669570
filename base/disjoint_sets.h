// Union-find. The root of a set is its lowest member, so one sweep numbers the sets in order of first member.
#pragma once
#include <cstdint>
#include <numeric>
#include <vector>

namespace flexel {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n = 0) { reset(n); }
  // n sets of one member each.
  void reset(std::size_t n) {
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  [[nodiscard]] std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a < b) parent_[b] = a;
    if (b < a) parent_[a] = b;
  }
  // (members) The number of each one's set; sets are numbered in order of their lowest member.
  [[nodiscard]] std::vector<std::uint32_t> numbered() {
    std::vector<std::uint32_t> number(parent_.size());
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < number.size(); ++i) number[i] = root(i) == i ? count++ : number[root(i)];
    return number;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace flexel
