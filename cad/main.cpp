// flexel-cad: what the other programs need of OpenCASCADE, a job on stdin and its answer on stdout
// (formats/cad/cad_job.h). They start it where a CAD file comes, and limit its time and memory.
#include <unistd.h>

#include <OSD_Parallel.hxx>
#include <OSD_ThreadPool.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <thread>

#include "base/error.h"
#include "base/parallel.h"
#include "base/program/share_scope.h"
#include "cad/deform/write_job.h"
#include "cad/read/occt.h"
#include "formats/cad/cad_job.h"

namespace flexel::cad {
namespace {

[[noreturn]] void end_without_memory() {
  _exit(kChildWithoutMemory);
}

// OpenCASCADE may run out of memory where nothing can catch it: in a destructor, or in a thread of its own.
void end_on_terminate() {
  try {
    if (std::current_exception()) std::rethrow_exception(std::current_exception());
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (const Standard_OutOfMemory&) {
    end_without_memory();
  } catch (...) {
  }
  std::abort();
}

// How many threads can be started, `wanted` at most: OpenCASCADE waits for ever for one that could not.
std::size_t threads_that_start(std::size_t wanted) {
  std::vector<std::thread> started;
  std::atomic<bool> all_there = false;
  try {
    while (started.size() + 1 < wanted) started.emplace_back([&] { all_there.wait(false); });
  } catch (const std::exception&) {
  }
  all_there = true;
  all_there.notify_all();
  for (std::thread& each : started) each.join();
  return started.size() + 1;
}

// What is thrown by neither OpenCASCADE nor for the file's sake is a fault of ours.
template <class Result, class Work>
JobAnswer<Result> answer_or_fault(const Work& work) {
  try {
    return answer_of<Result>(work);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& fault) {
    JobAnswer<Result> answer;
    answer.failed = true;
    answer.why = fault.what();
    return answer;
  }
}

template <class Result, class Work>
Bytes answer(std::size_t threads, const Work& work) {
  OSD_Parallel::SetUseOcctThreads(Standard_True);
  OSD_ThreadPool::DefaultPool(static_cast<int>(threads_that_start(threads)));
  return pack(answer_or_fault<Result>([&](const Warn& warn) -> Result {
    try {
      return work(warn);
    } catch (const Standard_OutOfMemory&) {
      end_without_memory();
    } catch (const Standard_Failure& failure) {
      throw InputError(damage_message(failure.GetMessageString() ? failure.GetMessageString() : "no reason"));
    }
  }));
}

Bytes do_job(const CadJob& job, const TellShare& tell) {
  if (job.write) {
    const ThreadLimit limit(static_cast<int>(job.write->threads));
    return answer<CadWritten>(job.write->threads,
                              [&](const Warn& warn) { return write_deformed(*job.write, warn, tell); });
  }
  return answer<CadMesh>(job.read->threads, [&](const Warn& warn) {
    constexpr double kRead = .6;  // of the time
    const ShareScope scope(tell);
    const CadShape shape = [&] {
      const ShareScope reading(0, kRead);
      return read_shape(*job.read, warn);
    }();
    const ShareScope meshing(kRead, 1);
    return mesh_of(shape, *job.read);
  });
}

}  // namespace
}  // namespace flexel::cad

int main() {
  std::set_terminate(flexel::cad::end_on_terminate);
  // What the libraries would tidy up is gone with the process.
  _exit(flexel::serve_job("flexel-cad", [](const flexel::Bytes& job, const flexel::TellShare& tell) {
    return flexel::cad::do_job(flexel::unpack_job(job), tell);
  }));
}
