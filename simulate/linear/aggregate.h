// Groups of unknowns that one coarse element stands for.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/math/vec.h"
#include "simulate/linear/operator.h"

namespace flexel::simulate {

constexpr std::uint32_t kNoAggregate = 0xffffffffu;

// Links between nodes, both directions: those entries of compressed rows that are as strong as `least`. The
// rows live elsewhere.
struct Links {
  std::span<const std::uint64_t> offsets;     // (nodes + 1)
  std::span<const std::uint32_t> neighbours;  // ascending within a row
  std::span<const std::uint8_t> strength;     // (neighbours); empty: every entry counts
  std::uint8_t least = 1;

  [[nodiscard]] bool holds(std::uint64_t entry) const { return strength.empty() || strength[entry] >= least; }
  // body(neighbour)
  template <class Body>
  void for_each(std::size_t node, const Body& body) const {
    for (std::uint64_t q = offsets[node]; q < offsets[node + 1]; ++q)
      if (holds(q)) body(neighbours[q]);
  }
  [[nodiscard]] bool any(std::size_t node) const {
    for (std::uint64_t q = offsets[node]; q < offsets[node + 1]; ++q)
      if (holds(q)) return true;
    return false;
  }
};

// Compressed rows of neighbours, both directions, without the node itself.
struct Graph {
  std::vector<std::uint64_t> offsets;     // (nodes + 1)
  std::vector<std::uint32_t> neighbours;  // ascending within a row
  [[nodiscard]] Links links() const { return {offsets, neighbours, {}, 1}; }
};

// The unknowns of one level: elements, or aggregates of the level below.
struct LevelNodes {
  std::vector<Index3> index;        // (nodes x 3) integer coordinates: lattice index, or block of it
  std::vector<std::uint32_t> part;  // (nodes)
  std::vector<Vec3> position;       // (nodes x 3) m; of an aggregate the mean of its members
  std::vector<double>
      reach;  // (nodes) m, scale of the node's rotation: rotation unknown = reach x angle. 0 for elements
};

struct Aggregates {
  std::vector<std::uint32_t> of;  // (fine nodes) aggregate, or kNoAggregate for a node coupled with nothing
  LevelNodes nodes;               // the aggregates
  Graph links;                    // which aggregates contain linked nodes (the quotient graph)
  [[nodiscard]] std::size_t count() const { return nodes.index.size(); }
};

// (blocks) For each block A_ij, i != j, how many of the ascending thresholds t it exceeds: |A_ij| > t
// sqrt(|A_ii| |A_jj|) (Frobenius norms). 0 on the diagonal.
[[nodiscard]] std::vector<std::uint8_t> link_strengths(const LinearOperator& matrix,
                                                       std::span<const double> thresholds);

struct AggregateOptions {
  int width = 3;               // nodes along each edge of a block
  std::size_t smallest = 4;    // smaller aggregates join the neighbour of the same part with most links
  bool drop_isolated = false;  // nodes without any link get no aggregate
};

// Cuts each part into blocks of about `width`^3 nodes, evenly along each axis, and each block into the pieces
// that `strong` connects. Aggregates are numbered along x, then y, then z, part by part.
[[nodiscard]] Aggregates aggregate(const LevelNodes& nodes, const Links& links, const Links& strong,
                                   const AggregateOptions& options);

}  // namespace flexel::simulate
