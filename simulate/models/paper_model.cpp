// Every element gathers over its own row of connections, in the order of the other elements, so every sum has
// a fixed order and the bits do not depend on the number of threads. A connection is worked out at both of
// its ends; both give the same numbers with opposite signs, so that momentum is kept exactly.
#include "simulate/models/paper_model.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/math/eigenvalues.h"
#include "base/math/greatest.h"
#include "base/parallel.h"
#include "simulate/models/central_spring.h"
#include "simulate/models/rest_shape.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kPaperGrain = 512;

// Axis of a kind of connection along one axis of the lattice, or 3. Kinds are 1 + the bit of
// half_neighbourhood.
std::size_t axis_of(std::uint8_t kind) {
  return kind == 1 ? 0 : kind == 3 ? 1 : kind == 9 ? 2 : 3;
}
static_assert(half_neighbourhood[0] == Index3{1, 0, 0} && half_neighbourhood[2] == Index3{0, 1, 0} &&
              half_neighbourhood[8] == Index3{0, 0, 1});

struct Least {
  double value = std::numeric_limits<double>::infinity();
  std::uint32_t element = 0;
  Least& operator+=(const Least& other) {
    if (other.value < value) *this = other;
    return *this;
  }
};

// Without those of rigid parts.
Connections resisting_connections(const Problem& problem) {
  Connections made = make_connections(problem);
  if (problem.rigidity.empty()) return made;
  Connections left;
  left.parts = made.parts;
  for (std::size_t p = 0; p < made.parts.size(); ++p) {
    PartConnections& part = left.parts[p];
    part.begin = part.end = static_cast<std::uint32_t>(left.size());
    if (problem.rigidity[p] != Rigidity::none) continue;
    for (std::uint32_t c = made.parts[p].begin; c < made.parts[p].end; ++c) {
      left.a.push_back(made.a[c]);
      left.b.push_back(made.b[c]);
      left.kind.push_back(made.kind[c]);
    }
    part.end = static_cast<std::uint32_t>(left.size());
  }
  return left;
}

bool is_rigid_part(const Problem& problem, std::uint32_t part) {
  return part < problem.rigidity.size() && problem.rigidity[part] != Rigidity::none;
}

}  // namespace

std::vector<double> connection_factors(const Body& body, const ConnectionRows& rows,
                                       const std::string& what) {
  const std::vector<double> of_elements = element_factors(body, (what + "_change").c_str());
  const std::string own = "connection_" + what + "_change";
  const std::span<const double> of_connections = connection_values(body, own.c_str());
  std::vector<double> factors;
  if (of_elements.empty() && of_connections.empty()) return factors;
  factors.assign(rows.entries.size(), 1);
  for (std::uint32_t e = 0; e < body.element_count(); ++e)
    for (std::size_t i = rows.offsets[e]; i < rows.offsets[e + 1]; ++i) {
      const ConnectionRows::Entry& entry = rows.entries[i];
      if (!of_elements.empty()) factors[i] = 0.5 * (of_elements[e] + of_elements[entry.other]);
      if (of_connections.empty()) continue;
      const std::uint32_t from = entry.sign > 0 ? e : entry.other;
      const std::size_t bit = entry.kind - std::size_t{1};
      const double change = of_connections[half_neighbourhood.size() * from + bit];
      if (!(1 + change > 0))
        throw InputError(
            fmt::format("column \"{}\" of elements: connection {} of element {} has {:g}, a factor less 1: "
                        "it needs to be "
                        "above -1",
                        own, bit, from, change));
      factors[i] *= 1 + change;
    }
  return factors;
}

PaperModel::PaperModel(const Problem& problem)
    : body_(problem.body),
      connections_(resisting_connections(problem)),
      rows_(connection_rows(connections_, problem.body.element_count())),
      part_(element_parts(problem.body)),
      active_(problem.body.element_count(), 0) {
  for (std::size_t e = 0; e < active_.size(); ++e)
    active_[e] = body_.parts[part_[e]].placement == Placement::centre && !is_rigid_part(problem, part_[e]) &&
                 !(e < problem.stray_element.size() && problem.stray_element[e]);
  factor_ = connection_factors(body_, rows_, "stiffness");
  damping_factor_ = connection_factors(body_, rows_, "damping");
  const RestShapes shapes(body_);
  if (!shapes.any()) return;
  memory_.flowed.assign(rows_.entries.size(), 0);
  for (std::uint32_t e = 0; e < active_.size(); ++e)
    for (const ConnectionRows::Entry& entry : rows_.of(e)) {
      const std::uint32_t from = entry.sign > 0 ? e : entry.other;
      const std::size_t bit = entry.kind - std::size_t{1};
      const double flowed = shapes.of_connection(from, bit), length = kind(e, entry.kind).length;
      if (!(length + flowed > 0))
        throw InputError(fmt::format(
            "column \"connection_rest\" of elements: connection {} of element {} has {:g} m, which leaves "
            "nothing of its length of {:g} m",
            bit, from, flowed, length));
      memory_.flowed[place(entry)] = flowed;
    }
}

Stretch PaperModel::stretched(const State& state, std::uint32_t element,
                              const ConnectionRows::Entry& entry) const {
  Stretch now = stretch(entry.sign * kind(element, entry.kind).rest,
                        state.displacement[entry.other] - state.displacement[element]);
  if (!memory_.flowed.empty()) now.elongation -= memory_.flowed[place(entry)];
  return now;
}

double PaperModel::stiffness(std::uint32_t element, const ConnectionRows::Entry& entry) const {
  if (is_broken(entry)) return 0;
  const double own = kind(element, entry.kind).stiffness;
  return factor_.empty() ? own : factor_[place(entry)] * own;
}

double PaperModel::volume_ratio(const State& state, std::uint32_t element) const {
  Mat3 gradient = Mat3::Zero();
  std::array<int, 3> sides{};
  std::array<double, 3> length{};
  for (const ConnectionRows::Entry& entry : rows_.of(element)) {
    if (is_broken(entry)) return 1;
    const std::size_t axis = axis_of(entry.kind);
    if (axis == 3) continue;
    const ConnectionKind& connection = kind(element, entry.kind);
    gradient.col(static_cast<Eigen::Index>(axis)) +=
        entry.sign * (state.displacement[entry.other] - state.displacement[element]);
    ++sides[axis];
    length[axis] += connection.length;
  }
  if (sides[0] * sides[1] * sides[2] == 0) return 1;
  for (std::size_t axis = 0; axis < 3; ++axis) gradient.col(static_cast<Eigen::Index>(axis)) /= length[axis];
  return (body_.parts[part_[element]].lattice.axes + gradient).determinant();
}

double PaperModel::energy(const State& state) const {
  return parallel_sum<double>(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        const auto element = static_cast<std::uint32_t>(e);
        if (!active_[e]) return 0.0;
        if (!(volume_ratio(state, element) > 0)) return std::numeric_limits<double>::infinity();
        double energy = 0;
        for (const ConnectionRows::Entry& entry : rows_.of(element)) {
          if (entry.sign < 0 || is_broken(entry)) continue;
          const double elongation = stretched(state, element, entry).elongation;
          energy += 0.5 * stiffness(element, entry) * elongation * elongation;
        }
        return energy;
      },
      kPaperGrain);
}

void PaperModel::add_forces(const State& state, std::vector<Vec3>& forces) const {
  parallel_for_each(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        const auto element = static_cast<std::uint32_t>(e);
        for (const ConnectionRows::Entry& entry : rows_.of(element)) {
          if (is_broken(entry)) continue;
          const Stretch now = stretched(state, element, entry);
          forces[e] += (stiffness(element, entry) * now.elongation) * now.direction;
        }
      },
      kPaperGrain);
}

void PaperModel::add_damping(const State& state, const std::vector<double>& damping,
                             std::vector<Vec3>& forces) const {
  parallel_for_each(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        const auto element = static_cast<std::uint32_t>(e);
        if (damping[part_[e]] == 0) return;
        for (const ConnectionRows::Entry& entry : rows_.of(element)) {
          if (is_broken(entry)) continue;
          const ConnectionKind& connection = kind(element, entry.kind);
          const Vec3 direction =
              (entry.sign * connection.rest + (state.displacement[entry.other] - state.displacement[e]))
                  .normalized();
          const double rate = direction.dot(state.velocity[entry.other] - state.velocity[e]);
          forces[e] +=
              (damping[part_[e]] * damping_factor(entry) * stiffness(element, entry) * rate) * direction;
        }
      },
      kPaperGrain);
}

void PaperModel::add_damping_matrix(const State& state, const std::vector<double>& damping,
                                    BlockMatrix& matrix) const {
  parallel_for_each(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        const auto element = static_cast<std::uint32_t>(e);
        if (damping[part_[e]] == 0 || rows_.of(element).empty()) return;
        Block own = Block::Zero();
        for (const ConnectionRows::Entry& entry : rows_.of(element)) {
          const Vec3 along = stretched(state, element, entry).direction;
          const Block block = (damping[part_[e]] * damping_factor(entry) * stiffness(element, entry)) *
                              along * along.transpose();
          own += block;
          matrix.values[position_of(matrix, e, entry.other)] -= block;
        }
        matrix.values[diagonal_position(matrix, e)] += own;
      },
      kPaperGrain);
}

std::vector<double> PaperModel::frequencies(const State& state, const std::vector<double>& mass) const {
  std::vector<double> result;
  for (std::size_t p = 0; p < body_.parts.size(); ++p) {
    const Part& part = body_.parts[p];
    if (part.placement != Placement::centre) {
      result.push_back(0);
      continue;
    }
    const auto largest = parallel_sum<Greatest>(
        part.element_end - part.element_begin,
        [&](std::size_t i) {
          const auto element = static_cast<std::uint32_t>(part.element_begin + i);
          Mat3 own = Mat3::Zero();
          for (const ConnectionRows::Entry& entry : rows_.of(element)) {
            if (is_broken(entry)) continue;
            own += spring_tangent(stiffness(element, entry), stretched(state, element, entry), true);
          }
          Eigen::SelfAdjointEigenSolver<Mat3> eigen;
          eigen.computeDirect(own, Eigen::EigenvaluesOnly);
          return Greatest{2 * eigen.eigenvalues()[2] / mass[element]};
        },
        kPaperGrain);
    result.push_back(largest.value);
  }
  return result;
}

void PaperModel::add_stiffness(const State& state, bool project, BlockMatrix& matrix) const {
  parallel_for_each(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        const auto element = static_cast<std::uint32_t>(e);
        if (rows_.of(element).empty()) return;
        Block own = Block::Zero();
        for (const ConnectionRows::Entry& entry : rows_.of(element)) {
          const Block block =
              spring_tangent(stiffness(element, entry), stretched(state, element, entry), project);
          own += block;
          matrix.values[position_of(matrix, e, entry.other)] -= block;
        }
        matrix.values[diagonal_position(matrix, e)] += own;
      },
      kPaperGrain);
}

PaperModel::SmallestVolume PaperModel::smallest_volume(const State& state) const {
  const Least least = parallel_sum<Least>(
      rows_.offsets.size() - 1,
      [&](std::size_t e) {
        if (!active_[e]) return Least{};
        const auto element = static_cast<std::uint32_t>(e);
        return Least{volume_ratio(state, element), element};
      },
      kPaperGrain);
  if (!(least.value < std::numeric_limits<double>::infinity())) return {};
  return {least.value, least.element};
}

}  // namespace flexel::simulate
