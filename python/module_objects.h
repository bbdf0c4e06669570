// What Python holds of the libraries, and views of its arrays.
#pragma once
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "formats/lattice/body.h"

namespace flexel::python {

namespace py = pybind11;

// What Python holds of the libraries' data: it does not change, so views of its arrays stay sound.
struct PartObject {
  Surface surface;
};
struct BodyObject {
  Body body;
  std::vector<Vec3> displacement;  // (elements x 3) m, position less rest
};

[[nodiscard]] std::shared_ptr<BodyObject> body_object(Body body);

// The option of that name; what is of another type is a TypeError that names it.
template <class T>
[[nodiscard]] T taken(const py::dict& options, const char* name) {
  const py::object value = options[name];
  try {
    return value.cast<T>();
  } catch (const py::cast_error&) {
    const std::string shown = py::str(py::repr(value));
    throw py::type_error(std::string(name) + ": " + shown + " is of the wrong type or too large");
  }
}

// A read-only view of `values` (n x components, row major), which keeps `owner` alive.
template <class T>
[[nodiscard]] py::array_t<T> view_of(const T* values, std::size_t n, std::size_t components,
                                     const py::object& owner) {
  std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(n)};
  if (components > 1) shape.push_back(static_cast<py::ssize_t>(components));
  py::array_t<T> array(shape, values, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
[[nodiscard]] inline py::array_t<double> view_of(const std::vector<Vec3>& points, const py::object& owner) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  return view_of(reinterpret_cast<const double*>(points.data()), points.size(), 3, owner);
}
template <class T>
[[nodiscard]] py::array_t<T> view_of(const std::vector<T>& values, const py::object& owner) {
  return view_of(values.data(), values.size(), 1, owner);
}
// By name.
[[nodiscard]] py::dict views_of(const Columns& columns, const py::object& owner);

}  // namespace flexel::python
