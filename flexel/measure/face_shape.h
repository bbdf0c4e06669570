// The shape of a face (flat, round, curved), for people who write a scene.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/part/surface.h"

namespace flexel::commands {

struct FaceShape {
  enum class Kind { flat, round, curved };
  Kind kind = Kind::curved;
  std::size_t polygons = 0;
  double area = 0;               // m^2
  Vec3 centroid = Vec3::Zero();  // m, area-weighted
  Vec3 normal = Vec3::Zero();    // flat: unit, outward
  Vec3 axis = Vec3::Zero();  // round (part of a circular cylinder): unit; its largest component is positive
  Vec3 axis_point = Vec3::Zero();  // round: the point of the axis beside the centroid, m
  double radius = 0;               // round: m
  bool hollow = false;             // round: the matter is outside
  double angle = 0;                // round: rad of the cylinder that the face goes round
  bool closed = false;             // round: with the faces beside it on the same cylinder, all of it
  [[nodiscard]] bool is_hole() const { return kind == Kind::round && hollow && closed; }
};

// (faces) A face is flat when its normals differ by less than 0.2 degrees, round when they stand square to an
// axis within a degree and its corners lie within 1 % of a radius from it.
[[nodiscard]] std::vector<FaceShape> face_shapes(const Surface& surface);

// The same of any polygons, as one face; `closed` refers to these alone.
[[nodiscard]] FaceShape face_shape(const Surface& surface, const std::vector<std::uint32_t>& polygons);

// "flat, normal +z", "round, hole of diameter 8 mm along x", "round, fillet of radius 2 mm (90 degrees) along
// y", "curved"; lengths in `unit` metres, called `unit_name`.
[[nodiscard]] std::string describe(const FaceShape& shape, double unit, const std::string& unit_name);

// "+z", "-x", or "(0.71, 0, 0.71)".
[[nodiscard]] std::string direction_name(const Vec3& direction);

}  // namespace flexel::commands
