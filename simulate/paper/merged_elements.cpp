// Groups are numbered in the order of the coarse lattice; sums run over the fine elements in their order.
#include "simulate/paper/merged_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <span>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "simulate/matter/interpolation_weights.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kDirectionBits = half_neighbourhood.size();
constexpr double kEightElements = 8;

// How numbers of elements or connections become one.
enum class Merging { share, mean, mean_by_mass, mean_by_stiffness, led, harmonic, least, twice };
struct MergedColumn {
  const char* name;
  Merging how;
  bool is_factor;  // the column has the factor less 1
};
constexpr MergedColumn kOfElements[] = {{"density_change", Merging::share, true},
                                        {"stiffness_change", Merging::share, true},
                                        {"damping_change", Merging::mean_by_stiffness, true},
                                        {"strength_change", Merging::mean, true},
                                        {"friction_change", Merging::mean, true},
                                        {"yield_change", Merging::mean, true},
                                        {"radius_change", Merging::mean, true},
                                        {"stick_change", Merging::mean, false},
                                        {"plastic_strain", Merging::mean, false},
                                        {"settled", Merging::led, false},
                                        {"velocity", Merging::mean_by_mass, false}};
constexpr MergedColumn kOfConnections[] = {{"connection_stiffness_change", Merging::harmonic, true},
                                           {"connection_damping_change", Merging::mean, true},
                                           {"connection_strength_change", Merging::least, true},
                                           {"connection_friction_change", Merging::mean, true},
                                           {"connection_rest", Merging::twice, false}};

std::size_t find_in(std::span<const MergedColumn> columns, const std::string& name) {
  return static_cast<std::size_t>(std::find_if(columns.begin(), columns.end(),
                                               [&](const MergedColumn& each) { return name == each.name; }) -
                                  columns.begin());
}

void refuse_unknown(const Body& body) {
  for (const Part& part : body.parts)
    if (part.placement != Placement::centre)
      throw InputError(
          fmt::format("part \"{}\" has cells: elements are merged at centre placement", part.name));
  for (const auto& [name, column] : body.element_columns)
    if (find_in(kOfElements, name) == std::size(kOfElements) &&
        find_in(kOfConnections, name) == std::size(kOfConnections))
      throw InputError(
          fmt::format("the body's column \"{}\" says nothing of one element in place of eight", name));
  for (const char* note : {"fused", "stuck", "carved", "joined"})
    if (body.notes.contains(note))
      throw InputError(fmt::format(
          "the body's note \"{}\" names places of its lattice, which a coarser one does not have", note));
  refuse_damaged_columns(body);
}

std::int32_t half_index(std::int32_t index) {
  return index >= 0 ? index / 2 : -((1 - index) / 2);
}

// Of the connections that become one.
struct MergedValue {
  double sum = 0, weight = 0, least = std::numeric_limits<double>::infinity();
  void add(Merging how, double times, double one) {
    sum += times * (how == Merging::harmonic ? 1 / one : one);
    weight += times;
    least = std::min(least, one);
  }
  void add(const MergedValue& other) {
    sum += other.sum;
    weight += other.weight;
    least = std::min(least, other.least);
  }
  [[nodiscard]] double value(Merging how) const {
    const double mean = sum / weight;
    return how == Merging::least      ? least
           : how == Merging::harmonic ? 1 / mean
           : how == Merging::twice    ? 2 * mean
                                      : mean;
  }
};

class MergedElements {
 public:
  explicit MergedElements(const Body& fine);
  [[nodiscard]] Body body();

 private:
  void connect();
  void group(const Part& part);
  void refuse_pieces(const Part& part) const;
  [[nodiscard]] Vec3 lowest(const Part& part) const;
  [[nodiscard]] std::pair<std::uint32_t, std::size_t> place_of(std::uint32_t a, std::uint32_t b) const;
  void merge_columns();
  [[nodiscard]] std::vector<double> led(const std::vector<double>& displacement) const;
  void merge_connections();
  [[nodiscard]] double weight(Merging how, std::uint32_t element) const;
  [[nodiscard]] std::vector<double> merged_connections(const MergedColumn& column,
                                                       std::span<const double> values) const;

  const Body& fine_;
  std::vector<std::array<std::uint32_t, kDirectionBits>> neighbour_;  // (elements) by bit; kNoElement
  std::vector<std::uint32_t> group_;                                  // (elements) coarse element
  std::vector<double> mass_, stiffness_;                              // (elements) factors
  Body coarse_;
  static constexpr std::uint32_t kNoElement = ~0u;
};

MergedElements::MergedElements(const Body& fine)
    : fine_(fine),
      group_(fine.element_count(), 0),
      mass_(mass_factors(fine)),
      stiffness_(stiffness_factors(fine)) {
  mass_.resize(fine.element_count(), 1);
  stiffness_.resize(fine.element_count(), 1);
  connect();
}

// The other ends of what Body::connections has.
void MergedElements::connect() {
  std::array<std::uint32_t, kDirectionBits> none;
  none.fill(kNoElement);
  neighbour_.assign(fine_.element_count(), none);
  for (const Part& part : fine_.parts) {
    std::map<std::tuple<Index3, std::uint16_t>, std::uint32_t> at;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      at[{fine_.lattice_index[e], fine_.piece[e]}] = e;
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      for (std::size_t bit = 0; bit < kDirectionBits; ++bit) {
        if (!(fine_.connections[e] >> bit & 1u)) continue;
        Index3 other = fine_.lattice_index[e];
        for (std::size_t axis = 0; axis < 3; ++axis) other[axis] += half_neighbourhood[bit][axis];
        if (const auto found = at.find({other, fine_.piece[e]}); found != at.end())
          neighbour_[e][bit] = found->second;
      }
  }
}

Vec3 MergedElements::lowest(const Part& part) const {
  Vec3 low = Vec3::Constant(1e300);
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
    const Index3& at = fine_.lattice_index[e];
    low = low.cwiseMin(Vec3(at[0], at[1], at[2]));
  }
  return low;
}

// What of a group is not connected within it would hang together afterwards.
void MergedElements::refuse_pieces(const Part& part) const {
  DisjointSets whole(fine_.element_count());
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    for (const std::uint32_t other : neighbour_[e])
      if (other != kNoElement && group_[e] == group_[other]) whole.unite(e, other);
  std::map<std::uint32_t, std::uint32_t> root;  // of groups
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
    if (root.try_emplace(group_[e], whole.root(e)).first->second != whole.root(e))
      throw InputError(
          fmt::format("part \"{}\": elements of one group near ({:.4g}, {:.4g}, {:.4g}) mm are not "
                      "connected, as at a crack or a slit, "
                      "and one element in their place would join them",
                      part.name, 1e3 * fine_.rest[e].x(), 1e3 * fine_.rest[e].y(), 1e3 * fine_.rest[e].z()));
}

void MergedElements::group(const Part& part) {
  Part made = part;
  const Vec3 low = lowest(part);
  made.lattice.origin = part.lattice.to_world(low);
  made.lattice.spacing = 2 * part.lattice.spacing;
  made.element_begin = static_cast<std::uint32_t>(coarse_.element_count());
  std::map<std::tuple<std::int32_t, std::int32_t, std::int32_t, std::uint16_t>, std::uint32_t> number;
  const auto place = [&](std::uint32_t e) {
    std::array<std::int32_t, 3> at;
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] = half_index(fine_.lattice_index[e][axis] -
                            static_cast<std::int32_t>(low[static_cast<Eigen::Index>(axis)]));
    return std::tuple(at[2], at[1], at[0], fine_.piece[e]);
  };
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) number[place(e)] = 0;
  for (auto& [at, n] : number) {
    n = static_cast<std::uint32_t>(coarse_.element_count());
    const auto& [k, j, i, piece] = at;
    coarse_.lattice_index.push_back({i, j, k});
    coarse_.piece.push_back(piece);
    coarse_.rest.push_back(made.lattice.to_world(Vec3(i + 0.5, j + 0.5, k + 0.5)));
  }
  for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) group_[e] = number[place(e)];
  made.element_end = static_cast<std::uint32_t>(coarse_.element_count());
  coarse_.parts.push_back(made);
  refuse_pieces(part);
}

double MergedElements::weight(Merging how, std::uint32_t element) const {
  return how == Merging::mean_by_mass || how == Merging::led ? mass_[element]
         : how == Merging::mean_by_stiffness                 ? stiffness_[element]
                                                             : 1;
}

// Where a group lacks elements, its middle is not the middle of those it has: what they do there.
std::vector<double> MergedElements::led(const std::vector<double>& displacement) const {
  const Problem problem{fine_, {}, {}};
  std::vector<double> there(displacement.size(), 0);
  for (std::uint32_t e = 0; e < fine_.element_count(); ++e) {
    const InterpolationWeights at = with_gradient(problem, {{e}, {1}, 1}, coarse_.rest[group_[e]]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::uint32_t n = 0; n < at.count; ++n)
        there[3 * std::size_t{e} + axis] +=
            at.weights[n] * displacement[3 * std::size_t{at.elements[n]} + axis];
  }
  return there;
}

void MergedElements::merge_columns() {
  const auto merged = [&](const MergedColumn& column, std::size_t width, const auto& value) {
    std::vector<double> sum(width * coarse_.element_count(), 0), all(coarse_.element_count(), 0);
    for (std::uint32_t e = 0; e < fine_.element_count(); ++e) {
      const double own = weight(column.how, e);
      all[group_[e]] += own;
      for (std::size_t i = 0; i < width; ++i) sum[width * group_[e] + i] += own * value(width * e + i);
    }
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] /= column.how == Merging::share ? kEightElements : all[i / width];
    return sum;
  };
  for (const MergedColumn& column : kOfElements) {
    const auto found = fine_.element_columns.find(column.name);
    const bool given = found != fine_.element_columns.end();
    if (!given && column.how != Merging::share) continue;
    const auto width = given ? static_cast<std::size_t>(found->second.components) : 1;
    const double one = column.is_factor ? 1 : 0;
    const std::vector<double>* own = given ? &found->second.values : nullptr;
    std::vector<double> there;
    if (column.how == Merging::led) own = &(there = led(*own));
    std::vector<double> values =
        merged(column, width, [&](std::size_t i) { return own ? one + (*own)[i] : 1; });
    for (double& each : values) each -= one;
    const bool any = std::any_of(values.begin(), values.end(), [](double each) { return each != 0; });
    if (given || any) coarse_.element_columns[column.name] = {static_cast<int>(width), std::move(values)};
  }
  std::vector<double> displacement;
  for (std::uint32_t e = 0; e < fine_.element_count(); ++e)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      displacement.push_back(fine_.position[e][axis] - fine_.rest[e][axis]);
  displacement = led(displacement);
  const std::vector<double> moved =
      merged({"", Merging::led, false}, 3, [&](std::size_t i) { return displacement[i]; });
  for (std::uint32_t e = 0; e < coarse_.element_count(); ++e)
    coarse_.position.push_back(coarse_.rest[e] + Eigen::Map<const Vec3>(&moved[3 * std::size_t{e}]));
}

// The coarse element that has the bit of a connection between two, and the bit.
std::pair<std::uint32_t, std::size_t> MergedElements::place_of(std::uint32_t a, std::uint32_t b) const {
  Index3 step;
  for (std::size_t axis = 0; axis < 3; ++axis)
    step[axis] = coarse_.lattice_index[b][axis] - coarse_.lattice_index[a][axis];
  const auto find = [&](const Index3& way) {
    return static_cast<std::size_t>(std::find(half_neighbourhood.begin(), half_neighbourhood.end(), way) -
                                    half_neighbourhood.begin());
  };
  if (const std::size_t bit = find(step); bit < kDirectionBits) return {a, bit};
  return {b, find({-step[0], -step[1], -step[2]})};
}

void MergedElements::merge_connections() {
  coarse_.connections.assign(coarse_.element_count(), 0);
  for (std::uint32_t e = 0; e < fine_.element_count(); ++e)
    for (const std::uint32_t other : neighbour_[e]) {
      if (other == kNoElement || group_[e] == group_[other]) continue;
      const auto [from, bit] = place_of(group_[e], group_[other]);
      coarse_.connections[from] |= 1u << bit;
    }
  for (const MergedColumn& column : kOfConnections)
    if (const std::span<const double> values = connection_values(fine_, column.name); !values.empty())
      coarse_.element_columns[column.name] = {static_cast<int>(kDirectionBits),
                                              merged_connections(column, values)};
}

// By the coarse elements that have the bits.
std::vector<double> MergedElements::merged_connections(const MergedColumn& column,
                                                       std::span<const double> values) const {
  std::vector<std::array<MergedValue, kDirectionBits>> within(coarse_.element_count()),
      across(coarse_.element_count());
  const double one = column.is_factor ? 1 : 0;
  for (std::uint32_t e = 0; e < fine_.element_count(); ++e)
    for (std::size_t bit = 0; bit < kDirectionBits; ++bit) {
      if (neighbour_[e][bit] == kNoElement) continue;
      const double value = one + values[kDirectionBits * e + bit];
      const std::uint32_t own = group_[e], other = group_[neighbour_[e][bit]];
      if (own == other)
        within[own][bit].add(column.how, 0.5, value);
      else if (place_of(own, other) == std::pair{own, bit})
        across[own][bit].add(column.how, 1, value);
    }
  std::vector<double> merged(kDirectionBits * coarse_.element_count(), 0);
  std::map<Index3, std::vector<std::uint32_t>> at;  // by part below
  for (const Part& part : coarse_.parts) {
    at.clear();
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      at[coarse_.lattice_index[e]].push_back(e);
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e)
      for (std::size_t bit = 0; bit < kDirectionBits; ++bit) {
        if (!(coarse_.connections[e] >> bit & 1u)) continue;
        MergedValue value = across[e][bit];
        value.add(within[e][bit]);
        Index3 next = coarse_.lattice_index[e];
        for (std::size_t axis = 0; axis < 3; ++axis) next[axis] += half_neighbourhood[bit][axis];
        for (const std::uint32_t other : at[next])
          if (coarse_.piece[other] == coarse_.piece[e]) value.add(within[other][bit]);
        if (value.weight > 0) merged[kDirectionBits * e + bit] = value.value(column.how) - one;
      }
  }
  return merged;
}

Body MergedElements::body() {
  for (const Part& part : fine_.parts) group(part);
  merge_columns();
  merge_connections();
  coarse_.surface = fine_.surface;
  coarse_.notes = fine_.notes;
  return std::move(coarse_);
}

}  // namespace

Body merged_elements(const Body& body) {
  refuse_unknown(body);
  return MergedElements(body).body();
}

}  // namespace flexel::simulate
