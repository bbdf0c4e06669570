// What a scene says of contact, resolved to the parts of a body.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/math/vec.h"

namespace flexel::simulate {

// A rigid half-space at rest.
struct ContactPlane {
  Vec3 point = Vec3::Zero();            // m
  Vec3 normal = Vec3::UnitZ();          // unit, out of it
  std::optional<double> friction = {};  // its own constant; none: that of what touches it
  std::optional<double> stick = {};     // Pa, likewise
  std::string name = {}, origin = {};
};

struct ContactSettings {
  std::vector<std::uint8_t> parts = {};  // (parts) 1: can touch
  bool self = true;                      // also itself
  double stiffness = 1;                  // factor on that of the contacts
  double friction = 0;                   // mu, of materials that give none
  std::vector<double> stick =
      {};              // (parts) Pa, or empty: the traction that pulls off what has touched; infinity: glue
  double damping = 0;  // s, tau
  double parting = 0;  // s, in which what begins inside something else is let out; 0: it is refused
  std::vector<ContactPlane> planes = {};
  // Pairs of parts, lower number first, that are bonded: they do not touch where they are near at rest.
  std::vector<std::array<std::uint32_t, 2>> bonded = {};
};

}  // namespace flexel::simulate
