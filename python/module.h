// The parts of the Python module _flexel, which the package flexel wraps (python/flexel).
#pragma once
#include <pybind11/pybind11.h>

namespace flexel::python {

void add_parts(pybind11::module_& module);
void add_bodies(pybind11::module_& module);
void add_runs(pybind11::module_& module);

}  // namespace flexel::python
