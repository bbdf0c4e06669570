// As the blocks of single cells: the inverse of Cholesky's factor of the scaled stiffness of the block's nodes.
#include "simulate/quadratic/bond_blocks.h"

#include <algorithm>
#include <cmath>

#include "base/math/dense.h"
#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kMostNodes = 220;  // of a block: larger ones are those of their own cell alone
constexpr double kRaisedBond = 1e-6;     // of the scaled diagonal
constexpr std::size_t kBondBlocksAtATime = 4;

Eigen::Index place_in(const std::vector<std::uint32_t>& nodes, std::uint32_t node) {
  const auto found = std::lower_bound(nodes.begin(), nodes.end(), node);
  return found != nodes.end() && *found == node ? 3 * (found - nodes.begin()) : -1;
}

}  // namespace

BondBlocks::BondBlocks(const QuadraticOperator& matrix, const std::vector<BondedCells>& bonds,
                       const CellBlock& block) {
  if (bonds.empty()) return;
  const QuadraticNodes& nodes = matrix.nodes();
  choose_nodes(nodes, bonds);
  offsets_.assign(nodes.size() + 1, 0);
  std::size_t values = 0;
  for (Part& part : parts_) {
    part.values = values;
    values += 3 * part.nodes.size();
    for (const std::uint32_t node : part.nodes) ++offsets_[node + 1];
  }
  values_.assign(values, 0);
  for (std::size_t n = 0; n < nodes.size(); ++n) offsets_[n + 1] += offsets_[n];
  places_.resize(offsets_.back());
  std::vector<std::uint32_t> next(offsets_.begin(), offsets_.end() - 1);
  for (const Part& part : parts_)
    for (std::size_t i = 0; i < part.nodes.size(); ++i) places_[next[part.nodes[i]]++] = part.values + 3 * i;
  parallel_for_each(
      parts_.size(), [&](std::size_t p) { factorise(parts_[p], assembled(parts_[p], matrix, block)); },
      kBondBlocksAtATime);
}

void BondBlocks::choose_nodes(const QuadraticNodes& nodes, const std::vector<BondedCells>& bonds) {
  of_cell_.assign(nodes.cells.size(), 0);
  std::vector<std::vector<std::uint32_t>> beyond(nodes.cells.size());  // nodes of the surface, with doubles
  for (const BondedCells& pair : bonds)
    for (std::size_t side = 0; side < 2; ++side) {
      const std::array<bool, kQuadraticNodes> on = nodes_of_surface(pair, 1 - side);
      of_cell_[pair.cell[side]] = 1;
      for (std::size_t n = 0; n < kQuadraticNodes; ++n)
        if (on[n]) beyond[pair.cell[side]].push_back(nodes.of_cell[pair.cell[1 - side]][n]);
    }
  for (std::size_t c = 0; c < nodes.cells.size(); ++c) {
    if (of_cell_[c] == 0) continue;
    std::vector<std::uint32_t> own(nodes.of_cell[c].begin(), nodes.of_cell[c].end()), all = own;
    all.insert(all.end(), beyond[c].begin(), beyond[c].end());
    for (auto* list : {&own, &all}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
    parts_.push_back({all.size() > kMostNodes ? own : all, 0, {}, {}});
  }
}

Eigen::MatrixXd BondBlocks::assembled(const Part& part, const QuadraticOperator& matrix,
                                      const CellBlock& block) {
  const QuadraticNodes& nodes = matrix.nodes();
  const CellCouplings& couplings = *matrix.cells().couplings();
  std::vector<std::uint32_t> around;
  for (const std::uint32_t node : part.nodes)
    for (const QuadraticNodes::Incidence& at : nodes.at(node)) around.push_back(at.cell);
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  const auto size = static_cast<Eigen::Index>(3 * part.nodes.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  std::vector<std::array<Eigen::Index, kQuadraticNodes>> place(around.size());
  for (std::size_t i = 0; i < around.size(); ++i)
    for (std::size_t n = 0; n < kQuadraticNodes; ++n)
      place[i][n] = place_in(part.nodes, nodes.of_cell[around[i]][n]);
  for (std::size_t i = 0; i < around.size(); ++i) {
    for (std::size_t a = 0; a < kQuadraticNodes; ++a)
      for (std::size_t b = 0; b < kQuadraticNodes; ++b)
        if (place[i][a] >= 0 && place[i][b] >= 0 && place[i][b] <= place[i][a])
          sum.block<3, 3>(place[i][a], place[i][b]) += block(around[i], a, b);
    const std::int32_t coupled = couplings.place[around[i]];
    for (std::uint32_t at = coupled < 0 ? 0 : couplings.offsets[static_cast<std::size_t>(coupled)];
         coupled >= 0 && at < couplings.offsets[static_cast<std::size_t>(coupled) + 1]; ++at) {
      const std::uint32_t pair = couplings.of_cell[at] / 2, side = couplings.of_cell[at] % 2;
      const auto other =
          std::lower_bound(around.begin(), around.end(), couplings.pairs[pair][1 - side]) - around.begin();
      if (static_cast<std::size_t>(other) == around.size() ||
          around[static_cast<std::size_t>(other)] != couplings.pairs[pair][1 - side])
        continue;
      // this cell's rows
      for (std::size_t a = 0; a < kQuadraticNodes; ++a)
        for (std::size_t b = 0; b < kQuadraticNodes; ++b) {
          const Eigen::Index row = place[i][a], column = place[static_cast<std::size_t>(other)][b];
          if (row < 0 || column < 0 || column > row) continue;
          const auto p = static_cast<Eigen::Index>(3 * a), q = static_cast<Eigen::Index>(3 * b);
          sum.block<3, 3>(row, column) += side == 0
                                              ? Mat3(couplings.cross[pair].block<3, 3>(p, q))
                                              : Mat3(couplings.cross[pair].block<3, 3>(q, p).transpose());
        }
    }
  }
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  for (std::size_t n = 0; n < part.nodes.size(); ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (matrix.held()[part.nodes[n]] >> axis & 1) {
        const auto i = static_cast<Eigen::Index>(3 * n + axis);
        sum.row(i).setZero();
        sum.col(i).setZero();
        sum(i, i) = 1;
      }
  return sum;
}

void BondBlocks::factorise(Part& part, const Eigen::MatrixXd& sum) {
  const Eigen::Index size = sum.rows();
  const Eigen::VectorXd scale = sum.diagonal().cwiseAbs().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * sum * scale.asDiagonal();
  scaled.diagonal().array() += kRaisedBond;
  CholeskyFactor factor(scaled);
  for (double more = 1e-4; !factor.positive() && more < 10; more *= 10) {
    scaled.diagonal().array() += more;
    factor = CholeskyFactor(scaled);
  }
  // else by the diagonal alone
  const Eigen::MatrixXd lower =
      factor.positive() ? factor.inverse_lower() : Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size));
  part.scale = scale.cast<float>();
  part.inverse_factor.reserve(static_cast<std::size_t>(size * (size + 1) / 2));
  for (Eigen::Index row = 0; row < size; ++row)
    for (Eigen::Index column = 0; column <= row; ++column)
      part.inverse_factor.push_back(static_cast<float>(lower(row, column)));
}

void BondBlocks::solve(const std::vector<double>& weight, const std::vector<Vec3>& residual) {
  parallel_for_each(
      parts_.size(),
      [&](std::size_t p) {
        const Part& part = parts_[p];
        const auto size = static_cast<Eigen::Index>(3 * part.nodes.size());
        Eigen::VectorXf wanted(size);
        for (std::size_t n = 0; n < part.nodes.size(); ++n)
          wanted.segment<3>(static_cast<Eigen::Index>(3 * n)) =
              (weight[part.nodes[n]] * residual[part.nodes[n]]).cast<float>();
        wanted = wanted.cwiseProduct(part.scale).eval();
        Eigen::VectorXf found = Eigen::VectorXf::Zero(size);
        const float* row = part.inverse_factor.data();
        for (Eigen::Index i = 0; i < size; row += ++i) {
          const Eigen::Map<const Eigen::VectorXf> numbers(row, i + 1);
          found.head(i + 1) += numbers.dot(wanted.head(i + 1)) * numbers;
        }
        Eigen::Map<Eigen::VectorXf>(&values_[part.values], size) = found.cwiseProduct(part.scale);
      },
      kBondBlocksAtATime);
}

Vec3 BondBlocks::sum(std::size_t node) const {
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t at = offsets_[node]; at < offsets_[node + 1]; ++at)
    sum += Eigen::Map<const Eigen::Vector3f>(&values_[places_[at]]).cast<double>();
  return sum;
}

}  // namespace flexel::simulate
