// Sums by blocks in a fixed order (base/parallel.h).
#include "simulate/linear/vector_products.h"

#include "base/parallel.h"

namespace flexel::simulate {

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return parallel_sum<double>(a.size(), [&](std::size_t i) { return a[i].dot(b[i]); });
}

}  // namespace flexel::simulate
