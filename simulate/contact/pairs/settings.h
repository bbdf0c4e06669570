// The contact settings of a scene, resolved to the parts of a body.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

// Spacings: parts that begin in each other by no more are not refused.
inline constexpr double kTouchingDepth = 0.05;

// A rigid half-space at rest.
struct ContactPlane {
  Vec3 point = Vec3::Zero();            // m
  Vec3 normal = Vec3::UnitZ();          // unit, out of it
  std::optional<double> friction = {};  // its own coefficient; none: that of the part that touches it
  std::optional<double> stick = {};     // Pa, likewise
  std::string name = {}, origin = {};
};

struct ContactSettings {
  std::vector<std::uint8_t> parts = {};  // (parts) 1: can touch
  bool self = true;                      // also itself
  double stiffness = 1;                  // factor on the stiffness of contacts
  double friction = 0;                   // mu, of materials that give none
  // (parts) Pa, or empty: traction that separates points that have touched; infinity: glue
  std::vector<double> stick = {};
  double damping = 0;       // s, tau
  double release_time = 0;  // s, in which initial penetrations are released; 0: they are refused
  std::vector<ContactPlane> planes = {};
  // Pairs of bonded parts, lower number first: they do not touch where they are near at rest.
  std::vector<std::array<std::uint32_t, 2>> bonded = {};
};

}  // namespace flexel::simulate
