// What surrounds every call into the libraries: the GIL let go, one run at a time, Ctrl-C, progress, and exceptions as Python's.
#pragma once
#include <pybind11/pybind11.h>

#include <functional>
#include <string>
#include <vector>

#include "base/program/progress.h"

namespace flexel::python {

namespace py = pybind11;

// What a run said.
struct Said {
  std::vector<std::string> lines, warnings;
};

// Runs `work` on this thread, without the GIL. The libraries keep what belongs to a process (limits, held warnings), so runs
// of several threads wait for each other, until a signal's handler raises; one that a callback starts within a run goes ahead. `progress`: None, or called
// with (stage, share in [0, 1], note, seconds left or None), at most ten times a second. What it throws ends the run.
// SIGINT on the main thread ends the run, and what Python's own handler makes of it is thrown.
Said run_work(const py::object& progress, const std::function<void()>& work);

// Within `work`: calls `callback` with the GIL; what it throws ends the run.
void call_back(const std::function<void()>& callback);

// A process that is forked while a run goes on refuses runs of its own, which would wait for ever.
void watch_forks();

// Errors of the libraries become classes of flexel.errors.
void translate_errors();

}  // namespace flexel::python
