// Puts the mesh together that a reader gives back.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "formats/common/mesh_job.h"

namespace flexel::meshes {

using Rgba = std::array<double, 4>;  // red, green, blue, opacity in [0, 1]

// Part by part, polygon by polygon, corner by corner. Corners of a part at exactly equal positions become one vertex, in
// the order of first use: most formats have a vertex for each corner.
class MeshBuilder {
 public:
  explicit MeshBuilder(std::string where);
  void add_corner(const Vec3& at);  // throws InputError: not finite
  // The corners since the last polygon. No colour: white where others have one.
  void end_polygon(std::optional<Rgba> color);
  // Polygons from here on belong together within their part: a material's, say.
  void begin_group(const std::string& name);
  // All since the last part; nothing happens where there is no polygon. `assembly`: as SurfacePart::assembly.
  void end_part(const std::string& name, const std::string& assembly = "");
  // Throws InputError: there is no polygon.
  [[nodiscard]] ForeignMesh finish(double unit);

 private:
  [[nodiscard]] std::uint32_t checked(std::size_t count) const;
  std::string where_;
  ForeignMesh mesh_;
  std::vector<Vec3> corners_;  // of the part
  bool colored_ = false, assembled_ = false;
};

}  // namespace flexel::meshes
