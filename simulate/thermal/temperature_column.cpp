// The nearest by lattice index, in widening cubes around it.
#include "simulate/thermal/temperature_column.h"

#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <unordered_map>

namespace flexel::simulate {
namespace {

using Key = std::int64_t;

Key key_of(std::int64_t i, std::int64_t j, std::int64_t k) {
  constexpr std::int64_t kWidth = 1 << 20;
  return (i + kWidth / 2) + kWidth * ((j + kWidth / 2) + kWidth * (k + kWidth / 2));
}

// Of the elements or cells of a part by their lattice index.
class ByIndex {
 public:
  void add(const Index3& at, std::uint32_t which) { found_.try_emplace(key_of(at[0], at[1], at[2]), which); }
  [[nodiscard]] std::optional<std::uint32_t> nearest(const Vec3& at) const {
    constexpr int kFar = 8;
    for (int reach = 0; reach <= kFar; ++reach)
      for (int i = -reach; i <= reach; ++i)
        for (int j = -reach; j <= reach; ++j)
          for (int k = -reach; k <= reach; ++k) {
            if (std::max({std::abs(i), std::abs(j), std::abs(k)}) != reach) continue;
            const auto found = found_.find(
                key_of(std::llround(at.x()) + i, std::llround(at.y()) + j, std::llround(at.z()) + k));
            if (found != found_.end()) return found->second;
          }
    return std::nullopt;
  }

 private:
  std::unordered_map<Key, std::uint32_t> found_;
};

Vec3 middle_of_cell(const Body& body, std::uint32_t cell) {
  return 0.5 * (body.rest[body.cell_elements[cell][0]] + body.rest[body.cell_elements[cell][7]]);
}

void sample(const Columns& from, Columns& to, std::size_t count,
            const std::function<std::optional<std::uint32_t>(std::uint32_t)>& nearest) {
  for (const auto& [name, column] : from) {
    Column& made = to[name];
    made.values.assign(count, column.values.empty() ? 0 : column.values.front());
    for (std::uint32_t i = 0; i < count; ++i)
      if (const auto found = nearest(i)) made.values[i] = column.values[*found];
  }
}

}  // namespace

TakenTemperatures::TakenTemperatures(Body& body, const ThermalSettings& settings) : body_(body) {
  const auto take = [&](Columns& columns, Columns& taken) {
    for (auto each = columns.begin(); each != columns.end();) {
      if (is_temperature_column(settings, each->first)) {
        taken[each->first] = std::move(each->second);
        each = columns.erase(each);
      } else {
        ++each;
      }
    }
  };
  take(body.element_columns, elements_);
  take(body.cell_columns, cells_);
}

TakenTemperatures::~TakenTemperatures() {
  body_.element_columns.merge(elements_);
  body_.cell_columns.merge(cells_);
}

void TakenTemperatures::give(Body& coarse) const {
  if (elements_.empty() && cells_.empty()) return;
  std::vector<ByIndex> elements(body_.parts.size()), cells(body_.parts.size());
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    for (std::uint32_t e = body_.parts[p].element_begin; e < body_.parts[p].element_end; ++e)
      elements[p].add(body_.lattice_index[e], e);
    for (std::uint32_t c = body_.parts[p].cell_begin; c < body_.parts[p].cell_end; ++c)
      cells[p].add(body_.lattice_index[body_.cell_elements[c][0]], c);
  }
  const std::vector<std::uint32_t> element_part = element_parts(coarse), cell_part = cell_parts(coarse);
  sample(elements_, coarse.element_columns, coarse.element_count(), [&](std::uint32_t e) {
    return elements[element_part[e]].nearest(body_.parts[element_part[e]].lattice.to_lattice(coarse.rest[e]));
  });
  sample(cells_, coarse.cell_columns, coarse.cell_count(), [&](std::uint32_t c) {
    const Vec3 at = body_.parts[cell_part[c]].lattice.to_lattice(middle_of_cell(coarse, c));
    return cells[cell_part[c]].nearest(at - Vec3::Constant(0.5));
  });
}

void TakenTemperatures::take_back(Body& coarse) const {
  for (const auto& [name, column] : elements_) coarse.element_columns.erase(name);
  for (const auto& [name, column] : cells_) coarse.cell_columns.erase(name);
}

}  // namespace flexel::simulate
