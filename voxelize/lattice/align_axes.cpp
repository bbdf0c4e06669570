// Directions of flat faces: a histogram of triangle normals up to sign, weighted by area, over small cells of
// the cube around the unit sphere; the largest bins are extended to all cells within 0.1 degree.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "base/parallel.h"
#include "voxelize/lattice/align.h"

namespace flexel::voxelize {
namespace {

constexpr double kSameDirection = 1.75e-3;  // rad, 0.1 degree
constexpr double kIsWorldAxis = 1e-5;       // rad: closer than the noise of single-precision files
constexpr double kEnoughArea = .05;         // of the part's: less is no dominant face
constexpr double kSplit = 8;                // a direction on a boundary may be split among so many cells
constexpr double kComparable = .5;          // of the largest: a world axis is preferred from here on

struct Direction {
  Vec3 normal = Vec3::Zero();  // unit
  double area = 0;
};

using Cell = std::array<int, 3>;

Cell cell_of(const Vec3& unit) {
  constexpr double kCells = 1 / kSameDirection;
  return {static_cast<int>(std::floor(unit.x() * kCells + .5)),
          static_cast<int>(std::floor(unit.y() * kCells + .5)),
          static_cast<int>(std::floor(unit.z() * kCells + .5))};
}

// A normal and its opposite become the same: the largest component is positive.
Vec3 same_way(const Vec3& normal) {
  int largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  return normal[largest] < 0 ? Vec3(-normal) : normal;
}

Vec3 triangle_area_vector(const PartMesh& mesh, const Corners& c) {
  const Vec3& a = mesh.world[c[0]];
  return same_way((mesh.world[c[1]] - a).cross(mesh.world[c[2]] - a) / 2);
}

// Coarse squares on a cube around the directions: a quick first look at where area gathers.
constexpr int kSquares = 64;  // along each side of a cube's face
std::size_t coarse_square(const Vec3& vector) {
  int largest = 0;
  const double length = vector.cwiseAbs().maxCoeff(&largest);
  const auto square = [&](double x) {
    return static_cast<std::size_t>(std::min(kSquares - 1., (x / length + 1) / 2 * kSquares));
  };
  return (static_cast<std::size_t>(largest) * kSquares + square(vector[(largest + 1) % 3])) * kSquares +
         square(vector[(largest + 2) % 3]);
}

// use(chunk, triangle's corners) for all triangles, in a number of chunks that is always the same.
constexpr std::size_t kChunks = 16;
template <class Use>
void for_each_triangle(const PartMesh& mesh, const Use& use) {
  const std::size_t n = mesh.corners.size();
  parallel_for_each(
      kChunks,
      [&](std::size_t chunk) {
        for (std::size_t t = chunk * n / kChunks; t < (chunk + 1) * n / kChunks; ++t)
          use(chunk, mesh.corners[t]);
      },
      1);
}

// Squares in which enough area gathers for a dominant face to be there.
std::vector<bool> heavy_squares(const PartMesh& mesh, double least_area) {
  std::array<std::vector<double>, kChunks> area;
  for (auto& of_chunk : area) of_chunk.assign(3 * kSquares * kSquares, 0);
  for_each_triangle(mesh, [&](std::size_t chunk, const Corners& c) {
    if (const Vec3 vector = triangle_area_vector(mesh, c); vector.squaredNorm() > 0)
      area[chunk][coarse_square(vector)] += vector.norm();
  });
  std::vector<bool> heavy;
  for (std::size_t square = 0; square < area[0].size(); ++square) {
    double sum = 0;
    for (const auto& of_chunk : area) sum += of_chunk[square];
    heavy.push_back(sum >= least_area);
  }
  return heavy;
}

// Area vectors gathered by direction where enough area is, largest first. Ties are broken by the cell, for
// repeatable results.
std::vector<Direction> gather(const PartMesh& mesh, double least_area) {
  const std::vector<bool> heavy = heavy_squares(mesh, least_area);
  if (std::find(heavy.begin(), heavy.end(), true) == heavy.end()) return {};
  std::array<std::map<Cell, Vec3>, kChunks> of_chunk;
  for_each_triangle(mesh, [&](std::size_t chunk, const Corners& c) {
    const Vec3 vector = triangle_area_vector(mesh, c);
    if (vector.squaredNorm() > 0 && heavy[coarse_square(vector)])
      of_chunk[chunk].try_emplace(cell_of(vector.normalized()), Vec3::Zero()).first->second += vector;
  });
  std::map<Cell, Vec3> cells;
  for (const auto& part : of_chunk)
    for (const auto& [cell, vector] : part) cells.try_emplace(cell, Vec3::Zero()).first->second += vector;
  std::vector<Direction> directions;
  for (const auto& [cell, vector] : cells) directions.push_back({vector.normalized(), vector.norm()});
  std::stable_sort(directions.begin(), directions.end(),
                   [](const Direction& a, const Direction& b) { return a.area > b.area; });
  return directions;
}

// The larger directions, each with all that lies within 0.1 degree of it.
std::vector<Direction> merge(const std::vector<Direction>& gathered, double least_area) {
  std::vector<Direction> merged;
  for (const Direction& seed : gathered) {
    if (merged.size() == 32 || seed.area < least_area) break;
    const auto near = [&](const Direction& other) {
      return seed.normal.cross(other.normal).norm() < kSameDirection;
    };
    if (std::any_of(merged.begin(), merged.end(), near)) continue;
    Vec3 sum = Vec3::Zero();
    for (const Direction& other : gathered)
      if (near(other)) sum += other.area * (seed.normal.dot(other.normal) < 0 ? -1 : 1) * other.normal;
    merged.push_back({sum.normalized(), sum.norm()});
  }
  for (Direction& direction : merged)
    for (int a = 0; a < 3; ++a)
      if (direction.normal.cross(Vec3::Unit(a)).norm() < kIsWorldAxis) direction.normal = Vec3::Unit(a);
  return merged;
}

bool is_world_axis(const Vec3& unit) {
  return unit == Vec3::UnitX() || unit == Vec3::UnitY() || unit == Vec3::UnitZ();
}

// The direction with most area that is at right angles to `to` (any where that is zero); a world axis if one
// comes near in area.
Direction largest(const std::vector<Direction>& directions, const Vec3& to, double least_area) {
  Direction best, world;
  for (const Direction& direction : directions) {
    if (direction.area < least_area || std::abs(direction.normal.dot(to)) > kSameDirection) continue;
    if (direction.area > best.area) best = direction;
    if (is_world_axis(direction.normal) && direction.area > world.area) world = direction;
  }
  return world.area >= kComparable * best.area ? world : best;
}

// The world axis that is nearest to the plane at right angles to `to`, turned into it.
Vec3 world_axis_across(const Vec3& to) {
  int axis = 0;
  to.cwiseAbs().minCoeff(&axis);
  return (Vec3::Unit(axis) - Vec3::Unit(axis).dot(to) * to).normalized();
}

// The rotation with these columns, in the order and with the signs that turn least.
Mat3 least_turn(const std::array<Vec3, 3>& directions) {
  std::array<int, 3> order = {0, 1, 2};
  Mat3 best = Mat3::Identity();
  double least = -4;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 axes;
      for (int a = 0; a < 3; ++a) axes.col(a) = (signs >> a & 1 ? -1 : 1) * directions[order[a]];
      if (axes.determinant() > 0 && axes.trace() > least + 1e-9) {
        least = axes.trace();
        best = axes;
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

}  // namespace

Mat3 dominant_axes(const PartMesh& mesh) {
  const double least_area = kEnoughArea * surface_area(mesh);
  const std::vector<Direction> directions = merge(gather(mesh, least_area / kSplit), least_area / kSplit);
  const Direction first = largest(directions, Vec3::Zero(), least_area);
  if (first.area == 0) return Mat3::Identity();
  const Direction second = largest(directions, first.normal, least_area);
  Vec3 across = second.area > 0 ? second.normal : world_axis_across(first.normal);
  across = is_world_axis(across) && is_world_axis(first.normal)
               ? across
               : Vec3((across - across.dot(first.normal) * first.normal).normalized());
  const Mat3 axes = least_turn({first.normal, across, first.normal.cross(across)});
  return (axes - Mat3::Identity()).norm() < 1e-9 ? Mat3(Mat3::Identity()) : axes;
}

}  // namespace flexel::voxelize
