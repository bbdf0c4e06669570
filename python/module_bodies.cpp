// Bodies: lattices, and what runs found in them.
#include "formats/exchange/body_name.h"
#include "formats/lattice/body_file.h"
#include "python/module.h"
#include "python/module_objects.h"
#include "python/module_run_scope.h"

namespace flexel::python {
namespace {

// A property that is a view of `array` of the body.
template <class Array>
auto view(const Array Body::*array) {
  return [array](const py::object& self) { return view_of(self.cast<BodyObject&>().body.*array, self); };
}

template <class T, std::size_t N>
auto table(const std::vector<std::array<T, N>> Body::*array) {
  return [array](const py::object& self) {
    const auto& rows = self.cast<BodyObject&>().body.*array;
    return view_of(reinterpret_cast<const T*>(rows.data()), rows.size(), N, self);
  };
}

py::list lattices_of(const BodyObject& object) {
  py::list parts;
  for (const Part& part : object.body.parts) {
    py::dict each;
    each["name"] = part.name;
    each["material"] = part.material;
    each["placement"] = part.placement == Placement::corner ? "corner" : "centre";
    const auto vector = [](const Vec3& v) { return py::make_tuple(v.x(), v.y(), v.z()); };
    each["origin"] = vector(part.lattice.origin);
    each["axes"] = py::make_tuple(vector(part.lattice.axes.col(0)), vector(part.lattice.axes.col(1)),
                                  vector(part.lattice.axes.col(2)));
    each["spacing"] = vector(part.lattice.spacing);
    each["elements"] = py::make_tuple(part.element_begin, part.element_end);
    each["cells"] = py::make_tuple(part.cell_begin, part.cell_end);
    parts.append(each);
  }
  return parts;
}

}  // namespace

std::shared_ptr<BodyObject> body_object(Body body) {
  auto object = std::make_shared<BodyObject>();
  object->body = std::move(body);
  object->displacement.resize(object->body.element_count());
  for (std::size_t e = 0; e < object->displacement.size(); ++e)
    object->displacement[e] = object->body.position[e] - object->body.rest[e];
  return object;
}

void add_bodies(py::module_& module) {
  py::class_<BodyObject, std::shared_ptr<BodyObject>>(module, "Body")
      .def_property_readonly("rest", view(&Body::rest))
      .def_property_readonly("position", view(&Body::position))
      .def_property_readonly(
          "displacement",
          [](const py::object& self) { return view_of(self.cast<BodyObject&>().displacement, self); })
      .def_property_readonly("lattice_index", table(&Body::lattice_index))
      .def_property_readonly("piece", view(&Body::piece))
      .def_property_readonly("connections", view(&Body::connections))
      .def_property_readonly("cell_elements", table(&Body::cell_elements))
      .def_property_readonly("fill", view(&Body::fill))
      .def_property_readonly("broken", view(&Body::broken))
      .def_property_readonly("element_columns",
                             [](const py::object& self) {
                               return views_of(self.cast<BodyObject&>().body.element_columns, self);
                             })
      .def_property_readonly(
          "cell_columns",
          [](const py::object& self) { return views_of(self.cast<BodyObject&>().body.cell_columns, self); })
      .def_property_readonly("notes", [](const BodyObject& object) { return object.body.notes; })
      .def_property_readonly("parts", &lattices_of)
      .def_property_readonly("surface",
                             [](const BodyObject& object) {
                               return std::make_shared<PartObject>(PartObject{object.body.surface});
                             })
      .def("write",
           [](const BodyObject& object, const std::string& path, bool compress, const py::object& listener) {
             return run_work(listener, [&] {
               if (const std::string line = body_name_warning(path); !line.empty())
                 Progress("flexel").warn(line);
               write_body(object.body, path, {.compress = compress});
             });
           });
  module.def("read_body", [](const std::string& path, const py::object& listener) {
    std::shared_ptr<BodyObject> object;
    Said said = run_work(listener, [&] { object = body_object(read_body(path)); });
    return std::pair(object, std::move(said));
  });
}

}  // namespace flexel::python
