// Sorting on several threads. By itself because each use compiles oneTBB's algorithm again.
#pragma once
#include <oneapi/tbb/parallel_sort.h>

#include "base/stop.h"

namespace flexel {

// Sorts by `less`, which must be a strict total order for repeatable results. May throw Interrupted and TimeoutError.
template <class Iterator, class Less>
void parallel_sort(Iterator begin, Iterator end, const Less& less) {
  check_stop();
  tbb::parallel_sort(begin, end, less);
}

}  // namespace flexel
