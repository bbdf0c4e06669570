// All use of oneTBB is here. Every function gives the same bits for any number of threads: the chunk size
// depends on n only, and reductions add the chunks' sums in order. Every chunk begins with check_stop()
// (base/stop.h), so each function may throw Interrupted and TimeoutError.
#pragma once
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_sort.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "base/stop.h"

namespace flexel {

// Limits the threads of everything below while it lives; 0 means every core.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads)
      : control_(tbb::global_control::max_allowed_parallelism,
                 threads > 0 ? static_cast<std::size_t>(threads)
                             : static_cast<std::size_t>(tbb::info::default_concurrency())) {}

 private:
  tbb::global_control control_;
};

[[nodiscard]] inline int default_thread_count() {
  return tbb::info::default_concurrency();
}

// Threads that the functions below use now, at least 1.
[[nodiscard]] inline std::size_t thread_count() {
  const std::size_t allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::max<std::size_t>(
      1, std::min(allowed, static_cast<std::size_t>(tbb::this_task_arena::max_concurrency())));
}

// Both at the same time.
template <class First, class Second>
void parallel_both(const First& first, const Second& second) {
  tbb::parallel_invoke(first, second);
}

// body(begin, end) over [0, n) in chunks of `grain`.
template <class Body>
void parallel_chunks(std::size_t n, std::size_t grain, const Body& body) {
  const std::size_t chunks = (n + grain - 1) / grain;
  check_stop();
  if (chunks <= 1) {
    if (n > 0) body(std::size_t{0}, n);
    return;
  }
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    check_stop();
    body(c * grain, std::min(n, (c + 1) * grain));
  });
}

// body(i) for each i in [0, n).
template <class Body>
void parallel_for_each(std::size_t n, const Body& body, std::size_t grain = 1024) {
  parallel_chunks(n, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

// Sum of term(i), the same bits for any thread count. `Value` needs a default value of zero and +=.
template <class Value, class Term>
[[nodiscard]] Value parallel_sum(std::size_t n, const Term& term, std::size_t grain = 4096) {
  const std::size_t chunks = (n + grain - 1) / grain;
  std::vector<Value> partial(chunks, Value{});
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    check_stop();
    Value sum{};
    for (std::size_t i = c * grain; i < std::min(n, (c + 1) * grain); ++i) sum += term(i);
    partial[c] = sum;
  });
  Value total{};
  for (const Value& value : partial) total += value;
  return total;
}

// Sorts by `less`, which must be a strict total order for repeatable results.
template <class Iterator, class Less>
void parallel_sort(Iterator begin, Iterator end, const Less& less) {
  check_stop();
  tbb::parallel_sort(begin, end, less);
}

}  // namespace flexel
