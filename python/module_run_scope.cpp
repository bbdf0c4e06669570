// The state of a run is that of its process, as in the programs.
#include "python/module_run_scope.h"

#include <pthread.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/resources.h"
#include "base/stop.h"

namespace flexel::python {
namespace {

constexpr std::chrono::milliseconds kUntilSignals(50);  // of a wait, until signals are looked at

std::recursive_timed_mutex one_run;
int runs = 0;                         // within each other
std::exception_ptr callback_error;    // of the innermost run
struct sigaction outer_interrupt {};  // Python's
std::atomic<bool> signalled{false};   // since the outermost run began
static_assert(std::atomic<bool>::is_always_lock_free);
thread_local bool tells_progress = false;  // Python's function of progress has the thread
bool forked_within_run = false;

// Of a fork's child: no thread of it will ever give back what a run holds. A run that begins or ends has the lock, but is not
// counted, while it waits for the GIL; its own lock a fork's child does not have either.
void look_at_fork() {
  if (one_run.try_lock())
    one_run.unlock();
  else
    forked_within_run = true;
}

void on_interrupt(int signal) {
  signalled = true;
  request_stop();
  if (outer_interrupt.sa_handler != SIG_DFL && outer_interrupt.sa_handler != SIG_IGN)
    outer_interrupt.sa_handler(signal);
}

// Python's handlers run on its main thread only; there, and for the outermost run, SIGINT stops the work as well.
class StopsOnInterrupt {
 public:
  explicit StopsOnInterrupt(bool wanted) : installed_(wanted) {
    if (!installed_) return;
    struct sigaction action {};
    action.sa_handler = on_interrupt;
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, &outer_interrupt);
    if (outer_interrupt.sa_handler == SIG_IGN) sigaction(SIGINT, &outer_interrupt, nullptr);
  }
  ~StopsOnInterrupt() {
    if (installed_) sigaction(SIGINT, &outer_interrupt, nullptr);
  }
  StopsOnInterrupt(const StopsOnInterrupt&) = delete;
  StopsOnInterrupt& operator=(const StopsOnInterrupt&) = delete;

 private:
  bool installed_;
};

class Listener : public ProgressListener {
 public:
  Listener(const py::object& progress, Said& said) : progress_(progress), said_(said) {}
  void update(const std::string& stage, double share, const std::string& note,
              std::optional<double> left) noexcept override {
    if (!wanted_) return;
    tells_progress = true;
    try {
      call_back([&] { progress_(stage, share, note, left); });
    } catch (...) {
      wanted_ = false;  // the run ends; the error is kept
    }
    tells_progress = false;
  }
  void say(const std::string& line) noexcept override { keep(said_.lines, line); }
  void warn(const std::string& line) noexcept override { keep(said_.warnings, line); }

 private:
  static void keep(std::vector<std::string>& lines, const std::string& line) noexcept try {
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
  } catch (...) {  // without memory the run itself ends
  }
  const py::object& progress_;
  Said& said_;
  bool wanted_ = !progress_.is_none();
};

bool on_main_thread() {
  const py::module_ threading = py::module_::import("threading");
  return threading.attr("current_thread")().is(threading.attr("main_thread")());
}

Listener* current = nullptr;

void restore_element_limit(double limit) {
  constexpr double kNone = 1e18;  // and above it; a double of more need not fit
  limit_elements(static_cast<std::size_t>(std::min(limit, kNone)));
}

// One run within the lock: its listener, and the state that ends with it. A stop that a callback's error asked for ends this
// run only; one by a signal ends those around it too.
class Scope {
 public:
  explicit Scope(Listener& listener)
      : outer_(current),
        outer_error_(std::exchange(callback_error, nullptr)),
        outer_elements_(element_limit()) {
    ++runs;
    restore_element_limit(std::numeric_limits<double>::infinity());  // that of an outer run is its own
    set_progress_listener(current = &listener);
  }
  ~Scope() {
    set_progress_listener(current = outer_);
    const bool by_callback = std::exchange(callback_error, outer_error_) != nullptr;
    restore_element_limit(outer_elements_);
    if (--runs == 0) signalled = false;
    if (runs == 0 || (by_callback && !signalled)) forget_stop();
  }
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

 private:
  Listener* outer_;
  std::exception_ptr outer_error_;
  double outer_elements_;
};

using Turn = std::unique_lock<std::recursive_timed_mutex>;

// With the GIL: waits for the runs of other threads. Meanwhile Python's handlers run, and what they raise is thrown.
Turn wait_for_turn() {
  Turn turn(one_run, std::defer_lock);
  while (true) {
    {
      const py::gil_scoped_release free;
      if (turn.try_lock_for(kUntilSignals)) break;
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return turn;
}

// Raises flexel.errors.NAME.
void raise(const char* name, const std::string& what, const std::string& where) {
  try {
    const py::object type = py::module_::import("flexel.errors").attr(name);
    PyErr_SetObject(type.ptr(), type(what, where).ptr());
  } catch (py::error_already_set& error) {
    error.restore();
  }
}

}  // namespace

void call_back(const std::function<void()>& callback) {
  const py::gil_scoped_acquire gil;
  try {
    callback();
  } catch (...) {
    callback_error = std::current_exception();
    request_stop();
    throw Interrupted();
  }
}

Said run_work(const py::object& progress, const std::function<void()>& work) {
  // Progress may come from any thread of the run, which holds the lock.
  if (tells_progress)
    throw InputError("a function of progress cannot run anything itself: run it after, or in on_frame");
  if (forked_within_run)
    throw InputError(
        "this process was forked while a run went on, and cannot run anything: fork before, or start "
        "processes with "
        "multiprocessing.get_context(\"spawn\")");
  Said said;
  Listener listener(progress, said);
  const bool takes_signals = on_main_thread();
  std::exception_ptr error, from_callback;
  {
    const Turn turn = wait_for_turn();
    const py::gil_scoped_release free;
    const Scope scope(listener);
    const StopsOnInterrupt stops(takes_signals && runs == 1);
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
    from_callback = callback_error;
  }
  if (from_callback) std::rethrow_exception(from_callback);
  if (!error) return said;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  std::rethrow_exception(error);
}

void watch_forks() {
  pthread_atfork(nullptr, nullptr, look_at_fork);
}

void translate_errors() {
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      std::rethrow_exception(error);
    } catch (const InputError& e) {
      raise("InputError", e.what(), e.where());
    } catch (const DivergedError& e) {
      raise("DivergedError", e.what(), "");
    } catch (const InvalidMappingError& e) {
      raise("InvalidMappingError", e.what(), "");
    } catch (const TimeoutError& e) {
      raise("StoppedByTimeout", e.what(), "");
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

}  // namespace flexel::python
