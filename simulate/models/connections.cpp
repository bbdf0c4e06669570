// The neighbours come from the body's graph; the direction of a connection, which is its kind, from the
// difference of the two lattice indices.
#include "simulate/models/connections.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

namespace flexel::simulate {
namespace {

// k in units of E h, for a direction along 1 (face), 2 (edge) or 3 (corner) axes.
double relative_stiffness(HookeConstant hooke, int axes) {
  constexpr double kCorner = 0.1;  // t of model `springs`
  if (hooke == HookeConstant::paper) return std::sqrt(static_cast<double>(axes));
  if (hooke == HookeConstant::isotropic)
    return axes == 1 ? 0.4 + 4 * kCorner / 3 : axes == 2 ? 0.4 - 4 * kCorner / 3 : kCorner;
  return axes == 1 ? 1.0 : axes == 2 ? 1.0 / 6 : 1.0 / 12;
}

// 1 + bit of a direction of the half-neighbourhood, by 9 k + 3 j + i with i, j, k in {0, 1, 2} for -1, 0, 1.
std::array<std::uint8_t, 27> kinds_by_direction() {
  std::array<std::uint8_t, 27> kinds{};
  for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
    const Index3& d = half_neighbourhood[bit];
    kinds[static_cast<std::size_t>(13 + d[0] + 3 * d[1] + 9 * d[2])] = static_cast<std::uint8_t>(1 + bit);
  }
  return kinds;
}

}  // namespace

ConnectionKinds connection_kinds(const Lattice& lattice, const Material& material, HookeConstant hooke) {
  const double h = lattice.spacing.mean();
  ConnectionKinds kinds;
  for (std::size_t bit = 0; bit < half_neighbourhood.size(); ++bit) {
    const Index3& d = half_neighbourhood[bit];
    const Vec3 rest = lattice.axes * Vec3(d[0], d[1], d[2]).cwiseProduct(lattice.spacing);
    const int axes = std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]);
    kinds[1 + bit] = {relative_stiffness(hooke, axes) * material.young * h, rest.norm(), rest};
  }
  return kinds;
}

LatticeConstants lattice_constants(HookeConstant hooke) {
  const double k1 = relative_stiffness(hooke, 1), k2 = relative_stiffness(hooke, 2),
               k3 = relative_stiffness(hooke, 3);
  return {k1 + 2 * k2 + 4 * k3 / 3, k2 + 4 * k3 / 3};
}

double axial_stiffness(HookeConstant hooke) {
  const auto [c11, c12] = lattice_constants(hooke);
  return c11 - 2 * c12 * c12 / (c11 + c12);
}

Connections make_connections(const Problem& problem) {
  static const std::array<std::uint8_t, 27> kind_of = kinds_by_direction();
  const Body& body = problem.body;
  const auto stray = [&](std::uint32_t e) {
    return e < problem.stray_element.size() && problem.stray_element[e];
  };
  Connections made;
  made.parts.resize(body.parts.size());
  const bool any = std::any_of(body.parts.begin(), body.parts.end(),
                               [](const Part& part) { return part.placement == Placement::centre; });
  if (!any) return made;
  const Adjacency adjacency = element_adjacency(body);
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const Part& part = body.parts[p];
    made.parts[p].begin = made.parts[p].end = static_cast<std::uint32_t>(made.size());
    if (part.placement != Placement::centre) continue;
    const HookeConstant hooke = p < problem.hooke.size() ? problem.hooke[p] : HookeConstant::paper;
    made.parts[p].kinds = connection_kinds(part.lattice, problem.materials[p], hooke);
    for (std::uint32_t e = part.element_begin; e < part.element_end; ++e) {
      if (stray(e)) continue;
      const Index3& from = body.lattice_index[e];
      for (const std::uint32_t other : adjacency.of(e)) {
        if (other < e || stray(other)) continue;
        const Index3& to = body.lattice_index[other];
        const int direction = 13 + (to[0] - from[0]) + 3 * (to[1] - from[1]) + 9 * (to[2] - from[2]);
        assert(direction >= 0 && direction < 27 && kind_of[static_cast<std::size_t>(direction)] > 0);
        made.a.push_back(e);
        made.b.push_back(other);
        made.kind.push_back(kind_of[static_cast<std::size_t>(direction)]);
      }
    }
    made.parts[p].end = static_cast<std::uint32_t>(made.size());
  }
  return made;
}

// Connections ascend by (a, b), so those that end at an element, then those that begin at it, ascend too.
ConnectionRows connection_rows(const Connections& connections, std::size_t elements) {
  ConnectionRows rows;
  rows.offsets.assign(elements + 1, 0);
  for (std::size_t c = 0; c < connections.size(); ++c) {
    ++rows.offsets[connections.a[c] + 1];
    ++rows.offsets[connections.b[c] + 1];
  }
  for (std::size_t e = 0; e < elements; ++e) rows.offsets[e + 1] += rows.offsets[e];
  rows.entries.resize(rows.offsets.back());
  std::vector<std::uint32_t> next(rows.offsets.begin(), rows.offsets.end() - 1);
  for (std::size_t c = 0; c < connections.size(); ++c)
    rows.entries[next[connections.b[c]]++] = {connections.a[c], connections.kind[c], -1};
  for (std::size_t c = 0; c < connections.size(); ++c)
    rows.entries[next[connections.a[c]]++] = {connections.b[c], connections.kind[c], 1};
  return rows;
}

}  // namespace flexel::simulate
