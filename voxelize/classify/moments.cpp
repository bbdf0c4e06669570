// As the fill in clip.cpp, with f = L_i(x) L_j(y) L_l(z) in place of 1, x, y, z from the voxel's lowest corner.
// With T_l(z) the integral of L_l from z to 1, so that T_l(0) is Gauss's weight w_l, the moment is the winding
// number at the lowest corner times w_i w_j w_l plus, for every polygon, the sum of
//   the integral of -L_i L_j T_l n_z dA over it,
//   w_l times the integral of L_i T_j dx along its side on the plane z = 0, if it has one,
//   +-w_j w_l T_i where that side starts or ends on y = 0.
// All are polynomials, integrated exactly: over a triangle of the polygon's fan, of total degree 13, by 7 x 7 points
// collapsed to the fan's corner (Gauss-Jacobi away from it, Gauss-Legendre across), along a side, of degree 9, by 5.
#include "voxelize/classify/moments.h"

#include <cmath>
#include <numeric>

namespace flexel::voxelize {
namespace {

constexpr std::size_t kN = kMomentPoints;
using Point = std::array<double, 3>;

// Two points of a rule at once, as every machine has them.
using Lanes = double __attribute__((vector_size(16)));
constexpr std::size_t kWidth = 2;

// On [0, 1] with weight r, and with weight 1: exact up to degree 13.
constexpr std::size_t kAlong = 7;
constexpr std::array<double, kAlong> kRadius = {
    0.056262560536922146466, 0.18024069173689236499, 0.35262471711316963737, 0.547153626330555383,
    0.73421017721541053152,  0.88532094683909576809, 0.97752061356128750189};
constexpr std::array<double, kAlong> kRadiusWeight = {
    0.0052143622028074040897, 0.027408356721873475444, 0.066384696465491469984, 0.10712506569587366999,
    0.12739089729958832692,   0.11050925819087460242,  0.055967363423491051152};
constexpr std::array<double, kAlong> kAcross = {
    0.025446043828620737737, 0.12923440720030278007, 0.29707742431130141655, 0.5,
    0.70292257568869858345,  0.87076559279969721993, 0.97455395617137926226};
constexpr std::array<double, kAlong> kAcrossWeight = {
    0.064742483084434846635, 0.13985269574463833395, 0.19091502525255947248, 0.20897959183673469388,
    0.19091502525255947248,  0.13985269574463833395, 0.064742483084434846635};

// The rule of a triangle with corners o, p, q: o + first (p - o) + second (q - o), weights for twice its area.
constexpr std::size_t kGroups = (kAlong * kAlong + kWidth - 1) / kWidth;
struct TriangleRule {
  std::array<double, kWidth * kGroups> first{}, second{}, weight{};  // the last weighs nothing
};
constexpr TriangleRule triangle_rule() {
  TriangleRule rule;
  for (std::size_t r = 0; r < kAlong; ++r)
    for (std::size_t s = 0; s < kAlong; ++s) {
      rule.first[kAlong * r + s] = kRadius[r] * (1 - kAcross[s]);
      rule.second[kAlong * r + s] = kRadius[r] * kAcross[s];
      rule.weight[kAlong * r + s] = kRadiusWeight[r] * kAcrossWeight[s];
    }
  return rule;
}
constexpr TriangleRule kTriangle = triangle_rule();

// 1 / product of x_i - x_j.
constexpr std::array<double, kN> lagrange_scales() {
  std::array<double, kN> scale{};
  for (std::size_t i = 0; i < kN; ++i) {
    double product = 1;
    for (std::size_t j = 0; j < kN; ++j)
      if (j != i) product *= kGaussPoints[i] - kGaussPoints[j];
    scale[i] = 1 / product;
  }
  return scale;
}
constexpr std::array<double, kN> kScale = lagrange_scales();

// T_i in powers of z - 1/2, which keeps them small.
constexpr std::array<std::array<double, kN + 1>, kN> tail_coefficients() {
  std::array<std::array<double, kN + 1>, kN> tail{};
  for (std::size_t i = 0; i < kN; ++i) {
    std::array<double, kN> power{kScale[i]};  // of L_i
    std::size_t degree = 0;
    for (std::size_t j = 0; j < kN; ++j) {
      if (j == i) continue;
      for (std::size_t k = ++degree; k > 0; --k) power[k] = power[k - 1] - (kGaussPoints[j] - .5) * power[k];
      power[0] *= -(kGaussPoints[j] - .5);
    }
    double half = .5;
    for (std::size_t k = 0; k < kN; ++k, half /= 2) {
      tail[i][k + 1] = -power[k] / static_cast<double>(k + 1);
      tail[i][0] -= tail[i][k + 1] * half;
    }
  }
  return tail;
}
constexpr std::array<std::array<double, kN + 1>, kN> kTail = tail_coefficients();

// L_0 .. L_4.
template <class Number>
void lagrange(const Number& x, Number* value) {
  const Number a = x - kGaussPoints[0], b = x - kGaussPoints[1], c = x - kGaussPoints[2],
               d = x - kGaussPoints[3], e = x - kGaussPoints[4];
  const Number ab = a * b, de = d * e, abc = ab * c, cde = c * de;
  value[0] = kScale[0] * (b * cde);
  value[1] = kScale[1] * (a * cde);
  value[2] = kScale[2] * (ab * de);
  value[3] = kScale[3] * (abc * e);
  value[4] = kScale[4] * (abc * d);
}

// T_0 .. T_4.
template <class Number>
void tails(const Number& z, Number* value) {
  const Number t = z - .5;
  for (std::size_t i = 0; i < kN; ++i) {
    Number sum = kTail[i][kN] * t + kTail[i][kN - 1];
    for (std::size_t k = kN - 1; k-- > 0;) sum = sum * t + kTail[i][k];
    value[i] = sum;
  }
}

// What a triangle's points give, by group of them.
struct Factors {
  Lanes x[kGroups][kN], y[kGroups][kN], z[kGroups][kN];  // L_i, L_j and T_l times the weight
};

void find_factors(const Point& o, const Point& p, const Point& q, double scale, Factors& at) {
  for (std::size_t g = 0; g < kGroups; ++g) {
    Lanes first, second, weight;
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      first[lane] = kTriangle.first[kWidth * g + lane];
      second[lane] = kTriangle.second[kWidth * g + lane];
      weight[lane] = kTriangle.weight[kWidth * g + lane];
    }
    lagrange(o[0] + first * (p[0] - o[0]) + second * (q[0] - o[0]), at.x[g]);
    lagrange(o[1] + first * (p[1] - o[1]) + second * (q[1] - o[1]), at.y[g]);
    tails(o[2] + first * (p[2] - o[2]) + second * (q[2] - o[2]), at.z[g]);
    for (std::size_t l = 0; l < kN; ++l) at.z[g][l] *= scale * weight;
  }
}

// Five sums at a time stay in registers.
void add_products(const Factors& at, CellMoments& moments) {
  for (std::size_t l = 0; l < kN; ++l)
    for (std::size_t j = 0; j < kN; ++j) {
      Lanes sum[kN] = {};
      for (std::size_t g = 0; g < kGroups; ++g) {
        const Lanes yz = at.y[g][j] * at.z[g][l];
        for (std::size_t i = 0; i < kN; ++i) sum[i] += yz * at.x[g][i];
      }
      for (std::size_t i = 0; i < kN; ++i) moments[i + kN * (j + kN * l)] += sum[i][0] + sum[i][1];
    }
}

// The integral of L_i T_j dx from p to q, i + 5 j.
void add_side(const Point& p, const Point& q, std::array<double, kN * kN>& face) {
  for (std::size_t g = 0; g < kN; ++g) {
    std::array<double, kN> x, y;
    lagrange(p[0] + kGaussPoints[g] * (q[0] - p[0]), x.data());
    tails(p[1] + kGaussPoints[g] * (q[1] - p[1]), y.data());
    const double weight = kGaussWeights[g] * (q[0] - p[0]);
    for (std::size_t j = 0; j < kN; ++j)
      for (std::size_t i = 0; i < kN; ++i) face[i + kN * j] += weight * y[j] * x[i];
  }
}

Polygon polygon_of(const VoxelRecords& voxel, const Record& record) {
  const PartMesh& mesh = *voxel.mesh;
  const Corners& c = mesh.corners[record.triangle];
  return clip_to_voxel({&mesh.vertices[c[0]], &mesh.vertices[c[1]], &mesh.vertices[c[2]]}, voxel.i, voxel.j,
                       voxel.k);
}

bool is_cut(const Piece& piece) {
  return piece.fill > 1 - kWholeFill && piece.fill < kWholeFill;
}

}  // namespace

std::array<double, kMomentPoints> lagrange_tails(double x) {
  std::array<double, kN> value;
  tails(x, value.data());
  return value;
}

void MomentSum::add(const Polygon& polygon, const Index3& voxel) {
  std::array<Point, Polygon::kCapacity> corner;
  for (int v = 0; v < polygon.count; ++v)
    for (std::size_t a = 0; a < 3; ++a) corner[v][a] = polygon.corner[v][a] - voxel[a];
  const Point& o = corner[0];
  for (int v = 1; v + 1 < polygon.count; ++v) {
    const Point &p = corner[v], &q = corner[v + 1];
    const double twice_area = (p[0] - o[0]) * (q[1] - o[1]) - (q[0] - o[0]) * (p[1] - o[1]);
    if (twice_area == 0) continue;  // upright
    Factors factors;
    find_factors(o, p, q, -twice_area, factors);
    add_products(factors, inside_);
  }
  std::uint16_t before = polygon.side[polygon.count - 1];
  for (int v = 0; v < polygon.count; ++v) {
    const std::uint16_t side = polygon.side[v];
    if (side == kZLow) add_side(corner[v], corner[v + 1 < polygon.count ? v + 1 : 0], face_);
    if ((before | side) == (kZLow | kYLow)) {  // as edge_crossing() in clip.cpp
      std::array<double, kN> x;
      tails(corner[v][0], x.data());
      for (std::size_t i = 0; i < kN; ++i) edge_[i] += before == kZLow ? x[i] : -x[i];
    }
    before = side;
  }
}

CellMoments MomentSum::total(int winding) const {
  CellMoments moments = inside_;
  for (std::size_t k = 0; k < kMoments; ++k) {
    const std::size_t i = k % kN, j = k / kN % kN, l = k / (kN * kN);
    const double row = edge_[i] + kGaussWeights[i] * winding;
    moments[k] += kGaussWeights[l] * (face_[i + kN * j] + kGaussWeights[j] * row);
  }
  return moments;
}

void append_moments(const CellMoments& moments, std::uint32_t piece, Slab& slab) {
  if (!is_cut(slab.pieces[piece])) return;
  slab.moment_pieces.push_back(piece);
  slab.moments.push_back(moments);
}

void MomentFinder::find(const VoxelRecords& voxel, const VoxelPieces& found, std::uint32_t first,
                        Slab& slab) {
  bool any = false;
  for (std::uint32_t p = 0; p < found.count; ++p) any |= is_cut(slab.pieces[first + p]);
  if (!any) return;
  sums_.assign(found.count, {});
  for (std::size_t r = 0; r < voxel.records.size(); ++r)
    if (const std::uint32_t p = found.count > 1 ? found.of_record[r] : 0; is_cut(slab.pieces[first + p]))
      sums_[p].add(polygon_of(voxel, voxel.records[r]), {voxel.i, voxel.j, voxel.k});
  for (std::uint32_t p = 0; p < found.count; ++p) {
    if (!is_cut(slab.pieces[first + p])) continue;
    const CellMoments moments = sums_[p].total(found.of_corner[0] == p ? voxel.winding[0] : 0);
    constexpr double kSame = 1e-9;
    const double sum = std::accumulate(moments.begin(), moments.end(), 0.);
    if (std::abs(sum - slab.pieces[first + p].fill) < kSame) append_moments(moments, first + p, slab);
  }
}

}  // namespace flexel::voxelize
