// Where a tool is.
#pragma once
#include "base/math/vec.h"

namespace flexel::clay {

// From rest; the turn is about the tool's middle at rest.
struct ToolPose {
  Vec3 displacement = Vec3::Zero();  // m
  Vec3 turn = Vec3::Zero();          // rad, rotation vector
  [[nodiscard]] bool operator==(const ToolPose&) const = default;
  [[nodiscard]] ToolPose operator+(const ToolPose& other) const {
    return {displacement + other.displacement, turn + other.turn};
  }
  [[nodiscard]] ToolPose operator-(const ToolPose& other) const {
    return {displacement - other.displacement, turn - other.turn};
  }
  [[nodiscard]] ToolPose operator*(double factor) const { return {factor * displacement, factor * turn}; }
  // m^2; a turn counts as what it moves at `arm` m from the axis.
  [[nodiscard]] double dot(const ToolPose& other, double arm) const {
    return displacement.dot(other.displacement) + arm * arm * turn.dot(other.turn);
  }
};

}  // namespace flexel::clay
