// A block of vertices shares its elements: their motions are gathered once, twelve numbers each, and a vertex
// then needs one sum of twelve numbers over the elements it hears. Weights are single precision: they are
// divided by their own sum in double precision, so that what all elements agree on comes out exactly, and a
// seventh digit of a weight is far below what neighbouring frames differ by.
#include "mapping/blend.h"

#include <algorithm>
#include <cmath>

#include "formats/bucket.h"
#include "mapping/kernel.h"

namespace flexel {
namespace {

constexpr std::size_t kBlocksAtATime = 8;

// Elements that a group reaches, as arrays that the compiler can go through four at a time.
struct Around {
  std::vector<float> x, y, z;  // in spacings, from the group's home
  std::vector<float> weight;
  std::vector<std::uint8_t> from;

  void gather(const Body& body, const Groups& groups, const Group& group) {
    const std::size_t n = group.reach_end - group.reach_begin;
    for (std::vector<float>* column : {&x, &y, &z, &weight}) column->resize(n);
    from.assign(groups.from.begin() + static_cast<std::ptrdiff_t>(group.reach_begin),
                groups.from.begin() + static_cast<std::ptrdiff_t>(group.reach_end));
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3f at = offset(body, group, groups.elements[group.reach_begin + i]).cast<float>();
      x[i] = at.x(), y[i] = at.y(), z[i] = at.z();
    }
  }
};

void weigh(const Vec3& point, Around& around) {
  const auto px = static_cast<float>(point.x()), py = static_cast<float>(point.y()),
             pz = static_cast<float>(point.z());
  constexpr auto kScale = static_cast<float>(1 / kBlendRadius);
  const float *x = around.x.data(), *y = around.y.data(), *z = around.z.data();
  float* weight = around.weight.data();
  const std::size_t n = around.weight.size();
  for (std::size_t i = 0; i < n; ++i) {
    const float dx = x[i] - px, dy = y[i] - py, dz = z[i] - pz;
    weight[i] = wendland(kScale * std::sqrt(dx * dx + dy * dy + dz * dz));
  }
}

// Elements that not every corner reaches count as far as the corners that do.
void apply_shares(const std::array<double, 8>& share, Around& around) {
  constexpr std::uint8_t kAll = 0xff;
  for (std::size_t i = 0; i < around.from.size(); ++i) {
    if (around.from[i] == kAll || around.weight[i] == 0) continue;
    double sum = 0;
    for (unsigned a = 0; a < 8; ++a) sum += around.from[i] >> a & 1 ? share[a] : 0;
    around.weight[i] *= static_cast<float>(sum);
  }
}

void weigh_block(const Body& body, const Groups& groups, const Groups::Block& block, Around& around,
                 BlockWeights& weights) {
  const Group& group = groups.groups[block.group];
  around.gather(body, groups, group);
  const std::size_t n = around.weight.size();
  weights.begin.assign(1, 0);
  std::size_t used = 0;
  for (std::uint32_t i = block.begin; i < block.end; ++i) {
    const Vec3 point = within(body, group, body.surface.vertices[groups.vertices[i]]);
    weigh(point, around);
    if (group.in_cell) apply_shares(shares(group, point), around);
    if (weights.weight.size() < used + n) {
      weights.weight.resize(2 * (used + n));
      weights.element.resize(2 * (used + n));
    }
    for (std::size_t e = 0; e < n; ++e) {  // every one is written, and overwritten where it is not heard
      weights.element[used] = static_cast<std::uint16_t>(e);
      weights.weight[used] = around.weight[e];
      used += around.weight[e] > 0;
    }
    weights.begin.push_back(static_cast<std::uint32_t>(used));
  }
}

// d - G (X - c), then G by columns: u(x) = there + G (x - c).
using Row = Eigen::Array<double, 12, 1>;

void gather_rows(const Body& body, const Blend& blend, const Group& group,
                 const std::vector<ElementMotion>& motions, std::vector<Row>& rows) {
  rows.resize(group.reach_end - group.reach_begin);
  const std::uint32_t* element = blend.groups.elements.data() + group.reach_begin;
  const Vec3& centre = body.rest[element[0]];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ElementMotion& motion = motions[blend.moving.slot_of[element[i]]];
    Eigen::Map<Vec3>(rows[i].data()) =
        motion.displacement - motion.gradient * (body.rest[element[i]] - centre);
    Eigen::Map<Mat3>(rows[i].data() + 3) = motion.gradient;
  }
}

// The blend of the rows at `offset` from the centre.
Vec3 blend_rows(const std::vector<Row>& rows, const BlockWeights& weights, std::size_t vertex,
                const Vec3& offset) {
  // Two sums, so that an addition need not wait for the one before it.
  Row even = Row::Zero(), odd = Row::Zero();
  double total_even = 0, total_odd = 0;
  std::uint32_t k = weights.begin[vertex];
  const std::uint32_t end = weights.begin[vertex + 1];
  for (; k + 1 < end; k += 2) {
    const auto first = static_cast<double>(weights.weight[k]),
               second = static_cast<double>(weights.weight[k + 1]);
    even += first * rows[weights.element[k]];
    odd += second * rows[weights.element[k + 1]];
    total_even += first;
    total_odd += second;
  }
  if (k < end) {
    even += static_cast<double>(weights.weight[k]) * rows[weights.element[k]];
    total_even += static_cast<double>(weights.weight[k]);
  }
  const Row sum = even + odd;
  return (Eigen::Map<const Vec3>(sum.data()) + Eigen::Map<const Mat3>(sum.data() + 3) * offset) /
         (total_even + total_odd);
}

// Too far away to hear any element: the motion of the anchor nearest to the vertex, which the blend runs
// into.
Vec3 follow_nearest(const Body& body, const Blend& blend, const Group& group,
                    const std::vector<ElementMotion>& motions, const Vec3& vertex) {
  const std::uint32_t* anchor = blend.groups.elements.data() + group.reach_begin;
  const std::uint32_t nearest =
      *std::min_element(anchor, anchor + (group.in_cell ? 8 : 1), [&](std::uint32_t a, std::uint32_t b) {
        return (body.rest[a] - vertex).squaredNorm() < (body.rest[b] - vertex).squaredNorm();
      });
  const ElementMotion& motion = motions[blend.moving.slot_of[nearest]];
  return motion.displacement + motion.gradient * (vertex - body.rest[nearest]);
}

}  // namespace

Blend make_blend(const Body& body, const Adjacency& connections, const std::vector<Seat>& seats,
                 bool keep_weights) {
  Blend blend;
  blend.groups = group_vertices(body, connections, seats, kBlendSteps, kBlendRadius);
  blend.moving = find_moving_elements(body, connections, blend.groups.elements);
  if (!keep_weights) return blend;
  blend.weights.resize(blend.groups.blocks.size());
  parallel_chunks(blend.weights.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    Around around;
    BlockWeights scratch;
    for (std::size_t b = begin; b < end; ++b) {
      weigh_block(body, blend.groups, blend.groups.blocks[b], around, scratch);
      BlockWeights& kept = blend.weights[b];
      const auto used = static_cast<std::ptrdiff_t>(scratch.begin.back());
      kept.begin = scratch.begin;
      kept.element.assign(scratch.element.begin(), scratch.element.begin() + used);
      kept.weight.assign(scratch.weight.begin(), scratch.weight.begin() + used);
    }
  });
  return blend;
}

std::vector<Vec3> apply(const Blend& blend, const Body& body, const std::vector<ElementMotion>& motions) {
  const Groups& groups = blend.groups;
  std::vector<Vec3> displacement;
  resize_touched(displacement, groups.vertices.size());
  parallel_chunks(groups.blocks.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    Around around;
    BlockWeights found;
    std::vector<Row> rows;
    std::uint32_t gathered = kNoSlot;  // the group whose rows these are
    for (std::size_t b = begin; b < end; ++b) {
      const Groups::Block& block = groups.blocks[b];
      const Group& group = groups.groups[block.group];
      const Vec3& centre = body.rest[groups.elements[group.reach_begin]];
      if (gathered != block.group) gather_rows(body, blend, group, motions, rows);
      gathered = block.group;
      if (blend.weights.empty()) weigh_block(body, groups, block, around, found);
      const BlockWeights& weights = blend.weights.empty() ? found : blend.weights[b];
      for (std::uint32_t i = block.begin; i < block.end; ++i) {
        const std::uint32_t v = groups.vertices[i], k = i - block.begin;
        const Vec3& vertex = body.surface.vertices[v];
        displacement[v] = weights.begin[k] < weights.begin[k + 1]
                              ? blend_rows(rows, weights, k, vertex - centre)
                              : follow_nearest(body, blend, group, motions, vertex);
      }
    }
  });
  return displacement;
}

}  // namespace flexel
