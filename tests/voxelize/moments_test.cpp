// Moments of cut cells against integrals over polyhedra that were cut another way, tetrahedron by tetrahedron.
#include <numeric>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/parallel.h"
#include "tests/voxelize/shapes.h"
#include "voxelize/classify/classify.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;
using Polynomial = std::function<double(const Vec3&)>;  // of degree 4 along each axis

// Gauss's eight points and weights on [0, 1], by Newton's method on P_8.
std::array<std::array<double, 2>, 8> eight_points() {
  std::array<std::array<double, 2>, 8> rule{};
  for (std::size_t i = 0; i < 8; ++i) {
    double x = std::cos(std::numbers::pi * (static_cast<double>(i) + .75) / 8.5), slope = 0;
    for (int step = 0; step < 20; ++step) {
      double before = 1, at = x;
      for (int k = 2; k <= 8; ++k) before = std::exchange(at, ((2 * k - 1) * x * at - (k - 1) * before) / k);
      slope = 8 * (x * at - before) / (x * x - 1);
      x -= at / slope;
    }
    rule[i] = {(1 + x) / 2, 1 / ((1 - x * x) * slope * slope)};
  }
  return rule;
}

// visit(point, weight) for the points of a rule of degree 12 on a tetrahedron, its volume signed.
template <class Visit>
void for_tetrahedron(const std::array<Vec3, 4>& v, const Visit& visit) {
  static const auto rule = eight_points();
  const double volume = (v[1] - v[0]).dot((v[2] - v[0]).cross(v[3] - v[0]));
  for (const auto& [a, wa] : rule)
    for (const auto& [b, wb] : rule)
      for (const auto& [c, wc] : rule)
        visit(Vec3(v[0] + a * ((1 - b) * (v[1] - v[0]) + b * ((1 - c) * (v[2] - v[0]) + c * (v[3] - v[0])))),
              wa * wb * wc * a * a * b * volume);
}

double integral(const std::vector<Vec3>& vertices, const std::vector<Corners>& triangles,
                const Polynomial& f) {
  double sum = 0;
  for (const Corners& t : triangles)
    for_tetrahedron({Vec3::Zero(), vertices[t[0]], vertices[t[1]], vertices[t[2]]},
                    [&](const Vec3& at, double weight) { sum += weight * f(at); });
  return sum;
}

// A convex body as its faces, outward.
using Faces = std::vector<std::vector<Vec3>>;

Faces unit_cube(const Vec3& low) {
  const Mesh mesh = box(low, low + Vec3::Ones());
  Faces faces;
  for (const auto& t : mesh.triangles)
    faces.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
  return faces;
}

// What is left where normal . x <= distance.
Faces cut(const Faces& faces, const Vec3& normal, double distance) {
  Faces left;
  std::vector<Vec3> rim;
  for (const std::vector<Vec3>& face : faces) {
    std::vector<Vec3> kept;
    for (std::size_t v = 0; v < face.size(); ++v) {
      const Vec3 &p = face[v], &q = face[(v + 1) % face.size()];
      const double a = normal.dot(p) - distance, b = normal.dot(q) - distance;
      if (a <= 0) kept.push_back(p);
      if ((a < 0) != (b < 0) && a != 0 && b != 0) {
        kept.push_back(p + a / (a - b) * (q - p));
        rim.push_back(kept.back());
      } else if (a == 0)
        rim.push_back(p);
    }
    if (kept.size() > 2) left.push_back(kept);
  }
  if (rim.size() < 3) return left;
  Vec3 middle = Vec3::Zero();
  for (const Vec3& p : rim) middle += p / static_cast<double>(rim.size());
  const Vec3 u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
  std::sort(rim.begin(), rim.end(), [&](const Vec3& p, const Vec3& q) {
    return std::atan2(v.dot(p - middle), u.dot(p - middle)) <
           std::atan2(v.dot(q - middle), u.dot(q - middle));
  });
  left.push_back(rim);
  return left;
}

CellMoments moments_of(const Faces& faces, const Vec3& low) {
  CellMoments moments{};
  for (const std::vector<Vec3>& face : faces)
    for (std::size_t v = 1; v + 1 < face.size(); ++v)
      for_tetrahedron({faces[0][0], face[0], face[v], face[v + 1]}, [&](const Vec3& at, double weight) {
        const auto x = lagrange_at(at.x() - low.x()), y = lagrange_at(at.y() - low.y()),
                   z = lagrange_at(at.z() - low.z());
        for (std::size_t k = 0; k < kMoments; ++k) moments[k] += weight * x[k % 5] * y[k / 5 % 5] * z[k / 25];
      });
  return moments;
}

double largest_difference(const CellMoments& a, const CellMoments& b) {
  double most = 0;
  for (std::size_t k = 0; k < kMoments; ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

double sum_of(const CellMoments& moments) {
  return std::accumulate(moments.begin(), moments.end(), 0.);
}

PartMesh placed_at(const Mesh& mesh, double h, const Vec3& origin = Vec3::Zero()) {
  PartMesh part = part_meshes(surface(mesh))[0];
  Lattice lattice;
  lattice.spacing = Vec3::Constant(h);
  lattice.origin = origin;
  place_on_lattice(part, lattice);
  return part;
}

// A piece with the moments that it has: its own, or those of a whole cell.
struct PieceMoments {
  Index3 voxel{};
  double fill = 0;
  bool cut = false;
  CellMoments moments{};
};

std::vector<PieceMoments> pieces_of(const Voxels& voxels) {
  std::vector<PieceMoments> result;
  for (std::size_t s = 0; s < voxels.slabs.size(); ++s) {
    const Slab& slab = voxels.slabs[s];
    std::size_t next = 0;
    for (int j = slab.j_begin; j < slab.j_begin + slab.rows(); ++j)
      for (std::uint32_t p = slab.row_begin[j - slab.j_begin]; p < slab.row_begin[j - slab.j_begin + 1];
           ++p) {
        const Piece& piece = slab.pieces[p];
        PieceMoments each{{piece.i, j, voxels.k_begin + static_cast<int>(s)}, piece.fill, false, {}};
        if (next < slab.moment_pieces.size() && slab.moment_pieces[next] == p) {
          each.cut = true;
          each.moments = slab.moments[next++];
        } else if (piece.fill >= kWholeFill) {
          each.moments = whole_moments();
        }
        EXPECT_NEAR(sum_of(each.moments), each.fill, 1e-9);
        result.push_back(each);
      }
    EXPECT_EQ(next, slab.moments.size());
  }
  return result;
}

std::vector<PieceMoments> pieces_of(const PartMesh& mesh) {
  return pieces_of(classify_closed(mesh, {.with_moments = true}));
}

Vec3 low_of(const Index3& voxel) {
  return Vec3(voxel[0], voxel[1], voxel[2]);
}

double integral(const std::vector<PieceMoments>& pieces, const Polynomial& f) {
  double sum = 0;
  for (const PieceMoments& piece : pieces)
    for (std::size_t k = 0; k < kMoments; ++k)
      sum += piece.moments[k] * f(low_of(piece.voxel) +
                                  Vec3(kGaussPoints[k % 5], kGaussPoints[k / 5 % 5], kGaussPoints[k / 25]));
  return sum;
}

// Every x^a y^b z^c with a + b + c <= 4, in units of `size`.
std::vector<Polynomial> polynomials(double size) {
  std::vector<Polynomial> result;
  for (int a = 0; a <= 4; ++a)
    for (int b = 0; a + b <= 4; ++b)
      for (int c = 0; a + b + c <= 4; ++c)
        result.push_back([=](const Vec3& at) {
          return std::pow(at.x() / size, a) * std::pow(at.y() / size, b) * std::pow(at.z() / size, c);
        });
  return result;
}

Mat3 turned_by_33_degrees() {
  return Eigen::AngleAxisd(33 * std::numbers::pi / 180, Vec3(1, 2, 3).normalized()).toRotationMatrix();
}

TEST(Moments, OfABoxAtAnyAngleAreThoseOfTheCutCube) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 6; ++trial) {
    const Mat3 turn = trial == 0 ? turned_by_33_degrees() : random_rotation(random);
    const Vec3 size(3.1, 2.2, 1.4 + .1 * trial);
    std::size_t cut_cells = 0;
    for (const PieceMoments& piece : pieces_of(placed_at(transformed(box(Vec3::Zero(), size), turn), 1))) {
      if (!piece.cut) continue;
      ++cut_cells;
      Faces faces = unit_cube(low_of(piece.voxel));
      for (int axis = 0; axis < 3; ++axis) {
        faces = cut(faces, turn.col(axis), size[axis]);
        faces = cut(faces, -turn.col(axis), 0);
      }
      ASSERT_FALSE(faces.empty());
      EXPECT_LT(largest_difference(piece.moments, moments_of(faces, low_of(piece.voxel))), 1e-13);
    }
    EXPECT_GT(cut_cells, 30u);
  }
}

TEST(Moments, IntegratePolynomialsOverATurnedBox) {
  const Mesh mesh = transformed(box({0, 0, 0}, {2, .5, .5}), turned_by_33_degrees());
  for (const double h : {.5, .25, .11}) {
    const PartMesh part = placed_at(mesh, h);
    const std::vector<PieceMoments> pieces = pieces_of(part);
    for (const Polynomial& f : polynomials(2 / h)) {
      const double exact = integral(part.vertices, part.corners, f);
      EXPECT_NEAR(integral(pieces, f), exact,
                  1e-13 * integral(part.vertices, part.corners, [](const Vec3&) { return 1.; }));
    }
  }
}

TEST(Moments, IntegratePolynomialsOverABallAndATorus) {
  for (const Mesh& mesh : {icosphere(3, 1, {.3, -.2, .1}), torus(1, .3, 31, 17)}) {
    const PartMesh part = placed_at(mesh, .21);
    const std::vector<PieceMoments> pieces = pieces_of(part);
    const double volume = integral(part.vertices, part.corners, [](const Vec3&) { return 1.; });
    for (const Polynomial& f : polynomials(1.5 / .21))
      EXPECT_NEAR(integral(pieces, f), integral(part.vertices, part.corners, f), 1e-12 * volume);
  }
}

TEST(Moments, OfThePiecesOfAVoxelAreThoseOfEachLeaf) {
  const double h = .1;
  const Mat3 turn = turned(.3, .2, .1);
  const Mesh a = transformed(box({0, 0, 0}, {1, .6, .8 * h}), turn);
  const Mesh b = transformed(box({0, 0, 1.1 * h}, {1, .6, 1.9 * h}), turn);
  std::map<Index3, std::vector<CellMoments>> alone;
  for (const Mesh& mesh : {a, b})
    for (const PieceMoments& piece : pieces_of(placed_at(mesh, h)))
      alone[piece.voxel].push_back(piece.moments);
  std::map<Index3, std::vector<CellMoments>> together;
  for (const PieceMoments& piece : pieces_of(placed_at(merged(a, b), h)))
    together[piece.voxel].push_back(piece.moments);
  std::size_t split = 0;
  ASSERT_EQ(alone.size(), together.size());
  for (auto& [voxel, pieces] : together) {
    auto& expected = alone.at(voxel);
    ASSERT_EQ(pieces.size(), expected.size());
    split += pieces.size() > 1;
    for (const CellMoments& piece : pieces) {
      double nearest = 1;
      for (const CellMoments& each : expected) nearest = std::min(nearest, largest_difference(piece, each));
      EXPECT_LT(nearest, 1e-13);
    }
  }
  EXPECT_GT(split, 20u);
}

TEST(Moments, OfABoxOnLatticePlanesAreNoneAndProducts) {
  for (const PieceMoments& piece : pieces_of(placed_at(box({1, 2, 3}, {4, 4, 5}), 1)))
    EXPECT_FALSE(piece.cut);
  // The upper layer is half full, a quarter in the last row.
  std::size_t cut_cells = 0;
  for (const PieceMoments& piece : pieces_of(placed_at(box({0, 0, 0}, {3, 2.5, 1.5}), 1))) {
    if (!piece.cut) {
      EXPECT_LT(piece.fill * (1 - piece.fill), 1e-12);
      continue;
    }
    ++cut_cells;
    const double y = piece.voxel[1] == 2 ? .5 : 1, z = piece.voxel[2] == 1 ? .5 : 1;
    const auto part_of = [](double height) {  // the integral of each polynomial from 0 to `height`
      std::array<double, 5> value{};
      for (std::size_t g = 0; g < 5; ++g) {
        const auto at = lagrange_at(height * kGaussPoints[g]);
        for (std::size_t i = 0; i < 5; ++i) value[i] += height * kGaussWeights[g] * at[i];
      }
      return value;
    };
    const auto along_y = part_of(y), along_z = part_of(z);
    CellMoments expected;
    for (std::size_t k = 0; k < kMoments; ++k)
      expected[k] = kGaussWeights[k % 5] * along_y[k / 5 % 5] * along_z[k / 25];
    EXPECT_LT(largest_difference(piece.moments, expected), 1e-15);
  }
  EXPECT_EQ(cut_cells, 12u);
}

TEST(Moments, MoveWithThePartByWholeCells) {
  Mesh mesh = transformed(fork(.1, .0375, .25, .5), turned(.5, .4, .3));
  for (Vec3& v : mesh.vertices) v = (v * 1048576).array().round() / 1048576;  // so that shifts are exact
  const auto here = pieces_of(placed_at(mesh, .125));
  const auto there = pieces_of(placed_at(transformed(mesh, Mat3::Identity(), {.375, -.625, .875}), .125));
  ASSERT_EQ(here.size(), there.size());
  for (std::size_t p = 0; p < here.size(); ++p) {
    EXPECT_EQ(there[p].voxel, (Index3{here[p].voxel[0] + 3, here[p].voxel[1] - 5, here[p].voxel[2] + 7}));
    EXPECT_LT(largest_difference(here[p].moments, there[p].moments), 1e-13);
  }
}

TEST(Moments, OfSliversIntegrateSquaresToPositiveNumbers) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::size_t slivers = 0;
  for (const double thickness : {.003, .02, .1, .7}) {
    const Mesh plate = transformed(box({0, 0, 0}, {5, 4, thickness}), turned_by_33_degrees());
    for (const PieceMoments& piece : pieces_of(placed_at(plate, 1))) {
      if (piece.fill < 1e-5) continue;
      slivers += piece.fill < .02;
      for (int trial = 0; trial < 20; ++trial) {
        double coefficient[27], sum = 0;
        for (double& c : coefficient) c = uniform(random);
        for (std::size_t k = 0; k < kMoments; ++k) {
          const double x = kGaussPoints[k % 5], y = kGaussPoints[k / 5 % 5], z = kGaussPoints[k / 25];
          double value = 0;
          for (int n = 0; n < 27; ++n)
            value += coefficient[n] * std::pow(x, n % 3) * std::pow(y, n / 3 % 3) * std::pow(z, n / 9);
          sum += piece.moments[k] * value * value;
        }
        EXPECT_GT(sum, 0) << piece.fill;
      }
    }
  }
  EXPECT_GT(slivers, 20u);
}

VoxelizeResult with_moments(const Mesh& mesh, double size, Heal heal = Heal::automatic) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.size = size;
  options.align = Align::none;
  options.max_memory = 1e12;
  options.moments = true;
  options.heal.mode = heal;
  VoxelizeResult result = voxelize(surface(mesh), options, progress);
  check(result.body, "test");
  return result;
}

// How many cells have moments, of them those of matter spread evenly.
std::array<std::size_t, 2> count_cut(const Body& body) {
  std::size_t even = 0, next = 0;
  const CellMoments whole = whole_moments();
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (next == body.moment_cells.size() || body.moment_cells[next] != c) {
      EXPECT_GE(body.fill[c], kWholeFill);
      continue;
    }
    double most = 0;
    for (std::size_t k = 0; k < kMoments; ++k)
      most = std::max(most, std::abs(body.moments[kMoments * next + k] - body.fill[c] * whole[k]));
    even += most < 1e-12;
    ++next;
  }
  return {next, even};
}

TEST(Moments, OfTheBodyBelongToItsCutCells) {
  const Mesh mesh = transformed(merged(torus(1, .3, 31, 17), icosphere(2, .4)), turned(.5, .4, .3));
  const Body body = with_moments(mesh, .13).body;
  const auto [cut_cells, even] = count_cut(body);
  EXPECT_GT(cut_cells, 200u);
  EXPECT_EQ(even, 0u);
  const Body without = run(mesh, .13).body;
  EXPECT_TRUE(without.moments.empty() && without.moment_cells.empty());
  std::vector<double> firm;  // slivers stay with moments alone
  std::copy_if(body.fill.begin(), body.fill.end(), std::back_inserter(firm),
               [](double fill) { return fill >= kDroppedFill; });
  EXPECT_EQ(without.fill, firm);
  EXPECT_LT(firm.size(), body.fill.size());
  const ThreadLimit one(1);
  const Body again = with_moments(mesh, .13).body;
  EXPECT_EQ(again.moment_cells, body.moment_cells);
  EXPECT_EQ(again.moments, body.moments);
}

TEST(Moments, OfSeveralPartsFollowEachOther) {
  Progress progress("test", Progress::Mode::quiet);
  Surface both = surface(icosphere(2, 1)), other = surface(icosphere(2, .7, {5, 0, 0}));
  append(both, std::move(other));
  VoxelizeOptions options;
  options.size = .2;
  options.align = Align::none;
  options.moments = true;
  const Body body = voxelize(std::move(both), options, progress).body;
  check(body, "test");
  const Body first = with_moments(icosphere(2, 1), .2).body;
  ASSERT_GT(body.moments.size(), first.moments.size());
  EXPECT_TRUE(std::equal(first.moments.begin(), first.moments.end(), body.moments.begin()));
  EXPECT_EQ(count_cut(body)[1], 0u);
}

// Two boxes that overlap, with faces on lattice planes and between them.
TEST(Moments, WhereShellsOverlapAreThoseOfTheUnion) {
  const std::array<Vec3, 2> a{Vec3(0, 0, 0), Vec3(3, 2.5, .75)}, b{Vec3(1.5, .25, .125), Vec3(4, 2, 2)};
  const Polynomial f = [](const Vec3& at) {
    return 1 + at.x() * at.x() * at.y() - 2 * std::pow(at.z(), 4) + std::pow(at.x() * at.y(), 3) * at.z();
  };
  const auto over = [&](const Vec3& low, const Vec3& high) {
    const Mesh mesh = box(low, high);
    return integral(mesh.vertices, mesh.triangles, f);
  };
  const double exact = over(a[0], a[1]) + over(b[0], b[1]) - over(b[0].cwiseMax(a[0]), b[1].cwiseMin(a[1]));
  const VoxelizeResult result = with_moments(merged(box(a[0], a[1]), box(b[0], b[1])), 1);
  EXPECT_GT(result.parts[0].overlapping_voxels, 0u);
  EXPECT_EQ(result.parts[0].spread_cells, 0u);
  const Body& body = result.body;
  const CellMoments whole = whole_moments();
  double sum = 0;
  std::size_t next = 0;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    const bool cut = next < body.moment_cells.size() && body.moment_cells[next] == c;
    const Vec3& low = body.rest[body.cell_elements[c][0]];
    for (std::size_t k = 0; k < kMoments; ++k)
      sum += (cut ? body.moments[kMoments * next + k] : whole[k]) *
             f(low + Vec3(kGaussPoints[k % 5], kGaussPoints[k / 5 % 5], kGaussPoints[k / 25]));
    next += cut;
  }
  EXPECT_NEAR(sum / exact, 1, 1e-9);
  EXPECT_EQ(count_cut(with_moments(merged(icosphere(2, 1), icosphere(2, 1, {.7, .1, .2})), .2).body)[1], 0u);
}

TEST(Moments, OfASurfaceThatIsNotClosedAreRefused) {
  Mesh open = icosphere(2, 1);
  open.triangles.resize(open.triangles.size() - 3);
  EXPECT_THROW((void)with_moments(open, .2, Heal::none), InputError);
}

TEST(Moments, AreThereWhenACountIsAskedFor) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.align = Align::none;
  options.moments = true;
  for (const std::size_t count : {300u, 3000u}) {
    options.count = count;
    const Body body = voxelize(surface(icosphere(3, 1)), options, progress).body;
    check(body, "test");
    const auto [cut_cells, even] = count_cut(body);
    EXPECT_GT(cut_cells, 100u);
    EXPECT_EQ(even, 0u);
  }
}

TEST(Moments, AreRefusedWhereThereAreNoCells) {
  Progress progress("test", Progress::Mode::quiet);
  VoxelizeOptions options;
  options.placement = Placement::centre;
  options.moments = true;
  EXPECT_THROW((void)voxelize(surface(icosphere(1, 1)), options, progress), InputError);
}

}  // namespace
}  // namespace flexel::voxelize
