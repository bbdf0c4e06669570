// Transfer between a level and the next coarser one, and the coarse matrix that follows from it. R is the
// number of unknowns of a fine node: 3 for an element, 6 for an aggregate (translation, reach x rotation).
//
// Prolongator: T moves every member of an aggregate as one rigid body; P = T - w D^-1 A T smooths it once
// (Vanek, Mandel, Brezina 1996), D being the block diagonal. P is stored in single precision; the coarse
// matrix P^T A P is formed in double precision with the very P that is stored, so that it is symmetric and as
// positive as A.
#pragma once
#include <algorithm>
#include <cassert>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "base/instruction_set.h"
#include "base/parallel.h"
#include "simulate/linear/aggregate.h"
#include "simulate/linear/kernel_galerkin.h"

namespace flexel::simulate {

template <int R>
using Square = Eigen::Matrix<double, R, R, R == 3 ? Eigen::RowMajor : Eigen::ColMajor>;

[[nodiscard]] inline const galerkin_kernel::Table& galerkin_table() {
#if defined(__x86_64__)
  return best_table(&galerkin_kernel::portable, &galerkin_kernel::avx2, &galerkin_kernel::avx512);
#else
  return galerkin_kernel::portable();
#endif
}

// Compressed rows without values.
struct Pattern {
  std::vector<std::uint64_t> offsets;  // (rows + 1)
  std::vector<std::uint32_t> columns;  // ascending within a row
};

// A square matrix of RxR blocks that lives elsewhere.
template <class BlockType>
struct MatrixView {
  std::span<const std::uint64_t> offsets;
  std::span<const std::uint32_t> columns;
  std::span<const BlockType> values;
  [[nodiscard]] std::size_t rows() const { return offsets.empty() ? 0 : offsets.size() - 1; }
};

// The blocks of rows [begin, end), as LinearOperator::blocks gives them.
template <class BlockType>
[[nodiscard]] const BlockType* row_blocks(const MatrixView<BlockType>& matrix, std::size_t begin, std::size_t,
                                          std::vector<Block>&) {
  return matrix.values.data() + matrix.offsets[begin];
}

// A matrix of 3x3 blocks, with its pattern at hand.
struct OperatorView {
  explicit OperatorView(const LinearOperator& of)
      : matrix(of), offsets(of.row_offsets()), columns(of.columns()) {}
  const LinearOperator& matrix;
  std::span<const std::uint64_t> offsets;
  std::span<const std::uint32_t> columns;
  [[nodiscard]] std::size_t rows() const { return matrix.rows(); }
};

[[nodiscard]] inline const Block* row_blocks(const OperatorView& view, std::size_t begin, std::size_t end,
                                             std::vector<Block>& room) {
  return view.matrix.blocks(begin, end, room);
}

template <int R>
struct Transfer {
  Pattern pattern;                                 // fine rows, columns are aggregates
  std::vector<Eigen::Matrix<float, 6, R>> values;  // transposed blocks of P
  std::size_t coarse_rows = 0;
  // The same entries sorted by aggregate, for the restriction.
  std::vector<std::uint64_t> transposed_offsets;    // (coarse rows + 1)
  std::vector<std::uint32_t> transposed_rows;       // fine row
  std::vector<std::uint64_t> transposed_positions;  // in `values`
};

// Rigid motion of an aggregate at one of its members, transposed (6 x R). For elements x - c is their
// distance from the centre; for aggregates the rotation unknown is carried over too, scaled by the two
// reaches.
template <int R>
[[nodiscard]] Eigen::Matrix<double, 6, R> rigid_motion(const Vec3& offset, double fine_reach,
                                                       double coarse_reach) {
  // u = t + (w / reach) x offset = t - (offset / reach) x w; rows of the result are the coarse unknowns.
  Mat3 cross;
  cross << 0, -offset[2], offset[1], offset[2], 0, -offset[0], -offset[1], offset[0], 0;
  Eigen::Matrix<double, 6, R> transposed = Eigen::Matrix<double, 6, R>::Zero();
  transposed.template topLeftCorner<3, 3>().setIdentity();
  transposed.template bottomLeftCorner<3, 3>() = cross / coarse_reach;  // (-cross)^T = cross
  if constexpr (R == 6)
    transposed.template bottomRightCorner<3, 3>() = Mat3::Identity() * (fine_reach / coarse_reach);
  return transposed;
}

// Collects rows of a pattern in parallel: row(i, out) appends the columns of row i, in any order and
// repeated.
template <class Row>
[[nodiscard]] Pattern collect_pattern(std::size_t rows, std::size_t grain, const Row& row) {
  const std::size_t chunks = (rows + grain - 1) / grain;
  std::vector<std::vector<std::uint32_t>> columns(chunks);
  Pattern pattern;
  pattern.offsets.assign(rows + 1, 0);
  parallel_chunks(rows, grain, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& chunk = columns[begin / grain];
    std::vector<std::uint32_t> list;
    for (std::size_t i = begin; i < end; ++i) {
      list.clear();
      row(i, list);
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
      pattern.offsets[i + 1] = list.size();
      chunk.insert(chunk.end(), list.begin(), list.end());
    }
  });
  std::partial_sum(pattern.offsets.begin(), pattern.offsets.end(), pattern.offsets.begin());
  pattern.columns.reserve(pattern.offsets.back());
  for (const auto& chunk : columns) pattern.columns.insert(pattern.columns.end(), chunk.begin(), chunk.end());
  return pattern;
}

// Position in `columns` of `column`, which the row has.
[[nodiscard]] inline std::size_t position_in_row(const Pattern& pattern, std::size_t row,
                                                 std::uint32_t column) {
  const auto begin = pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.offsets[row]);
  const auto end = pattern.columns.begin() + static_cast<std::ptrdiff_t>(pattern.offsets[row + 1]);
  const auto found = std::lower_bound(begin, end, column);
  assert(found != end && *found == column);
  return static_cast<std::size_t>(found - pattern.columns.begin());
}

// Where P has blocks: a fine row reaches the aggregates of the nodes it is coupled with. Rows without an
// aggregate stay empty.
template <int R, class View>
[[nodiscard]] Transfer<R> transfer_pattern(const View& matrix, const std::vector<std::uint32_t>& aggregate_of,
                                           std::size_t coarse_rows) {
  Transfer<R> transfer;
  transfer.coarse_rows = coarse_rows;
  transfer.pattern =
      collect_pattern(matrix.rows(), 1024, [&](std::size_t i, std::vector<std::uint32_t>& out) {
        if (aggregate_of[i] == kNoAggregate) return;
        for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
          const std::uint32_t a = aggregate_of[matrix.columns[q]];
          if (a != kNoAggregate && (out.empty() || out.back() != a)) out.push_back(a);
        }
      });
  const Pattern& pattern = transfer.pattern;
  transfer.transposed_offsets.assign(coarse_rows + 1, 0);
  for (const std::uint32_t a : pattern.columns) ++transfer.transposed_offsets[a + 1];
  std::partial_sum(transfer.transposed_offsets.begin(), transfer.transposed_offsets.end(),
                   transfer.transposed_offsets.begin());
  transfer.transposed_rows.resize(pattern.columns.size());
  transfer.transposed_positions.resize(pattern.columns.size());
  std::vector<std::uint64_t> next(transfer.transposed_offsets.begin(), transfer.transposed_offsets.end() - 1);
  for (std::size_t i = 0; i < matrix.rows(); ++i) {
    for (std::uint64_t q = pattern.offsets[i]; q < pattern.offsets[i + 1]; ++q) {
      const std::uint64_t at = next[pattern.columns[q]]++;
      transfer.transposed_rows[at] = static_cast<std::uint32_t>(i);
      transfer.transposed_positions[at] = q;
    }
  }
  return transfer;
}

// Values of P = T - weight D^-1 A T. `tentative(i)` is the transposed (6 x R) block of T in row i, which has
// an aggregate; `inverse_diagonal` holds D^-1.
template <int R, class View, class Inverse, class Tentative>
void smooth_prolongator(const View& matrix, const std::vector<Inverse>& inverse_diagonal, double weight,
                        const std::vector<std::uint32_t>& aggregate_of, const Tentative& tentative,
                        Transfer<R>& transfer) {
  using Transposed = Eigen::Matrix<float, 6, R>;
  constexpr std::size_t kWidth = galerkin_kernel::kWidth, kBlock = R * kWidth;
  const auto add = galerkin_table().products[R / 6];
  const Pattern& pattern = transfer.pattern;
  std::vector<Transposed> rigid(matrix.rows() + 1);  // the kernels read past a block's end
  rigid.back().setZero();
  parallel_for_each(matrix.rows(), [&](std::size_t i) {
    if (aggregate_of[i] != kNoAggregate) rigid[i] = tentative(i).template cast<float>();
  });
  transfer.values.resize(pattern.columns.size() + 1);  // likewise
  transfer.values.back().setZero();
  parallel_chunks(matrix.rows(), 256, [&](std::size_t begin, std::size_t end) {
    thread_local std::vector<std::uint32_t> slot;  // of an aggregate in the row; stale elsewhere
    thread_local std::vector<double> sums;
    thread_local std::vector<galerkin_kernel::Product> products;
    thread_local std::vector<Block> room;
    if (slot.size() < transfer.coarse_rows) slot.resize(transfer.coarse_rows);
    const auto* blocks = row_blocks(matrix, begin, end, room) - matrix.offsets[begin];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t first = pattern.offsets[i], count = pattern.offsets[i + 1] - first;
      if (count == 0) continue;
      for (std::uint64_t s = 0; s < count; ++s)
        slot[pattern.columns[first + s]] = static_cast<std::uint32_t>(s);
      sums.assign(kBlock * count, 0);
      products.clear();
      for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
        const std::uint32_t j = matrix.columns[q], a = aggregate_of[j];
        if (a != kNoAggregate)
          products.push_back({blocks[q].data(), rigid[j].data(), sums.data() + kBlock * slot[a]});
      }
      add(products.data(), products.size());
      const Eigen::Matrix<double, R, R> step = -weight * inverse_diagonal[i].template cast<double>();
      for (std::uint64_t s = 0; s < count; ++s) {
        const Eigen::Map<const Eigen::Matrix<double, kWidth, R>> sum(sums.data() + kBlock * s);
        Eigen::Matrix<double, 6, R> block = sum.template topRows<6>() * step;  // D^-1 is symmetric
        if (pattern.columns[first + s] == aggregate_of[i]) block += rigid[i].template cast<double>();
        transfer.values[first + s] = block.template cast<float>();
      }
    }
  });
}

// Where P^T A P has blocks.
template <int R, class View>
[[nodiscard]] Pattern coarse_pattern(const View& matrix, const Transfer<R>& transfer) {
  const Pattern& p = transfer.pattern;
  return collect_pattern(transfer.coarse_rows, 64, [&](std::size_t coarse, std::vector<std::uint32_t>& out) {
    // Nodes coupled with the support of P's column, each once; then the aggregates that they reach.
    thread_local std::vector<std::uint8_t> seen;  // all 0 between two uses
    thread_local std::vector<std::uint32_t> nodes;
    if (seen.size() < matrix.rows()) seen.resize(matrix.rows(), 0);
    nodes.clear();
    for (std::uint64_t t = transfer.transposed_offsets[coarse]; t < transfer.transposed_offsets[coarse + 1];
         ++t) {
      const std::uint32_t i = transfer.transposed_rows[t];
      for (std::uint64_t q = matrix.offsets[i]; q < matrix.offsets[i + 1]; ++q) {
        const std::uint32_t j = matrix.columns[q];
        if (seen[j]) continue;
        seen[j] = 1;
        nodes.push_back(j);
      }
    }
    thread_local std::vector<std::uint8_t> reached;  // likewise
    if (reached.size() < transfer.coarse_rows) reached.resize(transfer.coarse_rows, 0);
    for (const std::uint32_t j : nodes) {
      seen[j] = 0;
      for (std::uint64_t s = p.offsets[j]; s < p.offsets[j + 1]; ++s) {
        if (reached[p.columns[s]]) continue;
        reached[p.columns[s]] = 1;
        out.push_back(p.columns[s]);
      }
    }
    for (const std::uint32_t a : out) reached[a] = 0;
  });
}

// One row of A P: blocks (R x kWidth), in the order of `columns`. Of P^T (A P) the upper half is wanted, so
// columns before the first of the row of P are left out.
struct ProductRow {
  std::vector<std::uint32_t> columns;
  std::vector<double> values;
};

// Rows [begin, end) of A P.
template <int R, class View>
void product_rows(const View& matrix, const Transfer<R>& transfer, std::size_t begin, std::size_t end,
                  std::vector<ProductRow>& rows) {
  const auto add = galerkin_table().products[R / 6];
  constexpr std::size_t kBlock = R * galerkin_kernel::kWidth;
  const Pattern& p = transfer.pattern;
  rows.resize(std::max(rows.size(), end - begin));
  parallel_chunks(end - begin, 512, [&](std::size_t chunk_begin, std::size_t chunk_end) {
    thread_local std::vector<std::uint32_t> slot;  // kNoAggregate between two uses
    thread_local std::vector<galerkin_kernel::Product> products;
    if (slot.size() < transfer.coarse_rows) slot.resize(transfer.coarse_rows, kNoAggregate);
    thread_local std::vector<Block> room;
    const std::size_t first = begin + chunk_begin;
    const auto* blocks = row_blocks(matrix, first, begin + chunk_end, room) - matrix.offsets[first];
    for (std::size_t r = chunk_begin; r < chunk_end; ++r) {
      ProductRow& row = rows[r];
      row.columns.clear();
      // A row that no aggregate reaches takes no part in P^T (A P).
      if (p.offsets[begin + r] == p.offsets[begin + r + 1]) continue;
      const std::uint32_t least = p.columns[p.offsets[begin + r]];
      const std::uint64_t row_begin = matrix.offsets[begin + r], row_end = matrix.offsets[begin + r + 1];
      for (std::uint64_t q = row_begin; q < row_end; ++q) {
        const std::uint32_t k = matrix.columns[q];
        for (std::uint64_t s = p.offsets[k]; s < p.offsets[k + 1]; ++s) {
          std::uint32_t& at = slot[p.columns[s]];
          if (at != kNoAggregate || p.columns[s] < least) continue;
          at = static_cast<std::uint32_t>(row.columns.size());
          row.columns.push_back(p.columns[s]);
        }
      }
      row.values.assign(kBlock * row.columns.size(), 0);
      products.clear();
      for (std::uint64_t q = row_begin; q < row_end; ++q) {
        const std::uint32_t k = matrix.columns[q];
        for (std::uint64_t s = p.offsets[k]; s < p.offsets[k + 1]; ++s)
          if (p.columns[s] >= least)
            products.push_back({blocks[q].data(), transfer.values[s].data(),
                                row.values.data() + kBlock * slot[p.columns[s]]});
      }
      add(products.data(), products.size());
      for (const std::uint32_t column : row.columns) slot[column] = kNoAggregate;
    }
  });
}

// Values of the coarse matrix P^T A P over `pattern`. Fine rows are taken in batches so that A P is never
// stored whole; each coarse row adds its fine rows in ascending order, so the bits do not depend on the
// threads. The lower half mirrors the upper. One block more than there are, zero: products read past the end.
template <int R, class View>
[[nodiscard]] std::vector<Square<6>> galerkin(const View& matrix, const Transfer<R>& transfer,
                                              const Pattern& pattern) {
  // Some 25 MB of A P
  constexpr std::size_t kBatch = R == 3 ? 8192 : 4096, kWidth = galerkin_kernel::kWidth, kBlock = 6 * kWidth;
  const auto add = galerkin_table().pairs[R / 6];
  std::vector<Square<6>> values(pattern.columns.size() + 1);
  parallel_for_each(values.size(), [&](std::size_t q) { values[q].setZero(); });
  std::vector<std::uint64_t> next(transfer.transposed_offsets.begin(), transfer.transposed_offsets.end() - 1);
  std::vector<ProductRow> product;
  for (std::size_t begin = 0; begin < matrix.rows(); begin += kBatch) {
    const std::size_t end = std::min(matrix.rows(), begin + kBatch);
    product_rows(matrix, transfer, begin, end, product);
    parallel_chunks(transfer.coarse_rows, 64, [&](std::size_t chunk_begin, std::size_t chunk_end) {
      thread_local std::vector<std::uint32_t> slot;
      thread_local std::vector<galerkin_kernel::Pair> pairs;
      thread_local std::vector<double> sums;
      for (std::size_t a = chunk_begin; a < chunk_end; ++a) {
        const std::uint64_t last = transfer.transposed_offsets[a + 1];
        if (next[a] == last || transfer.transposed_rows[next[a]] >= end) continue;
        if (slot.size() < transfer.coarse_rows) slot.resize(transfer.coarse_rows);
        const std::uint64_t first = pattern.offsets[a], count = pattern.offsets[a + 1] - first;
        for (std::uint64_t q = 0; q < count; ++q)
          slot[pattern.columns[first + q]] = static_cast<std::uint32_t>(q);
        sums.assign(kBlock * count, 0);
        pairs.clear();
        for (; next[a] < last && transfer.transposed_rows[next[a]] < end; ++next[a]) {
          const float* p = transfer.values[transfer.transposed_positions[next[a]]].data();
          const ProductRow& row = product[transfer.transposed_rows[next[a]] - begin];
          for (std::size_t c = 0; c < row.columns.size(); ++c)
            if (row.columns[c] >= a)
              pairs.push_back(
                  {p, row.values.data() + R * kWidth * c, sums.data() + kBlock * slot[row.columns[c]]});
        }
        add(pairs.data(), pairs.size());
        for (std::uint64_t q = 0; q < count; ++q)
          for (int m = 0; m < 6; ++m)
            for (int n = 0; n < 6; ++n)
              values[first + q](m, n) +=
                  sums[kBlock * q + kWidth * static_cast<std::size_t>(m) + static_cast<std::size_t>(n)];
      }
    });
  }
  parallel_for_each(transfer.coarse_rows, [&](std::size_t a) {
    for (std::uint64_t q = pattern.offsets[a]; q < pattern.offsets[a + 1]; ++q) {
      const std::uint32_t b = pattern.columns[q];
      if (b < a) values[q] = values[position_in_row(pattern, b, static_cast<std::uint32_t>(a))].transpose();
      if (b == a) values[q] = (.5 * (values[q] + values[q].transpose())).eval();
    }
  });
  return values;
}

}  // namespace flexel::simulate
