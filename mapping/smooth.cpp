// The weights of the elements' displacements do not depend on the state, but are too many to keep (about 60 a
// vertex): they are found again for each state, a block of vertices at a time. The normal equations of a
// vertex are 10 x 10, in spacings about the vertex, so that their condition does not depend on the unit.
#include "mapping/smooth.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "formats/parallel.h"
#include "mapping/kernel.h"

namespace flexel {
namespace {

constexpr double kQuadraticRidge = 1e-6, kLinearRidge = 1e-9;
constexpr std::size_t kBlocksAtATime = 4;

using Terms = Eigen::Matrix<double, 10, 1>;
using Normal = Eigen::Matrix<double, 10, 10>;

Terms terms(const Vec3& d) {
  Terms result;
  result << 1, d.x(), d.y(), d.z(), d.x() * d.x(), d.y() * d.y(), d.z() * d.z(), d.x() * d.y(), d.y() * d.z(),
      d.z() * d.x();
  return result;
}

// An element that a group reaches.
struct Neighbour {
  Vec3 at;            // in spacings, from the group's home
  Vec3 rest;          // m, from the group's first element
  Vec3 displacement;  // m
  std::uint8_t from = 0xff;
};

// How the quadruple of a vertex moves: A(y) = displacement + gradient (y - origin).
struct FrameField {
  Vec3 displacement, origin;
  Mat3 gradient;
};

void gather(const Body& body, const Groups& groups, const Group& group, const std::vector<Vec3>& position,
            std::vector<Neighbour>& neighbours) {
  neighbours.clear();
  const Vec3& centre = body.rest[groups.elements[group.reach_begin]];
  for (std::uint64_t i = group.reach_begin; i < group.reach_end; ++i) {
    const std::uint32_t e = groups.elements[i];
    neighbours.push_back({offset(body, group, e), body.rest[e] - centre, position[e] - body.rest[e],
                          group.in_cell ? groups.from[i] : std::uint8_t{0xff}});
  }
}

// Room for the neighbours that one vertex hears.
struct Heard {
  std::vector<Terms> terms;
  std::vector<double> weight;
  std::vector<std::uint32_t> which;
  Normal normal;
};

void hear(const std::vector<Neighbour>& neighbours, const Vec3& point, const std::array<double, 8>& share,
          Heard& heard) {
  heard.terms.clear();
  heard.weight.clear();
  heard.which.clear();
  heard.normal.setZero();
  for (std::uint32_t i = 0; i < neighbours.size(); ++i) {
    const Vec3 away = neighbours[i].at - point;
    const double squared_distance = away.squaredNorm();
    if (squared_distance >= kSmoothRadius * kSmoothRadius) continue;
    double weight = wendland(std::sqrt(squared_distance) / kSmoothRadius);
    if (neighbours[i].from != 0xff) {
      double sum = 0;
      for (unsigned a = 0; a < 8; ++a) sum += neighbours[i].from >> a & 1 ? share[a] : 0;
      weight *= sum;
    }
    if (!(weight > 0)) continue;
    heard.terms.push_back(terms(away));
    heard.weight.push_back(weight);
    heard.which.push_back(i);
    const Terms& t = heard.terms.back();
    for (Eigen::Index c = 0; c < 10; ++c) heard.normal.col(c) += weight * t[c] * t;
  }
}

// The polynomial's constant term is sum_e w_e (coefficients . terms_e) r_e.
Terms coefficients(Normal normal) {
  const double scale = normal(0, 0);
  for (Eigen::Index i = 1; i < 10; ++i) normal(i, i) += (i < 4 ? kLinearRidge : kQuadraticRidge) * scale;
  return (normal / scale).ldlt().solve(Terms::Unit(0)) / scale;
}

// Displacement of the vertex at `from_centre` (m, from the group's first element, which rests at `centre`).
Vec3 evaluate(const std::vector<Neighbour>& neighbours, const Heard& heard, const FrameField& field,
              const Vec3& centre, const Vec3& from_centre) {
  const Terms by = coefficients(heard.normal);
  const Vec3 origin = field.origin - centre;
  Vec3 left_over = Vec3::Zero();
  for (std::size_t k = 0; k < heard.which.size(); ++k) {
    const Neighbour& neighbour = neighbours[heard.which[k]];
    left_over += heard.weight[k] * by.dot(heard.terms[k]) *
                 (neighbour.displacement - field.displacement - field.gradient * (neighbour.rest - origin));
  }
  return field.displacement + field.gradient * (from_centre - origin) + left_over;
}

std::vector<FrameField> frame_fields(const Body& body, const std::vector<Frame>& frames,
                                     const std::vector<Vec3>& position) {
  std::vector<FrameField> fields(frames.size());
  parallel_for_each(frames.size(), [&](std::size_t f) {
    const FrameMotion motion = frame_motion(frames[f], body.rest, position, MapMethod::smooth);
    fields[f] = {motion.translation, body.rest[frames[f].elements[0]],
                 motion.change * rest_base(frames[f], body.rest, MapMethod::smooth).inverse()};
  });
  return fields;
}

}  // namespace

std::vector<Vec3> apply_smooth(const Groups& groups, const Body& body, const std::vector<Frame>& frames,
                               const std::vector<std::uint32_t>& frame_of,
                               const std::vector<Vec3>& position) {
  const std::vector<FrameField> fields = frame_fields(body, frames, position);
  std::vector<Vec3> displacement(groups.vertices.size());
  parallel_chunks(groups.blocks.size(), kBlocksAtATime, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour> neighbours;
    Heard heard;
    for (std::size_t b = begin; b < end; ++b) {
      const Groups::Block& block = groups.blocks[b];
      const Group& group = groups.groups[block.group];
      const Vec3& centre = body.rest[groups.elements[group.reach_begin]];
      gather(body, groups, group, position, neighbours);
      for (std::uint32_t i = block.begin; i < block.end; ++i) {
        const std::uint32_t v = groups.vertices[i];
        const Vec3& vertex = body.surface.vertices[v];
        const Vec3 point = within(body, group, vertex);
        const FrameField& field = fields[frame_of[v]];
        hear(neighbours, point, shares(group, point), heard);
        displacement[v] = heard.which.empty()
                              ? Vec3(field.displacement + field.gradient * (vertex - field.origin))
                              : evaluate(neighbours, heard, field, centre, vertex - centre);
      }
    }
  });
  return displacement;
}

}  // namespace flexel
