// The greatest of many values, as a sum for parallel_sum.
#pragma once
#include <algorithm>

namespace flexel {

struct Greatest {
  double value = 0;
  Greatest& operator+=(const Greatest& other) {
    value = std::max(value, other.value);
    return *this;
  }
};

}  // namespace flexel
