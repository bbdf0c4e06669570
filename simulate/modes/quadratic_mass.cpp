// Sums along one axis after the other, as the stiffness' products (sum factorization).
#include "simulate/modes/quadratic_mass.h"

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kCellsAtATime = 32;
constexpr std::size_t kPoints = kMomentPoints;

// out (outer x to x inner) = matrix (to x from) by the middle index of in (outer x from x inner)
template <std::size_t From, std::size_t To>
void along_axis(const double* in, double* out, std::size_t outer, std::size_t inner, const double* matrix) {
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t t = 0; t < To; ++t) {
      double* to = out + (o * To + t) * inner;
      for (std::size_t q = 0; q < inner; ++q) to[q] = 0;
      for (std::size_t f = 0; f < From; ++f) {
        const double factor = matrix[t * From + f];
        const double* from = in + (o * From + f) * inner;
        for (std::size_t q = 0; q < inner; ++q) to[q] += factor * from[q];
      }
    }
}

// Of the quadratic shape functions along an axis: int N_a N_b.
constexpr std::array<double, 9> kAlong = {4. / 30, 2. / 30,  -1. / 30, 2. / 30, 16. / 30,
                                          2. / 30, -1. / 30, 2. / 30,  4. / 30};

}  // namespace

QuadraticMass::QuadraticMass(const QuadraticSystem& system)
    : system_(system), forces_(system.nodes().cells.size()) {
  for (std::size_t c = 0; c < forces_.size(); ++c)
    mass_.push_back(system.problem().materials[system.part_of(c)].density * system.lattice(c).spacing.prod());
  for (std::size_t p = 0; p < kPoints; ++p) {
    const double x = kGaussPoints[p];
    at_points_[3 * p] = (1 - x) * (1 - 2 * x);
    at_points_[3 * p + 1] = 4 * x * (1 - x);
    at_points_[3 * p + 2] = x * (2 * x - 1);
  }
}

void QuadraticMass::whole_cell(CellValues& values) const {
  CellValues other;
  along_axis<3, 3>(values.data(), other.data(), 9, 3, kAlong.data());
  along_axis<3, 3>(other.data(), values.data(), 3, 9, kAlong.data());
  along_axis<3, 3>(values.data(), other.data(), 1, 27, kAlong.data());
  values = other;
}

void QuadraticMass::cut_cell(std::size_t cell, CellValues& values) const {
  constexpr std::size_t kSquare = kPoints * kPoints;
  std::array<double, kPoints * 27> one;
  std::array<double, kSquare * 9> two;
  std::array<double, kSquare * kPoints * 3> at;
  along_axis<3, kPoints>(values.data(), one.data(), 9, 3, at_points_.data());
  along_axis<3, kPoints>(one.data(), two.data(), 3, 3 * kPoints, at_points_.data());
  along_axis<3, kPoints>(two.data(), at.data(), 1, 3 * kSquare, at_points_.data());
  const Moments weight = system_.stiffness_moments(cell);
  for (std::size_t k = 0; k < kMoments; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) at[3 * k + axis] *= weight[static_cast<Eigen::Index>(k)];
  std::array<double, 15> back;
  for (std::size_t p = 0; p < kPoints; ++p)
    for (std::size_t n = 0; n < 3; ++n) back[kPoints * n + p] = at_points_[3 * p + n];
  along_axis<kPoints, 3>(at.data(), two.data(), 1, 3 * kSquare, back.data());
  along_axis<kPoints, 3>(two.data(), one.data(), 3, 3 * kPoints, back.data());
  along_axis<kPoints, 3>(one.data(), values.data(), 9, 3, back.data());
}

void QuadraticMass::multiply(const double* x, double* y) const {
  const QuadraticNodes& nodes = system_.nodes();
  parallel_for_each(
      nodes.cells.size(),
      [&](std::size_t c) {
        CellValues& values = forces_[c];
        for (std::size_t n = 0; n < kQuadraticNodes; ++n)
          for (std::size_t axis = 0; axis < 3; ++axis)
            values[3 * n + axis] = x[3 * std::size_t{nodes.of_cell[c][n]} + axis];
        if (system_.is_whole(c))
          whole_cell(values);
        else
          cut_cell(c, values);
        for (double& value : values) value *= mass_[c];
      },
      kCellsAtATime);
  parallel_for_each(nodes.size(), [&](std::size_t n) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (const QuadraticNodes::Incidence& at : nodes.at(n)) sum += forces_[at.cell][3 * at.node + axis];
      y[3 * n + axis] = sum;
    }
  });
}

}  // namespace flexel::simulate
