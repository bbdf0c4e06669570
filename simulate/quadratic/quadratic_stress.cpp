// Samples first, then cells and elements; each in parallel.
#include "simulate/quadratic/quadratic_stress.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/math/eigenvalues.h"
#include "base/parallel.h"
#include "formats/lattice/fields.h"
#include "simulate/matter/surface_samples.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kStressesAtATime = 64;

// What acts at a surface.
struct Boundary {
  Vec3 normal = Vec3::Zero();  // outward, unit, rest
  double pressure = 0;         // Pa; kUnknownPressure
};

// What has to be added to a gradient for a traction more along the surface's normal n: a n^T.
Mat3 across(const Mat9& moduli, const Vec3& n, const Vec3& traction) {
  Mat3 q = Mat3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) q(i, k) += n[j] * moduli(3 * i + j, 3 * k + l) * n[l];
  return q.inverse() * traction * n.transpose();
}

SymmetricStress components(const Mat3& m) {
  SymmetricStress stress;
  stress << m(0, 0), m(1, 1), m(2, 2), 0.5 * (m(0, 1) + m(1, 0)), 0.5 * (m(1, 2) + m(2, 1)),
      0.5 * (m(0, 2) + m(2, 0));
  return stress;
}

Mat3 matrix(const SymmetricStress& s) {
  Mat3 m;
  m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
  return m;
}

// Of the matter in a cell: its middle and the axes along which it spreads, each as long as the standard deviation.
struct Spread {
  Vec3 middle = Vec3::Constant(0.5);  // cell coordinates
  Mat3 axes = Mat3::Identity() / std::sqrt(12.0);
};

Spread spread_of(const Moments& moments, double fill) {
  constexpr double kLeastMatter = 1e-6;
  Spread spread;
  if (fill >= kWholeFill || !(moments.sum() > kLeastMatter)) return spread;
  spread.middle = middle_of(moments).cwiseMax(0).cwiseMin(1);
  Mat3 second = Mat3::Zero();
  for (std::size_t k = 0; k < kMoments; ++k) {
    const Vec3 away =
        Vec3(kGaussPoints[k % 5], kGaussPoints[k / 5 % 5], kGaussPoints[k / 25]) - spread.middle;
    second += moments[static_cast<Eigen::Index>(k)] / moments.sum() * away * away.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(second);
  for (int axis = 0; axis < 3; ++axis)
    spread.axes.col(axis) =
        std::sqrt(std::max(solver.eigenvalues()[axis], 0.0)) * solver.eigenvectors().col(axis);
  return spread;
}

// The stress anywhere in the matter: a polynomial of second degree, fitted to the field at points around by least squares
// (superconvergent patch recovery, Zienkiewicz and Zhu 1992). A cell has eight points, one standard deviation of its matter from
// the matter's middle along each axis: in a whole cell those of Barlow (1976), where strains of quadratic cells are better
// by an order than elsewhere. A cell counts by its matter, so slivers say nothing.
class FieldStress {
 public:
  FieldStress(const QuadraticSystem& system, const QuadraticSolution& solution)
      : system_(system), solution_(solution), points_(system.nodes().cells.size()) {
    parallel_for_each(
        points_.size(), [&](std::size_t c) { points_[c] = points_of(c); }, kStressesAtATime);
  }

  // The cells that share a node with a cell, itself among them, ascending.
  [[nodiscard]] std::vector<std::uint32_t> around(std::size_t cell) const {
    std::vector<std::uint32_t> cells;
    for (const std::uint32_t node : system_.nodes().of_cell[cell])
      for (const QuadraticNodes::Incidence& each : system_.nodes().at(node)) cells.push_back(each.cell);
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  }

  // At a point (m, rest, world frame) of the matter in or beside `cell`, `cells` being those around.
  [[nodiscard]] SymmetricStress at(const Vec3& point, const Boundary& boundary, std::size_t cell,
                                   std::span<const std::uint32_t> cells) const {
    return bounded(fitted(system_.lattice(cell).to_lattice(point), cells), boundary, cell);
  }

  // The same of the field of one cell alone: that of the fuller ones which the point lies in, or the least outside of.
  [[nodiscard]] SymmetricStress unfitted(const Vec3& point, const Boundary& boundary,
                                         std::span<const std::uint32_t> cells) const {
    constexpr double kFuller = 0.25;  // of the fullest
    const Body& body = system_.problem().body;
    double fullest = 0, least = HUGE_VAL;
    for (const std::uint32_t c : cells) fullest = std::max(fullest, fill(c));
    std::uint32_t nearest = cells.front();
    Vec3 there = Vec3::Zero();
    for (const std::uint32_t c : cells) {
      if (fill(c) < kFuller * fullest) continue;
      const Vec3 at = cell_coordinates(body, body.parts[system_.part_of(c)], system_.nodes().cells[c], point);
      const double outside = std::max({0.0, -at.minCoeff(), at.maxCoeff() - 1});
      if (!(outside < least)) continue;
      least = outside;
      nearest = c;
      there = at;
    }
    return bounded(of_field(nearest, there), boundary, nearest);
  }

  // Of the middle of a cell's matter.
  [[nodiscard]] SymmetricStress of_cell(std::size_t cell) const {
    return fitted(lowest(cell) + system_.middle(cell), around(cell));
  }

 private:
  struct Points {
    std::array<Vec3, 8> at{};  // lattice coordinates
    std::array<SymmetricStress, 8> stress{};
  };

  [[nodiscard]] Vec3 lowest(std::size_t cell) const {
    const Body& body = system_.problem().body;
    const Index3& low = body.lattice_index[body.cell_elements[system_.nodes().cells[cell]][0]];
    return {static_cast<double>(low[0]), static_cast<double>(low[1]), static_cast<double>(low[2])};
  }

  [[nodiscard]] Mat3 rotation(std::size_t cell) const {
    return Mat3::Identity() + turn_of_cell(solution_, cell);
  }

  // Of a cell's own field at cell coordinates, turned with it.
  [[nodiscard]] SymmetricStress of_field(std::size_t cell, const Vec3& at) const {
    const Mat3 own =
        stress_of(system_.moduli(system_.part_of(cell)), elastic_gradient(system_, solution_, cell, at));
    return components(rotation(cell) * own * rotation(cell).transpose());
  }

  // With the traction that the boundary has.
  [[nodiscard]] SymmetricStress bounded(const SymmetricStress& stress, const Boundary& boundary,
                                        std::size_t cell) const {
    if (std::isnan(boundary.pressure)) return stress;
    const Mat9& moduli = system_.moduli(system_.part_of(cell));
    const Mat3 turn = rotation(cell);
    Mat3 sigma = turn.transpose() * matrix(stress) * turn;
    const Vec3 acts = -boundary.pressure * (turn.transpose() * boundary.normal);
    sigma += stress_of(moduli, across(moduli, boundary.normal, acts - sigma * boundary.normal));
    return components(turn * sigma * turn.transpose());
  }

  [[nodiscard]] Points points_of(std::size_t cell) const {
    Points points;
    const Spread spread = spread_of(system_.moments(cell), fill(cell));
    for (std::size_t k = 0; k < 8; ++k) {
      const Vec3 side((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
      const Vec3 at = spread.middle + spread.axes * side;
      points.at[k] = lowest(cell) + at;
      points.stress[k] = of_field(cell, at);
    }
    return points;
  }

  [[nodiscard]] double fill(std::size_t cell) const {
    return system_.problem().body.fill[system_.nodes().cells[cell]];
  }

  [[nodiscard]] SymmetricStress fitted(const Vec3& where, std::span<const std::uint32_t> cells) const {
    // Squared, spacings: beyond it points weigh under a thousandth. Where there are none (slivers) all are heard.
    constexpr double kFar = 2;
    Fit fit;
    if (!add_points(where, cells, kFar, fit)) {
      fit = {};
      add_points(where, cells, HUGE_VAL, fit);
    }
    return fit.value();
  }

  // Least squares for a polynomial of second degree.
  struct Fit {
    Eigen::Matrix<double, 10, 10> normal = Eigen::Matrix<double, 10, 10>::Zero();  // lower triangle
    Eigen::Matrix<double, 10, 6> values = Eigen::Matrix<double, 10, 6>::Zero();

    // `d`: spacings from where the value is asked.
    void add(const Vec3& d, double weight, const SymmetricStress& stress) {
      Eigen::Matrix<double, 10, 1> terms;
      terms << 1, d, d.cwiseProduct(d), d.x() * d.y(), d.y() * d.z(), d.z() * d.x();
      normal.selfadjointView<Eigen::Lower>().rankUpdate(terms, weight);
      values += weight * terms * stress.transpose();
    }
    [[nodiscard]] SymmetricStress value() const {
      // Of the weight, on squared coefficients of first and second degree [per spacing]: where the matter is too thin or
      // too small to tell them
      constexpr double kFirst = 1e-6, kSecond = 1e-4;
      Eigen::Matrix<double, 10, 10> damped = normal;
      damped.diagonal().segment<3>(1).array() += kFirst * normal(0, 0);
      damped.diagonal().tail<6>().array() += kSecond * normal(0, 0);
      return damped.selfadjointView<Eigen::Lower>().ldlt().solve(values).row(0).transpose();
    }
  };

  // Adds the points of the cells that are no further away; false where they hold no matter to speak of.
  bool add_points(const Vec3& where, std::span<const std::uint32_t> cells, double squared_reach,
                  Fit& fit) const {
    // Spacings. Wider fits are flatter where a notch is only a few cells large, narrower ones take over what the
    // field of one cell is off by (measured: bench/accuracy/stresses.py)
    constexpr double kReach = 0.5, kEnough = 1e-3;
    for (const std::uint32_t c : cells)
      for (std::size_t k = 0; k < 8; ++k) {
        const Vec3 d = points_[c].at[k] - where;
        const double squared = d.squaredNorm();
        if (squared > squared_reach) continue;
        fit.add(d, fill(c) * std::exp(-squared / (kReach * kReach)), points_[c].stress[k]);
      }
    return fit.normal(0, 0) > kEnough;
  }

  const QuadraticSystem& system_;
  const QuadraticSolution& solution_;
  std::vector<Points> points_;  // (cells)
};

// A sample and its stress; only those in cells that resist.
struct StressedSample {
  SurfaceSample sample;
  std::uint32_t cell = 0;  // index into QuadraticNodes::cells
  SymmetricStress stress = SymmetricStress::Zero();
  double doubt = 0;  // Pa, Stresses::element_doubt
};

std::vector<StressedSample> stressed_samples(const QuadraticSystem& system) {
  std::vector<StressedSample> found;
  const std::vector<std::uint32_t>& cells = system.nodes().cells;
  const Body& body = system.problem().body;
  const std::vector<std::uint8_t> held = system.held_elements();
  for (SurfaceSample& sample : surface_samples(body, system.pressure(), system.box())) {
    const auto cell = std::lower_bound(cells.begin(), cells.end(), sample.cell);
    if (cell == cells.end() || *cell != sample.cell) continue;
    const auto& corners = body.cell_elements[sample.cell];
    if (std::any_of(corners.begin(), corners.end(), [&](std::uint32_t e) { return held[e] != 0; }))
      sample.pressure = kUnknownPressure;
    found.push_back({sample, static_cast<std::uint32_t>(cell - cells.begin())});
  }
  return found;
}

// (cells) the samples in each cell, compressed rows.
struct SamplesOfCells {
  std::vector<std::uint32_t> offsets, list;
};

SamplesOfCells samples_of_cells(std::size_t cells, const std::vector<StressedSample>& samples) {
  SamplesOfCells found;
  found.offsets.assign(cells + 1, 0);
  for (const StressedSample& each : samples) ++found.offsets[each.cell + 1];
  for (std::size_t c = 0; c < cells; ++c) found.offsets[c + 1] += found.offsets[c];
  found.list.resize(samples.size());
  std::vector<std::uint32_t> next(found.offsets.begin(), found.offsets.end() - 1);
  for (std::uint32_t i = 0; i < samples.size(); ++i) found.list[next[samples[i].cell]++] = i;
  return found;
}

// The stresses of the samples, cell by cell.
void set_samples(const FieldStress& field, const SamplesOfCells& of_cells,
                 std::vector<StressedSample>& samples) {
  parallel_for_each(
      of_cells.offsets.size() - 1,
      [&](std::size_t c) {
        if (of_cells.offsets[c] == of_cells.offsets[c + 1]) return;
        const std::vector<std::uint32_t> around = field.around(c);
        for (std::uint32_t s = of_cells.offsets[c]; s < of_cells.offsets[c + 1]; ++s) {
          StressedSample& each = samples[of_cells.list[s]];
          const Boundary boundary{each.sample.normal, each.sample.pressure};
          each.stress = field.at(each.sample.at, boundary, c, around);
          each.doubt = von_mises(each.stress - field.unfitted(each.sample.at, boundary, around));
        }
      },
      kStressesAtATime);
}

// What acts at a point of the surface in these cells, by the nearest sample on whose side it lies; not known where there is none.
Boundary boundary_at(const Vec3& point, std::span<const QuadraticNodes::Incidence> cells,
                     const SamplesOfCells& of_cells, const std::vector<StressedSample>& samples) {
  constexpr double kSide = 0.1;  // of the distance: so little is curved away
  const SurfaceSample* nearest = nullptr;
  double least = HUGE_VAL;
  for (const QuadraticNodes::Incidence& each : cells)
    for (std::uint32_t s = of_cells.offsets[each.cell]; s < of_cells.offsets[each.cell + 1]; ++s) {
      const SurfaceSample& other = samples[of_cells.list[s]].sample;
      const Vec3 away = point - other.at;
      if (!(away.norm() < least) || std::abs(away.dot(other.normal)) > kSide * away.norm()) continue;
      least = away.norm();
      nearest = &other;
    }
  return nearest == nullptr ? Boundary{Vec3::Zero(), kUnknownPressure}
                            : Boundary{nearest->normal, nearest->pressure};
}

// Elements outside the matter get the stress of the nearest point of the surface in the cells around them.
void set_elements(const QuadraticSystem& system, const FieldStress& field, const SamplesOfCells& of_cells,
                  const std::vector<StressedSample>& samples, Stresses& found) {
  const QuadraticNodes& nodes = system.nodes();
  const Body& body = system.problem().body;
  const std::vector<std::uint8_t> inside = elements_in_matter(body);
  parallel_for_each(
      nodes.elements.size(),
      [&](std::size_t i) {
        const std::uint32_t e = nodes.elements[i];
        const auto cells = nodes.at(i);
        const auto fullest = std::max_element(cells.begin(), cells.end(), [&](auto a, auto b) {
          return body.fill[nodes.cells[a.cell]] < body.fill[nodes.cells[b.cell]];
        });
        const std::vector<std::uint32_t> around = field.around(fullest->cell);
        const Vec3& at = found.element_at[e];
        const Boundary boundary =
            inside[e] ? Boundary{Vec3::Zero(), kUnknownPressure} : boundary_at(at, cells, of_cells, samples);
        found.element[e] = field.at(at, boundary, fullest->cell, around);
        found.element_doubt[e] = von_mises(found.element[e] - field.unfitted(at, boundary, around));
      },
      kStressesAtATime);
}

// Of each vertex the largest of its samples. Where no matter lies under one (the lattice left it out) that of the nearest
// vertices along the polygons.
void set_vertices(const Surface& surface, const std::vector<StressedSample>& samples, Stresses& found) {
  found.vertex.assign(surface.vertices.size(), SymmetricStress::Zero());
  std::vector<std::uint8_t> known(surface.vertices.size(), 0);
  for (const StressedSample& each : samples) {
    SymmetricStress& stress = found.vertex[each.sample.vertex];
    if (!each.sample.is_vertex || (known[each.sample.vertex] && von_mises(each.stress) <= von_mises(stress)))
      continue;
    stress = each.stress;
    known[each.sample.vertex] = 1;
  }
  for (bool more = true; more;) {
    more = false;
    const std::vector<std::uint8_t> before = known;  // all that are one polygon away, whatever their order
    for (std::size_t p = 0; p < surface.polygon_count(); ++p) {
      const auto corners = surface.polygon(p);
      const auto from = std::find_if(corners.begin(), corners.end(), [&](auto v) { return before[v] != 0; });
      if (from == corners.end()) continue;
      for (const std::uint32_t v : corners) {
        if (known[v]) continue;
        found.vertex[v] = found.vertex[*from];
        known[v] = 1;
        more = true;
      }
    }
  }
}

// The largest of each part's samples is that of the nearest element of its cell, and of the nearest vertex.
void keep_largest(const QuadraticSystem& system, const std::vector<StressedSample>& samples,
                  const VoxelRange* core, Stresses& found) {
  const Body& body = system.problem().body;
  std::vector<const StressedSample*> largest(body.parts.size(), nullptr);
  for (const StressedSample& each : samples) {
    if (core != nullptr && !core->contains(system.lattice(each.cell).to_lattice(each.sample.at))) continue;
    const StressedSample*& most = largest[system.part_of(each.cell)];
    if (most == nullptr || von_mises(each.stress) > von_mises(most->stress)) most = &each;
  }
  for (const StressedSample* most : largest) {
    if (most == nullptr) continue;
    found.vertex[most->sample.vertex] = most->stress;
    const auto& around = body.cell_elements[system.nodes().cells[most->cell]];
    const std::uint32_t nearest = *std::min_element(around.begin(), around.end(), [&](auto a, auto b) {
      return (body.rest[a] - most->sample.at).squaredNorm() < (body.rest[b] - most->sample.at).squaredNorm();
    });
    if (von_mises(most->stress) < von_mises(found.element[nearest])) continue;
    found.element[nearest] = most->stress;
    found.element_at[nearest] = most->sample.at;
    found.element_doubt[nearest] = most->doubt;
  }
}

}  // namespace

Stresses field_stresses(const QuadraticSystem& system, const QuadraticSolution& solution, const State& state,
                        const VoxelRange* core) {
  const QuadraticNodes& nodes = system.nodes();
  const FieldStress field(system, solution);
  Stresses found = stresses(system.problem(), state);  // for the points that elements stand for
  parallel_for_each(
      nodes.cells.size(), [&](std::size_t c) { found.cell[nodes.cells[c]] = field.of_cell(c); },
      kStressesAtATime);
  found.element_doubt.assign(found.element.size(), 0);
  std::vector<StressedSample> samples = stressed_samples(system);
  const SamplesOfCells of_cells = samples_of_cells(nodes.cells.size(), samples);
  set_samples(field, of_cells, samples);
  set_elements(system, field, of_cells, samples, found);
  set_vertices(system.problem().body.surface, samples, found);
  keep_largest(system, samples, core, found);
  return found;
}

}  // namespace flexel::simulate
