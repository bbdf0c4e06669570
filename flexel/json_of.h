// Values that several reports write as JSON.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>

#include "formats/vec.h"

namespace flexel {

// [x, y, z]
[[nodiscard]] inline nlohmann::ordered_json json_of(const Vec3& vector) {
  return nlohmann::ordered_json::array({vector.x(), vector.y(), vector.z()});
}

// null where there is none.
[[nodiscard]] inline nlohmann::ordered_json json_of(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nullptr;
}

}  // namespace flexel
