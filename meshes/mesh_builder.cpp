// Vertices are welded when their part ends.
#include "meshes/mesh_builder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/math/weld.h"

namespace flexel::meshes {

MeshBuilder::MeshBuilder(std::string where) : where_(std::move(where)) {
  mesh_.polygon_offsets.push_back(0);
}

std::uint32_t MeshBuilder::checked(std::size_t count) const {
  if (count > 0xffffffffu) throw InputError(where_, "holds too many polygons");
  return static_cast<std::uint32_t>(count);
}

void MeshBuilder::add_corner(const Vec3& at) {
  if (!at.allFinite()) throw InputError(where_, "has a coordinate that is not a finite number");
  corners_.push_back(at);
}

void MeshBuilder::end_polygon(std::optional<Rgba> color) {
  mesh_.polygon_offsets.push_back(checked(mesh_.polygon_vertices.size() + corners_.size()));
  mesh_.polygon_part.push_back(checked(mesh_.part_names.size()));
  mesh_.polygon_group.push_back(checked(mesh_.group_names.size()) - 1);
  colored_ = colored_ || color.has_value();
  for (const double value : color.value_or(Rgba{1, 1, 1, 1}))
    mesh_.polygon_colors.push_back(std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 1);
}

void MeshBuilder::begin_group(const std::string& name) {
  mesh_.group_names.push_back(name);
}

void MeshBuilder::end_part(const std::string& name, const std::string& assembly) {
  if (corners_.empty()) return;
  const std::vector<std::uint32_t> first = first_equal(corners_.size(), [&](std::size_t i) {
    return position_key(corners_[i].x(), corners_[i].y(), corners_[i].z());
  });
  std::vector<std::uint32_t> number(corners_.size());
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (first[i] == i) {
      number[i] = checked(mesh_.vertices.size());
      mesh_.vertices.push_back(corners_[i]);
    }
    mesh_.polygon_vertices.push_back(number[first[i]]);
  }
  corners_.clear();
  mesh_.part_names.push_back(name);
  mesh_.part_assemblies.push_back(assembly);
  assembled_ = assembled_ || !assembly.empty();
}

ForeignMesh MeshBuilder::finish(double unit) {
  if (mesh_.polygon_vertices.empty()) throw InputError(where_, "shows no polygons: nothing to work on");
  if (!colored_) mesh_.polygon_colors.clear();
  if (!assembled_) mesh_.part_assemblies.clear();
  mesh_.unit = unit;
  return std::move(mesh_);
}

}  // namespace flexel::meshes
