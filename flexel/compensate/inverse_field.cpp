// Fixed point: y <- X - u(y), from y = X.
#include "flexel/compensate/inverse_field.h"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <unordered_map>

#include "base/parallel.h"
#include "formats/lattice/locate.h"
#include "formats/lattice/quadratic_field.h"

namespace flexel::commands {
namespace {

constexpr int kSteps = 30;
constexpr int kFar = 6;  // cells beside the matter

class CellsOfPart {
 public:
  CellsOfPart(const Body& body, const Part& part) : body_(body), part_(part) {
    for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
      const Index3& at = body.lattice_index[body.cell_elements[c][0]];
      cells_.try_emplace(key(at[0], at[1], at[2]), c);
    }
  }
  [[nodiscard]] Vec3 displacement(const Vec3& point) const {
    const Vec3 at = part_.lattice.to_lattice(point);
    const auto i = static_cast<std::int64_t>(std::floor(at.x())),
               j = static_cast<std::int64_t>(std::floor(at.y())),
               k = static_cast<std::int64_t>(std::floor(at.z()));
    const std::optional<std::uint32_t> cell = nearest(i, j, k);
    if (!cell) return Vec3::Zero();
    const CellPoint carried = cell_point(body_, *cell, point);
    Vec3 sum = Vec3::Zero();
    for (std::size_t a = 0; a < 8; ++a) {
      const std::uint32_t e = body_.cell_elements[*cell][a];
      sum += carried.weights[a] * (body_.position[e] - body_.rest[e]);
    }
    return sum;
  }

 private:
  static std::int64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    constexpr std::int64_t kWidth = 1 << 20;
    return (i + kWidth / 2) + kWidth * ((j + kWidth / 2) + kWidth * (k + kWidth / 2));
  }
  [[nodiscard]] std::optional<std::uint32_t> nearest(std::int64_t i, std::int64_t j, std::int64_t k) const {
    for (int reach = 0; reach <= kFar; ++reach)
      for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
          for (int z = -reach; z <= reach; ++z) {
            if (std::max({std::abs(x), std::abs(y), std::abs(z)}) != reach) continue;
            if (const auto found = cells_.find(key(i + x, j + y, k + z)); found != cells_.end())
              return found->second;
          }
    return std::nullopt;
  }

  const Body& body_;
  const Part& part_;
  std::unordered_map<std::int64_t, std::uint32_t> cells_;
};

}  // namespace

void take_inverse_field(const Body& made, Body& wanted) {
  wanted.element_columns.clear();
  wanted.cell_columns.clear();
  for (std::size_t p = 0; p < wanted.parts.size() && p < made.parts.size(); ++p) {
    const CellsOfPart field(made, made.parts[p]);
    const Part& part = wanted.parts[p];
    parallel_for_each(part.element_end - part.element_begin, [&](std::size_t n) {
      const std::size_t e = part.element_begin + n;
      Vec3 y = wanted.rest[e];
      for (int step = 0; step < kSteps; ++step) y = wanted.rest[e] - field.displacement(y);
      wanted.position[e] = y;
    });
  }
}

}  // namespace flexel::commands
