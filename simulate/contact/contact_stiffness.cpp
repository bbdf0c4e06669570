// In the order of the pairs, one after another, so that the bits do not depend on the threads.
#include "simulate/contact/contact_stiffness.h"

namespace flexel::simulate {
namespace {

// Of a pair, by d and b: N/m, N, N m.
struct PairCurvature {
  Mat3 by_d = Mat3::Zero(), by_both = Mat3::Zero(), by_b = Mat3::Zero();
  // Of c together with d and with b, along these; of c alone [J].
  Vec3 facing_d = Vec3::Zero(), facing_b = Vec3::Zero();
  double facing = 0;
};

PairCurvature curvature_of(const PairState& now, ContactTangent kind) {
  const Vec3 &n = now.normal, &t = now.offset;
  const double k = now.stiffness - now.weight * (1 - now.share);
  const double tilt = now.length > 0 ? 1 / now.length : 0;
  const Vec3 of_b = tilt * t;
  PairCurvature made;
  if (kind == ContactTangent::positive) {
    made.by_d = k * n * n.transpose();
    made.by_both = k * n * of_b.transpose();
    made.by_b = k * of_b * of_b.transpose();
    return made;
  }
  const double law = now.energy / now.weight, s = now.along;
  const double spread = now.narrowing * law, mixed = now.narrowing * now.pressure / now.weight;
  const double narrowing = 0.5 * now.narrowing * now.narrowing / now.weight * law;
  const double stiffness = k + spread, press = now.pressure - spread * s;
  const Mat3 across = Mat3::Identity() - n * n.transpose();
  const Vec3 slide = -s * of_b;  // T' by b'
  made.by_d = stiffness * n * n.transpose() + mixed * (n * t.transpose() + t * n.transpose()) +
              narrowing * t * t.transpose() - spread * Mat3::Identity();
  made.by_both = stiffness * n * of_b.transpose() + mixed * (n * slide.transpose() + t * of_b.transpose()) +
                 narrowing * t * slide.transpose() - press * tilt * across;
  made.by_b = stiffness * of_b * of_b.transpose() +
              mixed * (of_b * slide.transpose() + slide * of_b.transpose()) +
              narrowing * slide * slide.transpose() +
              press * tilt * tilt * (n * t.transpose() + t * n.transpose() + s * across);
  const double by_gap = -now.facing_slope * now.pressure / now.weight;            // U_sc
  const double by_offset = -now.narrowing * now.facing_slope / now.weight * law;  // U_Tc
  made.facing_d = by_gap * n + by_offset * t;
  made.facing_b = by_gap * of_b + by_offset * slide;
  made.facing = now.facing_slope * law;
  return made;
}

// Of a point, by its place x and its normal n; dU/dn [J].
struct PointCurvature {
  Mat3 by_place = Mat3::Zero(), by_both = Mat3::Zero(), by_normal = Mat3::Zero();
  Vec3 turning = Vec3::Zero();
};

// How a point's elements move it and turn its normal.
struct Carried {
  const InterpolationWeights* at = nullptr;
  Vec3 normal = Vec3::Zero();
  std::array<Vec3, 8> slopes, across;  // h_a, m_a [1/m]
};

class Assembly {
 public:
  Assembly(const ContactSurface& surface, const PairList& list, const PairStates& states, BlockMatrix& matrix)
      : surface_(surface), list_(list), states_(states), matrix_(matrix) {}

  void add_pairs(ContactTangent kind) {
    number_.assign(list_.points().size(), kNone);
    for (const std::uint32_t p : states_.active()) {
      const PairState& now = states_[p];
      if (!(now.pressure > 0) || now.deep) continue;
      const ContactPair& pair = list_.pairs()[p];
      const bool at_i = deforms(pair.i), at_j = !pair.of_plane() && deforms(pair.j);
      if (!at_i && !at_j) continue;
      const PairCurvature of = curvature_of(now, kind);
      const auto turning = [&](int side) {
        return kind == ContactTangent::whole ? now.turning[static_cast<std::size_t>(side)]
                                             : Vec3(Vec3::Zero());
      };
      // A plane alone gives the direction of its pairs.
      const Vec3 other = pair.of_plane() ? Vec3(-now.normal) : normal(pair.j);
      if (at_i) gather(pair.i, pair.of_plane() ? 0 : own_plane(pair.i), of, turning(0), -1, -other);
      if (at_j) gather(pair.j, own_plane(pair.j), of, turning(1), 1, -normal(pair.i));
      if (at_i && at_j) add_cross(pair, of);
    }
    for (std::size_t n = 0; n < points_.size(); ++n) add_point(carried(points_[n]), sums_[n]);
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;

  [[nodiscard]] bool deforms(std::uint32_t point) const { return !surface_.rigid(list_.point(point).part); }

  [[nodiscard]] const Vec3& normal(std::uint32_t point) const { return states_.points()[point].side.normal; }

  [[nodiscard]] double own_plane(std::uint32_t point) const { return states_.points()[point].side.own_plane; }

  // At i d' = -x', b' = a n'; at j d' = x', b' = -a n' (`sign` -1, 1). c' = facing . n'.
  void gather(std::uint32_t point, double own, const PairCurvature& of, const Vec3& turning, int sign,
              const Vec3& facing) {
    if (number_[point] == kNone) {
      number_[point] = static_cast<std::uint32_t>(points_.size());
      points_.push_back(point);
      sums_.emplace_back();
    }
    PointCurvature& sum = sums_[number_[point]];
    sum.by_place += of.by_d;
    sum.by_both += sign * of.facing_d * facing.transpose() - own * of.by_both;
    const Mat3 faces = -sign * own * of.facing_b * facing.transpose();
    sum.by_normal += own * own * of.by_b + faces + faces.transpose();
    sum.turning += turning;
  }

  [[nodiscard]] Carried carried(std::uint32_t number) const {
    const ContactPoint& point = list_.point(number);
    const PointState& now = states_.points()[number];
    Carried made;
    made.at = &point.at;
    made.normal = now.side.normal;
    for (std::uint32_t a = 0; a < point.at.count; ++a) {
      made.slopes[a] = made.across[a] = Vec3::Zero();
      if (point.at.count != 8) continue;
      made.slopes[a] = now.inverse.transpose() * surface_.gradients(point.part)[a];
      made.across[a] = made.slopes[a] - made.normal.dot(made.slopes[a]) * made.normal;
    }
    return made;
  }

  void add(std::uint32_t row, std::uint32_t column, const Mat3& block) {
    matrix_.values[position_of(matrix_, row, column)] += block;
  }

  void add_point(const Carried& of, const PointCurvature& sum) {
    const std::uint32_t count = of.at->count;
    const Vec3& n = of.normal;
    const double along = sum.turning.dot(n);
    std::array<Vec3, 8> bent, tilted;
    std::array<double, 8> turning, leaning;
    for (std::uint32_t a = 0; a < count; ++a) {
      bent[a] = sum.by_normal * of.across[a] - along * of.across[a];
      tilted[a] = sum.by_both * of.across[a];
      turning[a] = sum.turning.dot(of.across[a]);
      leaning[a] = n.dot(of.slopes[a]);
    }
    std::array<Mat3, 64> blocks;
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = 0; b < count; ++b) {
        const double wa = of.at->weights[a], wb = of.at->weights[b];
        const double both = of.across[a].dot(bent[b]) - leaning[a] * turning[b] - leaning[b] * turning[a];
        const Vec3 left = turning[a] * of.slopes[b] - wa * tilted[b] + both * n;
        const Vec3 right = turning[b] * of.slopes[a] - wb * tilted[a];
        blocks[8 * a + b] = wa * wb * sum.by_place + left * n.transpose() + n * right.transpose();
      }
    add_blocks(*of.at, blocks, matrix_);
  }

  // What moves or turns i changes at j.
  void add_cross(const ContactPair& pair, const PairCurvature& of) {
    const Carried i = carried(pair.i), j = carried(pair.j);
    const double own_i = own_plane(pair.i), own_j = own_plane(pair.j);
    // by x_i and x_j, x_i and n_j, n_i and x_j, n_i and n_j
    const Mat3 places = -of.by_d;
    const Mat3 to_normal = own_j * of.by_both + of.facing_d * i.normal.transpose();
    const Mat3 from_normal = own_i * of.by_both.transpose() - j.normal * of.facing_d.transpose();
    const Mat3 normals = own_j * j.normal * of.facing_b.transpose() - own_i * own_j * of.by_b -
                         own_i * of.facing_b * i.normal.transpose() - of.facing * Mat3::Identity();
    for (std::uint32_t a = 0; a < i.at->count; ++a)
      for (std::uint32_t b = 0; b < j.at->count; ++b) {
        const double wa = i.at->weights[a], wb = j.at->weights[b];
        const Vec3 left = -wa * (to_normal * j.across[b]) + i.across[a].dot(normals * j.across[b]) * i.normal;
        const Mat3 block = wa * wb * places + left * j.normal.transpose() -
                           wb * i.normal * (from_normal.transpose() * i.across[a]).transpose();
        add(i.at->elements[a], j.at->elements[b], block);
        add(j.at->elements[b], i.at->elements[a], block.transpose());
      }
  }

  const ContactSurface& surface_;
  const PairList& list_;
  const PairStates& states_;
  BlockMatrix& matrix_;
  std::vector<std::uint32_t> number_, points_;  // (list_.points()) in points_ and sums_
  std::vector<PointCurvature> sums_;
};

}  // namespace

// Elements of a cell ascend, mostly: each is looked for behind the last one.
void add_blocks(const InterpolationWeights& at, const std::array<Mat3, 64>& blocks, BlockMatrix& matrix) {
  for (std::uint32_t a = 0; a < at.count; ++a) {
    const std::uint64_t begin = matrix.row_offsets[at.elements[a]],
                        end = matrix.row_offsets[at.elements[a] + 1];
    std::uint64_t place = begin;
    for (std::uint32_t b = 0; b < at.count; ++b) {
      if (b > 0 && at.elements[b] < at.elements[b - 1]) place = begin;
      while (place < end && matrix.columns[place] < at.elements[b]) ++place;
      if (place == end || matrix.columns[place] != at.elements[b])
        throw MissingBlock("no block between elements that carry a contact point");
      matrix.values[place] += blocks[8 * a + b];
    }
  }
}

void add_contact_stiffness(const ContactSurface& surface, const PairList& list, const PairStates& states,
                           ContactTangent kind, BlockMatrix& matrix) {
  Assembly(surface, list, states, matrix).add_pairs(kind);
}

}  // namespace flexel::simulate
