// Loops and sums on several threads. Every function gives the same bits for any number of threads: the chunk size
// depends on n only, and reductions add the chunks' sums in order. Every chunk begins with check_stop()
// (base/stop.h), so each function may throw Interrupted and TimeoutError.
//
// oneTBB is in parallel.cpp and math/parallel_sort.h alone: compiled into each loop it took a fifth of a second a loop.
#pragma once
#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "base/stop.h"

namespace flexel {

// Limits the threads of everything below while it lives; 0 means every core.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  class Control;
  std::unique_ptr<Control> control_;
};

// By trying; the limits of the shell may leave no room.
[[nodiscard]] bool can_start_a_thread();

[[nodiscard]] int default_thread_count();

// Threads that the functions below use now, at least 1.
[[nodiscard]] std::size_t thread_count();

// A function of a chunk's number, not owned.
class ChunkFunction {
 public:
  template <class Function>
  explicit ChunkFunction(const Function& function)
      : function_(&function),
        call_([](const void* of, std::size_t chunk) { (*static_cast<const Function*>(of))(chunk); }) {}

  void operator()(std::size_t chunk) const { call_(function_, chunk); }

 private:
  const void* function_;
  void (*call_)(const void*, std::size_t);
};

// Calls it with 0 to chunks - 1; check_stop() goes before each.
void run_chunks(std::size_t chunks, ChunkFunction function);

// Both at the same time.
template <class First, class Second>
void parallel_both(const First& first, const Second& second) {
  const auto either = [&](std::size_t which) { which == 0 ? first() : second(); };
  run_chunks(2, ChunkFunction(either));
}

// body(begin, end) over [0, n) in chunks of `grain`.
template <class Body>
void parallel_chunks(std::size_t n, std::size_t grain, const Body& body) {
  const std::size_t chunks = (n + grain - 1) / grain;
  if (chunks <= 1) {
    check_stop();
    if (n > 0) body(std::size_t{0}, n);
    return;
  }
  const auto chunk = [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); };
  run_chunks(chunks, ChunkFunction(chunk));
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
  const auto chunk = [&](std::size_t c) {
    Value sum{};
    for (std::size_t i = c * grain; i < std::min(n, (c + 1) * grain); ++i) sum += term(i);
    partial[c] = sum;
  };
  run_chunks(chunks, ChunkFunction(chunk));
  Value total{};
  for (const Value& value : partial) total += value;
  return total;
}

}  // namespace flexel
