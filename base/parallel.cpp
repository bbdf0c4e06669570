// oneTBB behind the loops of base/parallel.h.
#include "base/parallel.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <system_error>
#include <thread>

namespace flexel {

class ThreadLimit::Control {
 public:
  explicit Control(std::size_t threads) : control_(tbb::global_control::max_allowed_parallelism, threads) {}

 private:
  tbb::global_control control_;
};

ThreadLimit::ThreadLimit(int threads)
    : control_(std::make_unique<Control>(
          static_cast<std::size_t>(threads > 0 ? threads : tbb::info::default_concurrency()))) {}

// Lifting a limit starts the threads that waiting work asks for, and where none can be started that ends the program from
// within TBB. There the limit stays.
ThreadLimit::~ThreadLimit() {
  if (!can_start_a_thread()) (void)control_.release();
}

bool can_start_a_thread() {
  try {
    std::thread([] {}).join();
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

int default_thread_count() {
  return tbb::info::default_concurrency();
}

std::size_t thread_count() {
  const std::size_t allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::max<std::size_t>(
      1, std::min(allowed, static_cast<std::size_t>(tbb::this_task_arena::max_concurrency())));
}

void run_chunks(std::size_t chunks, ChunkFunction function) {
  if (chunks <= 1) {
    check_stop();
    if (chunks == 1) function(0);
    return;
  }
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    check_stop();
    function(chunk);
  });
}

}  // namespace flexel
