// A product is made cell by cell, then gathered node by node in the order of the cells, so that it has the same
// bits for any number of threads. Displacements are taken beside those of a cell's first node, for a translation needs no
// force and floats have no digits to spare for it.
#include "simulate/quadratic/cells/cell_products.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/parallel.h"

namespace flexel::simulate {
namespace {

constexpr std::size_t kEightsAtATime = 4, kNodesAtATime = 512;
constexpr std::size_t kWidth = quadratic_kernel::kWidth, kPointsPerAxis = 3;
constexpr std::size_t kWholeMoments = kPointsPerAxis * kPointsPerAxis * kPointsPerAxis;
constexpr std::size_t kTurnNumbers = static_cast<std::size_t>(kCellUnknowns) * 3;
using CellValues = Eigen::Matrix<double, kCellUnknowns, 1>;

void run_kernel(bool whole, const quadratic_kernel::EightCells<double>& cells,
                const quadratic_kernel::Elasticity<double>& part, double* values) {
  quadratic_kernel::best().product[whole ? 0 : 1](cells, part, values);
}
void run_kernel(bool whole, const quadratic_kernel::EightCells<float>& cells,
                const quadratic_kernel::Elasticity<float>& part, float* values) {
  quadratic_kernel::best().product_of_floats[whole ? 0 : 1](cells, part, values);
}

template <class To, class From>
quadratic_kernel::Elasticity<To> in_precision(const quadratic_kernel::Elasticity<From>& from,
                                              double unit = 1) {
  quadratic_kernel::Elasticity<To> to{};
  std::transform(std::begin(from.scale), std::end(from.scale), to.scale,
                 [](From x) { return static_cast<To>(x); });
  std::transform(std::begin(from.moduli), std::end(from.moduli), to.moduli,
                 [unit](From x) { return static_cast<To>(x / unit); });
  to.isotropic = from.isotropic;
  return to;
}

template <class To, class From>
std::vector<To> in_precision(const std::vector<From>& from, double unit = 1) {
  std::vector<To> to(from.size());
  std::transform(from.begin(), from.end(), to.begin(), [unit](From x) { return static_cast<To>(x / unit); });
  return to;
}

// A power of two near the stiffest node of a part's cells [N/m].
template <class Parts>
double stiffness_unit(const Parts& parts) {
  double most = 0;
  for (const auto& each : parts)
    for (int i = 0; i < 6; ++i)
      for (int axis = 0; axis < 3; ++axis)
        most = std::max(most, static_cast<double>(each.elasticity.moduli[7 * i]) *
                                  static_cast<double>(each.elasticity.scale[axis]) *
                                  static_cast<double>(each.elasticity.scale[axis]));
  return most > 0 ? std::exp2(std::floor(std::log2(most))) : 1;
}

template <class Number>
void put_rotation(const Mat3& rotation, std::size_t lane, Number* to) {
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      to[kWidth * static_cast<std::size_t>(3 * i + j) + lane] = static_cast<Number>(rotation(i, j));
}

using TurnColumns = std::array<Mat3, kQuadraticNodes>;  // of CellTurn

void add_lower(const auto& matrix, std::size_t nodes, double* blocks) {
  for (Eigen::Index a = 0; a < static_cast<Eigen::Index>(3 * nodes); a += 3)
    for (Eigen::Index b = 0; b <= a; b += 3)
      for (Eigen::Index i = 0; i < 9; ++i) *blocks++ += matrix(a + i / 3, b + i % 3);
}

}  // namespace

CornerMatrix corners_of(const CellMatrix& matrix) {
  Eigen::Matrix<double, kCellUnknowns, 24> embedding = Eigen::Matrix<double, kCellUnknowns, 24>::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n)
    for (std::size_t a = 0; a < 8; ++a)
      embedding.block<3, 3>(static_cast<Eigen::Index>(3 * n), static_cast<Eigen::Index>(3 * a)) =
          trilinear_weight(n, a) * Mat3::Identity();
  return embedding.transpose() * matrix * embedding;
}

CellCouplings::CellCouplings(std::vector<std::array<std::uint32_t, 2>> pairs_of_cells, std::size_t cell_count)
    : pairs(std::move(pairs_of_cells)), cross(pairs.size()), offsets{0}, place(cell_count, -1) {
  std::vector<std::vector<std::uint32_t>> of(cell_count);
  for (std::uint32_t p = 0; p < pairs.size(); ++p)
    for (std::uint32_t side = 0; side < 2; ++side) of[pairs[p][side]].push_back(2 * p + side);
  for (std::uint32_t c = 0; c < cell_count; ++c) {
    if (of[c].empty()) continue;
    place[c] = static_cast<std::int32_t>(cells.size());
    cells.push_back(c);
    of_cell.insert(of_cell.end(), of[c].begin(), of[c].end());
    offsets.push_back(static_cast<std::uint32_t>(of_cell.size()));
  }
}

template <class Number>
CellProducts<Number>::CellProducts(const QuadraticNodes& nodes, const std::vector<PartCells>& parts,
                                   const std::vector<std::uint32_t>& part,
                                   const std::function<std::optional<Moments>(std::size_t)>& moments)
    : nodes_(&nodes), place_(nodes.cells.size()), cell_force_(nodes.cells.size() * kCellUnknowns) {
  for (const PartCells& each : parts) {
    parts_.push_back({in_precision<Number>(each.elasticity), each.axes, each.axes == Mat3::Identity()});
    first_rotation_.resize(first_rotation_.size() + 9 * kWidth);
    for (std::size_t lane = 0; lane < kWidth; ++lane)
      put_rotation(each.axes.transpose(), lane, first_rotation_.data() + first_rotation_.size() - 9 * kWidth);
  }
  constexpr double weights[kPointsPerAxis] = {5. / 18, 8. / 18, 5. / 18};  // Gauss's on [0, 1]
  for (std::size_t k = 0; k < kWholeMoments; ++k)
    moments_.insert(moments_.end(), kWidth,
                    static_cast<Number>(weights[k % 3] * weights[k / 3 % 3] * weights[k / 9]));
  std::vector<std::vector<std::uint32_t>> lists(2 * parts.size());  // of a part: cut cells, whole ones
  for (std::uint32_t c = 0; c < nodes.cells.size(); ++c)
    lists[2 * part[c] + (moments(c) ? 0 : 1)].push_back(c);
  for (std::size_t list = 0; list < lists.size(); ++list)
    for (std::size_t first = 0; first < lists[list].size(); first += kWidth) {
      Eight& eight = eights_.emplace_back();
      eight.part = static_cast<std::uint32_t>(list / 2);
      eight.whole = list % 2 == 1;
      eight.count = static_cast<std::uint32_t>(std::min(kWidth, lists[list].size() - first));
      eight.moments = eight.whole ? 0 : moments_.size();
      if (!eight.whole) moments_.resize(moments_.size() + kMoments * kWidth);
      for (std::size_t lane = 0; lane < eight.count; ++lane) {
        const std::uint32_t c = eight.cell[lane] = lists[list][first + lane];
        place_[c] = static_cast<std::uint32_t>(kWidth * (eights_.size() - 1) + lane);
        if (eight.whole) continue;
        const Moments own = *moments(c);
        for (std::size_t k = 0; k < kMoments; ++k)
          moments_[eight.moments + kWidth * k + lane] =
              static_cast<Number>(own[static_cast<Eigen::Index>(k)]);
      }
    }
}

template <class Number>
template <class Other>
CellProducts<Number>::CellProducts(const CellProducts<Other>& other)
    : nodes_(other.nodes_),
      unit_(stiffness_unit(other.parts_)),
      place_(other.place_),
      moments_(in_precision<Number>(other.moments_)),
      first_rotation_(in_precision<Number>(other.first_rotation_)),
      rotation_(in_precision<Number>(other.rotation_)),
      a_(in_precision<Number>(other.a_, unit_)),
      gamma_(in_precision<Number>(other.gamma_)),
      turned_(other.turned_),
      support_at_(other.support_at_),
      support_(other.support_),
      couplings_(other.couplings_),
      cell_force_(other.cell_force_.size()) {
  for (const auto& each : other.parts_)
    parts_.push_back({in_precision<Number>(each.elasticity, unit_), each.axes, each.along_world});
  for (const auto& each : other.eights_)
    eights_.push_back({each.cell, each.count, each.part, each.whole, each.moments});
}

template <class Number>
void CellProducts<Number>::reserve_supports(const std::vector<std::uint32_t>& cells) {
  support_at_.assign(place_.size(), -1);
  for (std::size_t i = 0; i < cells.size(); ++i) support_at_[cells[i]] = static_cast<std::int32_t>(i);
  support_.assign(cells.size() * kPackedSize, 0);
}

template <class Number>
void CellProducts<Number>::set_support(std::size_t cell, const CellMatrix& matrix) {
  double* to = &support_[static_cast<std::size_t>(support_at_[cell]) * kPackedSize];
  for (int i = 0; i < kCellUnknowns; ++i)
    for (int j = 0; j <= i; ++j) *to++ = matrix(i, j);
}

template <class Number>
void CellProducts<Number>::turn(const std::vector<CellTurn>& turns,
                                const std::vector<CellTurn::Columns>& more) {
  rotation_.assign(eights_.size() * 9 * kWidth, 0);
  a_.assign(eights_.size() * kTurnNumbers * kWidth, 0);
  gamma_ = a_;
  turned_.resize(turns.size());
  parallel_for_each(
      eights_.size(),
      [&](std::size_t e) {
        const Eight& eight = eights_[e];
        const Mat3& axes = parts_[eight.part].axes;
        for (std::size_t lane = 0; lane < eight.count; ++lane) {
          const CellTurn& turn = turns[eight.cell[lane]];
          turned_[eight.cell[lane]] = turn.rotation;
          put_rotation((turn.rotation * axes).transpose(), lane, &rotation_[e * 9 * kWidth]);
          for (Eigen::Index n = 0; n < kCellUnknowns; n += 3) {
            Mat3 added = turn.a.template middleRows<3>(n);
            if (!more.empty()) added += more[eight.cell[lane]].template middleRows<3>(n);
            const Mat3 a = axes.transpose() * added,
                       gamma = axes.transpose() * turn.gamma.template middleRows<3>(n);
            for (Eigen::Index i = 0; i < 3; ++i)
              for (Eigen::Index k = 0; k < 3; ++k) {
                const std::size_t to =
                    kWidth * (e * kTurnNumbers + static_cast<std::size_t>(3 * (n + i) + k)) + lane;
                a_[to] = static_cast<Number>(a(i, k));
                gamma_[to] = static_cast<Number>(gamma(i, k));
              }
          }
        }
      },
      kEightsAtATime);
}

template <class Number>
void CellProducts<Number>::apply(std::size_t e, Number* values) const {
  const Eight& eight = eights_[e];
  const Part& part = parts_[eight.part];
  quadratic_kernel::EightCells<Number> cells{&moments_[eight.moments], nullptr, nullptr, nullptr};
  if (!rotation_.empty()) {
    cells.rotation = &rotation_[e * 9 * kWidth];
    cells.a = &a_[e * kTurnNumbers * kWidth];
    cells.gamma = &gamma_[e * kTurnNumbers * kWidth];
  } else if (!part.along_world) {
    cells.rotation = &first_rotation_[eight.part * 9 * kWidth];
  }
  run_kernel(eight.whole, cells, part.elasticity, values);
}

template <class Number>
CellValues CellProducts<Number>::support_forces(std::size_t cell, const double* x) const {
  CellValues own, sum = CellValues::Zero();
  for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
    const Eigen::Map<const Vec3> at(x + 3 * nodes_->of_cell[cell][n]);
    own.segment<3>(static_cast<Eigen::Index>(3 * n)) =
        turned_.empty() ? Vec3(at) : Vec3(turned_[cell].transpose() * at);
  }
  const double* packed = &support_[static_cast<std::size_t>(support_at_[cell]) * kPackedSize];
  for (int i = 0; i < kCellUnknowns; ++i) {
    const Eigen::Map<const Eigen::VectorXd> row(packed, i);
    sum[i] += row.dot(own.head(i)) + packed[i] * own[i];
    sum.head(i) += own[i] * row;
    packed += i + 1;
  }
  for (Eigen::Index n = 0; n < kCellUnknowns && !turned_.empty(); n += 3)
    sum.segment<3>(n) = (turned_[cell] * sum.segment<3>(n)).eval();
  return sum / unit_;
}

// Summed up in doubles: a translation leaves nothing, though both terms are large.
template <class Number>
void CellProducts<Number>::add_coupled(const double* x) const {
  const CellCouplings& couplings = *couplings_;
  parallel_for_each(
      couplings.cells.size(),
      [&](std::size_t i) {
        const std::uint32_t cell = couplings.cells[i];
        CellValues there, sum = CellValues::Zero();
        for (std::uint32_t at = couplings.offsets[i]; at < couplings.offsets[i + 1]; ++at) {
          const std::size_t pair = couplings.of_cell[at] / 2, side = couplings.of_cell[at] % 2;
          const auto& other = nodes_->of_cell[couplings.pairs[pair][1 - side]];
          for (std::size_t n = 0; n < kQuadraticNodes; ++n)
            there.segment<3>(static_cast<Eigen::Index>(3 * n)) =
                Eigen::Map<const Vec3>(x + 3 * std::size_t{other[n]});
          if (side == 0)
            sum.noalias() += couplings.cross[pair] * there;
          else
            sum.noalias() += couplings.cross[pair].transpose() * there;
        }
        sum = (sum / unit_ + support_forces(cell, x)).eval();
        Number* to = &cell_force_[std::size_t{cell} * kCellUnknowns];
        for (Eigen::Index n = 0; n < kCellUnknowns; ++n) to[n] += static_cast<Number>(sum[n]);
      },
      kEightsAtATime);
}

template <class Number>
void CellProducts<Number>::forces(const double* x, double* y) const {
  parallel_for_each(
      eights_.size(),
      [&](std::size_t e) {
        const Eight& eight = eights_[e];
        alignas(64) Number values[kCellUnknowns * kWidth];
        std::fill(std::begin(values), std::end(values), Number{0});
        for (std::size_t lane = 0; lane < eight.count; ++lane) {
          const auto& of_cell = nodes_->of_cell[eight.cell[lane]];
          const double* first = x + 3 * std::size_t{of_cell[0]};
          for (std::size_t n = 0; n < kQuadraticNodes; ++n)
            for (std::size_t axis = 0; axis < 3; ++axis)
              values[kWidth * (3 * n + axis) + lane] =
                  static_cast<Number>(x[3 * std::size_t{of_cell[n]} + axis] - first[axis]);
        }
        apply(e, values);
        for (std::size_t lane = 0; lane < eight.count; ++lane) {
          Number* to = &cell_force_[eight.cell[lane] * kCellUnknowns];
          for (std::size_t i = 0; i < kCellUnknowns; ++i) to[i] = values[kWidth * i + lane];
          const std::uint32_t cell = eight.cell[lane];
          if (!is_supported(cell) || (couplings_ && couplings_->place[cell] >= 0)) continue;
          const CellValues held = support_forces(cell, x);
          for (std::size_t i = 0; i < kCellUnknowns; ++i)
            to[i] += static_cast<Number>(held[static_cast<Eigen::Index>(i)]);
        }
      },
      kEightsAtATime);
  if (couplings_) add_coupled(x);
  parallel_for_each(
      nodes_->size(),
      [&](std::size_t n) {
        double sum[3] = {0, 0, 0};
        for (const QuadraticNodes::Incidence& at : nodes_->at(n))
          for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] += static_cast<double>(cell_force_[at.cell * kCellUnknowns + 3 * at.node + axis]);
        for (std::size_t axis = 0; axis < 3; ++axis) y[3 * n + axis] = unit_ * sum[axis];
      },
      kNodesAtATime);
}

// All lanes are one cell.
template <class Number>
void CellProducts<Number>::elastic_forces(std::size_t cell, const CellColumns& x,
                                          CellColumns& product) const {
  const Eight& eight = eights_[place_[cell] / kWidth];
  const Part& part = parts_[eight.part];
  alignas(64) Number moments[kMoments * kWidth], values[kCellUnknowns * kWidth];
  const Number* own = &moments_[eight.moments + place_[cell] % kWidth];
  for (std::size_t k = 0; k < (eight.whole ? kWholeMoments : kMoments); ++k)
    std::fill_n(moments + kWidth * k, kWidth, own[kWidth * k]);
  quadratic_kernel::EightCells<Number> cells{moments, nullptr, nullptr, nullptr};
  if (!part.along_world) cells.rotation = &first_rotation_[eight.part * 9 * kWidth];
  for (Eigen::Index i = 0; i < kCellUnknowns; ++i)
    for (Eigen::Index c = 0; c < 8; ++c) values[8 * i + c] = static_cast<Number>(x(i, c));
  run_kernel(eight.whole, cells, part.elasticity, values);
  for (Eigen::Index i = 0; i < kCellUnknowns; ++i)
    for (Eigen::Index c = 0; c < 8; ++c) product(i, c) = static_cast<double>(values[8 * i + c]);
}

template <class Number>
CellMatrix CellProducts<Number>::support(std::size_t cell) const {
  const double* from = &support_[static_cast<std::size_t>(support_at_[cell]) * kPackedSize];
  CellMatrix made;
  for (int i = 0; i < kCellUnknowns; ++i)
    for (int j = 0; j <= i; ++j) made(i, j) = made(j, i) = *from++;
  if (!turned_.empty())
    for (Eigen::Index a = 0; a < kCellUnknowns; a += 3)
      for (Eigen::Index b = 0; b < kCellUnknowns; b += 3)
        made.block<3, 3>(a, b) = (turned_[cell] * made.block<3, 3>(a, b) * turned_[cell].transpose()).eval();
  return made;
}

template <class Number>
void CellProducts<Number>::first_matrices(
    const Eight& eight, std::vector<double>& nodes,
    std::vector<double>& corners) const requires std::same_as<Number, double> {
  static const std::vector<double> whole = [] {
    std::vector<double> made;
    for (const double weight : whole_moments()) made.insert(made.end(), kWidth, weight);
    return made;
  }();
  nodes.resize(quadratic_kernel::kNodeMatrix * kWidth);
  corners.resize(quadratic_kernel::kCornerMatrix * kWidth);
  quadratic_kernel::best_matrices().matrices(eight.whole ? whole.data() : &moments_[eight.moments],
                                             parts_[eight.part].elasticity, nodes.data(), corners.data());
}

template <class Number>
void CellProducts<Number>::turn_blocks(std::size_t cell,
                                       CellBlocks& blocks) const requires std::same_as<Number, double> {
  const Part& part = parts_[eights_[place_[cell] / kWidth].part];
  const Mat3 rotation = turned_.empty() ? part.axes : Mat3(turned_[cell] * part.axes);
  const auto turn = [&](std::size_t count, const TurnColumns& a, const TurnColumns& gamma, double* block) {
    for (std::size_t p = 0; p < count; ++p)
      for (std::size_t q = 0; q <= p; ++q, block += 9) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> own(block);
        Mat3 sum = own;
        if (!rotation_.empty()) sum += a[p] * gamma[q].transpose() + gamma[p] * a[q].transpose();
        own = rotation * sum * rotation.transpose();
      }
  };
  TurnColumns a{}, gamma{}, corner_a{}, corner_gamma{};
  if (!rotation_.empty()) {
    const std::size_t first = place_[cell] / kWidth * kTurnNumbers * kWidth + place_[cell] % kWidth;
    corner_a.fill(Mat3::Zero());
    corner_gamma.fill(Mat3::Zero());
    for (std::size_t n = 0; n < kQuadraticNodes; ++n) {
      for (std::size_t i = 0; i < 9; ++i) {
        const std::size_t at = first + kWidth * (9 * n + i);
        const auto row = static_cast<Eigen::Index>(i / 3), column = static_cast<Eigen::Index>(i % 3);
        a[n](row, column) = a_[at];
        gamma[n](row, column) = gamma_[at];
      }
      for (std::size_t corner = 0; corner < 8; ++corner) {
        corner_a[corner] += trilinear_weight(n, corner) * a[n];
        corner_gamma[corner] += trilinear_weight(n, corner) * gamma[n];
      }
    }
  }
  if (!rotation_.empty() || !part.along_world) {
    turn(kQuadraticNodes, a, gamma, blocks.nodes.data());
    turn(8, corner_a, corner_gamma, blocks.corners.data());
  }
  if (!is_supported(cell)) return;
  const CellMatrix held = support(cell);
  add_lower(held, kQuadraticNodes, blocks.nodes.data());
  add_lower(corners_of(held), 8, blocks.corners.data());
}

template <class Number>
void CellProducts<Number>::matrices(const std::function<void(std::uint32_t, const CellBlocks&)>& take)
    const requires std::same_as<Number, double> {
  const std::vector<std::uint32_t> twin = twins();
  parallel_for_each(
      eights_.size(),
      [&](std::size_t e) {
        const Eight& eight = eights_[e];
        const auto alone = [&](std::size_t lane) { return twin[eight.cell[lane]] == eight.cell[lane]; };
        bool any = false;
        for (std::size_t lane = 0; lane < eight.count; ++lane) any |= alone(lane);
        if (!any) return;
        thread_local std::vector<double> nodes, corners;
        first_matrices(eight, nodes, corners);
        CellBlocks blocks;
        for (std::size_t lane = 0; lane < eight.count; ++lane) {
          if (!alone(lane)) continue;
          for (std::size_t i = 0; i < blocks.nodes.size(); ++i) blocks.nodes[i] = nodes[kWidth * i + lane];
          for (std::size_t i = 0; i < blocks.corners.size(); ++i)
            blocks.corners[i] = corners[kWidth * i + lane];
          turn_blocks(eight.cell[lane], blocks);
          take(eight.cell[lane], blocks);
        }
      },
      kEightsAtATime);
}

template <class Number>
CellMatrix CellProducts<Number>::matrix(std::size_t cell) const requires std::same_as<Number, double> {
  std::vector<double> nodes, corners;
  first_matrices(eights_[place_[cell] / kWidth], nodes, corners);
  CellBlocks blocks;
  blocks.corners.fill(0);
  for (std::size_t i = 0; i < blocks.nodes.size(); ++i)
    blocks.nodes[i] = nodes[kWidth * i + place_[cell] % kWidth];
  turn_blocks(cell, blocks);
  CellMatrix made;
  const double* number = blocks.nodes.data();
  for (Eigen::Index a = 0; a < kCellUnknowns; a += 3)
    for (Eigen::Index b = 0; b <= a; b += 3)
      for (Eigen::Index i = 0; i < 9; ++i, ++number) {
        made(a + i / 3, b + i % 3) = *number;
        if (a != b) made(b + i % 3, a + i / 3) = *number;
      }
  return 0.5 * (made + made.transpose());  // rounding alone makes it uneven
}

template <class Number>
std::vector<std::uint32_t> CellProducts<Number>::twins() const {
  std::vector<std::uint32_t> same(place_.size());
  std::iota(same.begin(), same.end(), 0U);
  if (!rotation_.empty()) return same;
  std::vector<std::int64_t> first(parts_.size(), -1);
  for (const Eight& eight : eights_)
    for (std::size_t lane = 0; eight.whole && lane < eight.count; ++lane) {
      const std::uint32_t cell = eight.cell[lane];
      if (is_supported(cell)) continue;
      if (first[eight.part] < 0) first[eight.part] = cell;
      same[cell] = static_cast<std::uint32_t>(first[eight.part]);
    }
  return same;
}

template <class Number>
double CellProducts<Number>::fill(std::size_t cell) const {
  const Eight& eight = eights_[place_[cell] / kWidth];
  if (eight.whole) return 1;
  double sum = 0;
  for (std::size_t k = 0; k < kMoments; ++k)
    sum += static_cast<double>(moments_[eight.moments + kWidth * k + place_[cell] % kWidth]);
  return sum;
}

template class CellProducts<double>;
// One by one: clang 14 instantiates what a class requires a double for.
template CellProducts<float>::CellProducts(const CellProducts<double>&);
template void CellProducts<float>::forces(const double* x, double* y) const;
template double CellProducts<float>::fill(std::size_t cell) const;

}  // namespace flexel::simulate
