// Blocks and scenes that the tests of contact share.
#pragma once
#include <Eigen/Geometry>
#include <numbers>
#include <string>

#include "formats/lattice/merge.h"
#include "simulate/contact/contacts.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/initial_velocity.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate::testing {

constexpr double kSide = 0.01;
inline const Material kGum{"gum", 1e6, 0.3, 1000, "test"};

inline Mat3 turn(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

inline Body block(const std::string& name, std::array<int, 3> cells, const Vec3& origin = Vec3::Zero(),
                  const Mat3& axes = Mat3::Identity()) {
  BoxOptions options;
  options.name = name;
  options.cells = cells;
  options.spacing = Vec3::Constant(kSide);
  options.origin = origin;
  options.axes = axes;
  return box_body(options);
}

inline ContactPlane plane_at(double height, const Vec3& normal = Vec3::UnitZ()) {
  ContactPlane plane;
  plane.point = Vec3(0, 0, height);
  plane.normal = normal;
  return plane;
}

inline Problem problem_of(const Body& body) {
  Problem problem{body, std::vector<Material>(body.parts.size(), kGum),
                  std::vector<std::uint8_t>(body.cell_count(), 0)};
  problem.duration = 1;
  return problem;
}

inline ContactSettings all_parts(const Body& body) {
  ContactSettings settings;
  settings.parts.assign(body.parts.size(), 1);
  return settings;
}

inline State starting_at_rest(const Body& body) {
  State state;
  state.displacement.assign(body.element_count(), Vec3::Zero());
  state.velocity.assign(body.element_count(), Vec3::Zero());
  state.time = 0;
  return state;
}

inline Scene scene_of(double time) {
  Scene scene;
  scene.materials["gum"] = kGum;
  scene.material = "gum";
  scene.run.time = time;
  scene.get<Contact>().on = true;
  scene.get<Bonds>().bond = false;
  return scene;
}

inline void throw_part(Scene& scene, const std::string& part, const Vec3& velocity,
                       const Vec3& spin = Vec3::Zero(), const Vec3& through = Vec3::Zero()) {
  StartingVelocity start;
  start.where = select_by_name(part);
  start.velocity = velocity;
  start.spin = spin;
  start.through = through;
  scene.get<InitialVelocity>().velocities.push_back(start);
}

// A body whose surface is `vertices` and `polygons`, within a block of cells of its own.
inline Body within_block(Body body, const std::vector<Vec3>& vertices,
                         const std::vector<std::vector<std::uint32_t>>& polygons) {
  Surface& surface = body.surface;
  surface.vertices = vertices;
  surface.polygon_offsets = {0};
  surface.polygon_vertices.clear();
  surface.polygon_face.assign(polygons.size(), 0);
  surface.faces = {{"all", 0}};
  body.surface_cell_offsets = {0};
  body.surface_cells.clear();
  for (const auto& polygon : polygons) {
    surface.polygon_vertices.insert(surface.polygon_vertices.end(), polygon.begin(), polygon.end());
    surface.polygon_offsets.push_back(static_cast<std::uint32_t>(surface.polygon_vertices.size()));
    for (std::uint32_t c = 0; c < body.cell_count(); ++c) body.surface_cells.push_back(c);
    body.surface_cell_offsets.push_back(static_cast<std::uint32_t>(body.surface_cells.size()));
  }
  return body;
}

// A tessellated ball of radius `radius` [m], within `body`, a block of cells around it.
inline Body ball_within(Body body, const Vec3& centre, double radius) {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> polygons;
  constexpr std::uint32_t kRings = 32, kAround = 48;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring)
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const double theta = std::numbers::pi * ring / kRings, phi = 2 * std::numbers::pi * a / kAround;
      vertices.push_back(centre + radius * Vec3(std::sin(theta) * std::cos(phi),
                                                std::sin(theta) * std::sin(phi), std::cos(theta)));
      if (ring == kRings) continue;
      const std::uint32_t i = ring * kAround + a, j = ring * kAround + (a + 1) % kAround;
      polygons.push_back({i, i + kAround, j + kAround});
      polygons.push_back({i, j + kAround, j});
    }
  return within_block(std::move(body), vertices, polygons);
}

}  // namespace flexel::simulate::testing
