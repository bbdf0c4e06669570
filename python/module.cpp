// The Python module _flexel: classes and functions that the package flexel (python/flexel) wraps.
#include "python/module.h"

#include "base/program/own_program.h"
#include "base/program/termination.h"
#include "base/units.h"
#include "base/version.h"
#include "python/module_run_scope.h"

namespace {

const std::vector<std::pair<const char*, flexel::Dimension>> kDimensions = {
    {"length", flexel::Dimension::length},
    {"time", flexel::Dimension::time},
    {"share", flexel::Dimension::share}};

double parse(const std::string& text, const std::string& name) {
  for (const auto& [known, dimension] : kDimensions)
    if (name == known) return flexel::parse_quantity(text, dimension);
  throw std::invalid_argument("no dimension " + name);
}

}  // namespace

PYBIND11_MODULE(_flexel, module) {
  module.doc() = "The libraries of Flexel; use the package flexel.";
  flexel::never_end_process();
  flexel::python::watch_forks();
  flexel::python::translate_errors();
  module.attr("version") = flexel::version();
  module.def("set_program_folder", &flexel::set_program_folder);
  module.def("parse_quantity", &parse);
  flexel::python::add_parts(module);
  flexel::python::add_bodies(module);
  flexel::python::add_runs(module);
}
