// Parts: files and meshes, as Surface.
#include "base/files/memory_file.h"
#include "base/units.h"
#include "flexel/job.h"
#include "formats/exchange/surface_file.h"
#include "python/module.h"
#include "python/module_objects.h"
#include "python/module_run_scope.h"

namespace flexel::python {
namespace {

std::optional<double> maybe(const py::dict& options, const char* name) {
  if (!options.contains(name) || options[name].is_none()) return {};
  return taken<double>(options, name);
}

ImportOptions import_options(const py::dict& options) {
  ImportOptions import;
  if (options.contains("unit")) import.unit = length_unit(taken<std::string>(options, "unit"));
  if (options.contains("format")) import.format = taken<std::string>(options, "format");
  import.largest_edge = maybe(options, "edge");
  import.deflection = maybe(options, "deflection");
  return import;
}

using PartAndSaid = std::pair<std::shared_ptr<PartObject>, Said>;

PartAndSaid read_part(const std::vector<std::string>& paths, const py::dict& options,
                      const py::object& listener) {
  const ImportOptions import = import_options(options);
  auto part = std::make_shared<PartObject>();
  Said said = run_work(listener, [&] {
    Progress progress("flexel");
    progress.stage("import");
    part->surface = commands::read_parts(paths, import, progress);
  });
  return {part, std::move(said)};
}

// `bytes`: a mesh file without a name of its own.
PartAndSaid part_of_bytes(const py::bytes& bytes, const std::string& name, const py::dict& options,
                          const py::object& listener) {
  const ImportOptions import = import_options(options);
  const std::string_view text(bytes);
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  const Bytes content(begin, begin + text.size());
  auto part = std::make_shared<PartObject>();
  Said said = run_work(listener, [&] {
    const MemoryFile file(content);
    Progress progress("flexel");
    try {
      part->surface = commands::read_parts({file.path()}, import, progress);
    } catch (const InputError& error) {
      if (error.where().rfind(file.path(), 0) != 0) throw;
      throw InputError(name + error.where().substr(file.path().size()), error.what());
    }
    if (part->surface.parts.size() == 1) part->surface.parts[0].name = name;
    for (SurfaceSource& source : part->surface.sources) source.file = name;
  });
  return {part, std::move(said)};
}

py::list faces_of(const PartObject& part) {
  const std::vector<std::uint32_t> numbers = face_numbers(part.surface);
  py::list faces;
  for (std::size_t f = 0; f < part.surface.faces.size(); ++f) {
    const SurfaceFace& face = part.surface.faces[f];
    faces.append(
        py::make_tuple(part.surface.parts[face.part].name + "/" + std::to_string(numbers[f]), face.name));
  }
  return faces;
}

py::array_t<std::uint32_t> triangles_of(const PartObject& part) {
  auto kept = std::make_unique<Triangles>(triangulate(part.surface));
  const auto* values = reinterpret_cast<const std::uint32_t*>(kept->corners.data());
  const std::size_t count = kept->corners.size();
  const py::capsule owner(kept.release(), [](void* triangles) { delete static_cast<Triangles*>(triangles); });
  return view_of(values, count, 3, owner);
}

}  // namespace

py::dict views_of(const Columns& columns, const py::object& owner) {
  py::dict views;
  for (const auto& [name, column] : columns) {
    const auto components = static_cast<std::size_t>(column.components);
    views[py::str(name)] =
        view_of(column.values.data(), column.values.size() / components, components, owner);
  }
  return views;
}

void add_parts(py::module_& module) {
  py::class_<PartObject, std::shared_ptr<PartObject>>(module, "Part")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) { return view_of(self.cast<PartObject&>().surface.vertices, self); })
      .def_property_readonly("polygon_offsets",
                             [](const py::object& self) {
                               return view_of(self.cast<PartObject&>().surface.polygon_offsets, self);
                             })
      .def_property_readonly("polygon_vertices",
                             [](const py::object& self) {
                               return view_of(self.cast<PartObject&>().surface.polygon_vertices, self);
                             })
      .def_property_readonly(
          "polygon_face",
          [](const py::object& self) { return view_of(self.cast<PartObject&>().surface.polygon_face, self); })
      .def_property_readonly("vertex_columns",
                             [](const py::object& self) {
                               return views_of(self.cast<PartObject&>().surface.vertex_columns, self);
                             })
      .def_property_readonly("triangles", &triangles_of)
      .def_property_readonly("faces", &faces_of)
      .def_property_readonly("parts",
                             [](const PartObject& part) {
                               std::vector<std::string> names;
                               for (const SurfacePart& each : part.surface.parts) names.push_back(each.name);
                               return names;
                             })
      .def_property_readonly("unit", [](const PartObject& part) { return default_unit(part.surface); })
      .def("write", [](const PartObject& part, const std::string& path, const py::object& listener) {
        return run_work(listener, [&] {
          const std::vector<Vec3> still(part.surface.vertices.size(), Vec3::Zero());
          write_surface(part.surface, still, surface_format("", path), default_unit(part.surface), path);
        });
      });
  module.def("read_part", &read_part);
  module.def("part_of_bytes", &part_of_bytes);
}

}  // namespace flexel::python
