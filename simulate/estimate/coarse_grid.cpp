// Flat faces of a part that lie on planes of its lattice are where cells end: full cells with no neighbour.
// The candidates for the coarse planes are those that hold two of the largest.
#include "simulate/estimate/coarse_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.h"
#include "formats/pieces/other_pieces.h"

namespace flexel::simulate {
namespace {

constexpr double kLeastPitch = 1.5, kLargestPitch = 3;  // coarse spacings in fine ones
constexpr double kDoubled = 2;                          // the pitch that is wanted
constexpr std::size_t kHeavyPlanes = 6;                 // whose distances are tried
constexpr double kOnPlane = 1e-6;                       // fine spacings
// Of the flat faces, what another pitch than the wanted one must gain, at a factor 1.5 from it.
constexpr double kGain = 0.1;

bool share_face(const std::array<std::uint32_t, 8>& low, const std::array<std::uint32_t, 8>& high,
                std::uint32_t bit) {
  for (std::uint32_t a = 0; a < 8; ++a)
    if ((a & bit) != 0 && low[a] != high[a ^ bit]) return false;
  return true;
}

bool holds(const CoarseGrid& grid, double plane) {
  const double at = (plane - grid.begin) / grid.pitch;
  return std::abs(at - std::round(at)) * grid.pitch < kOnPlane;
}

// The largest over the pieces of a body.
std::int32_t largest_over_pieces(std::int32_t own) {
  double value = own;
  if (other_pieces()) (void)other_pieces()->take_of_largest(value, std::span(&value, 1));
  return static_cast<std::int32_t>(value);
}

// Area of the flat faces by plane of the lattice, in faces of cells: full cells with no neighbour there.
struct FlatFaces {
  std::int32_t begin = 0;
  std::vector<double> area;
};

FlatFaces flat_faces(const Body& body, const Part& part, const FacePairs& pairs, std::size_t axis) {
  FlatFaces result;
  std::vector<std::array<std::uint8_t, 2>> covered(part.cell_end - part.cell_begin, {0, 0});
  for (const auto& [low, high] : pairs[axis])
    if (low >= part.cell_begin && low < part.cell_end)
      covered[low - part.cell_begin][1] = covered[high - part.cell_begin][0] = 1;
  const auto index = [&](std::uint32_t c) { return body.lattice_index[body.cell_elements[c][0]][axis]; };
  std::int32_t low = std::numeric_limits<std::int32_t>::max(),
               high = std::numeric_limits<std::int32_t>::lowest();
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    low = std::min(low, index(c));
    high = std::max(high, index(c));
  }
  low = -largest_over_pieces(-low);
  high = largest_over_pieces(high);
  result.begin = low;
  result.area.assign(static_cast<std::size_t>(high - low) + 2, 0);
  for (std::uint32_t c = part.cell_begin; c < part.cell_end; ++c) {
    if (body.broken[c] || body.fill[c] < 1 - 1e-6 || !counts_cell(c)) continue;
    for (std::size_t side = 0; side < 2; ++side)
      if (!covered[c - part.cell_begin][side])
        result.area[static_cast<std::size_t>(index(c) - low) + side] += 1;
  }
  if (other_pieces()) other_pieces()->sum(result.area);
  return result;
}

double area_on(const CoarseGrid& grid, const FlatFaces& faces) {
  double on = 0;
  for (std::size_t i = 0; i < faces.area.size(); ++i)
    if (holds(grid, faces.begin + static_cast<double>(i))) on += faces.area[i];
  return on;
}

CoarseGrid doubled_grid(const FlatFaces& faces) {
  const CoarseGrid even{static_cast<double>(faces.begin), kDoubled},
      odd{static_cast<double>(faces.begin - 1), kDoubled};
  return area_on(odd, faces) > area_on(even, faces) ? odd : even;
}

CoarseGrid choose_grid(const FlatFaces& faces, double wanted, const std::string& part) {
  const auto planes = static_cast<std::int32_t>(faces.area.size());
  if (planes < 3) throw InputError(fmt::format("part \"{}\" is one cell thick", part));
  const double total = std::accumulate(faces.area.begin(), faces.area.end(), 0.0);
  const auto score = [&](const CoarseGrid& grid) {
    return (total > 0 ? area_on(grid, faces) / total : 0) -
           kGain * std::abs(std::log(grid.pitch / wanted)) / std::log(1.5);
  };
  std::vector<std::int32_t> heavy(static_cast<std::size_t>(planes));
  std::iota(heavy.begin(), heavy.end(), 0);
  std::stable_sort(heavy.begin(), heavy.end(), [&](std::int32_t a, std::int32_t b) {
    return faces.area[static_cast<std::size_t>(a)] > faces.area[static_cast<std::size_t>(b)];
  });
  heavy.resize(std::min<std::size_t>(heavy.size(), kHeavyPlanes));
  CoarseGrid best{static_cast<double>(faces.begin), wanted};
  double most = score(best);
  const auto consider = [&](const CoarseGrid& grid) {
    if (const double value = score(grid); value > most + 1e-12) {
      most = value;
      best = grid;
    }
  };
  consider({static_cast<double>(faces.begin - 1), wanted});
  for (const std::int32_t a : heavy)
    for (const std::int32_t b : heavy) {
      const double distance = b - a;
      for (int k = 1; distance / k >= kLeastPitch - 1e-9; ++k)
        if (distance / k <= kLargestPitch + 1e-9)
          consider({static_cast<double>(faces.begin + a), distance / k});
    }
  return best;
}

}  // namespace

FacePairs face_pairs(const Body& body) {
  std::vector<std::uint32_t> first(body.element_count() + 1, 0), cells;
  const auto whole = [&](std::uint32_t c) { return !body.broken[c]; };
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (whole(c)) ++first[body.cell_elements[c][0] + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  cells.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c)
    if (whole(c)) cells[next[body.cell_elements[c][0]]++] = c;
  FacePairs pairs;
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!whole(c)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t bit = 1u << axis, corner = body.cell_elements[c][bit];
      for (std::uint32_t at = first[corner]; at < first[corner + 1]; ++at)
        if (share_face(body.cell_elements[c], body.cell_elements[cells[at]], bit))
          pairs[axis].push_back({c, cells[at]});
    }
  }
  return pairs;
}

GridCut cut(const CoarseGrid& grid, std::int32_t index) {
  const double low = (index - grid.begin) / grid.pitch, high = (index + 1 - grid.begin) / grid.pitch;
  GridCut result;
  result.voxel = static_cast<std::int32_t>(std::floor(low + kOnPlane));
  const double plane = result.voxel + 1;
  if (plane < high - kOnPlane) {
    result.count = 2;
    result.share = {(plane - low) * grid.pitch, (high - plane) * grid.pitch};
  }
  return result;
}

std::array<CoarseGrid, 3> choose_grids(const Body& body, const Part& part, const FacePairs& pairs,
                                       bool doubled) {
  std::array<FlatFaces, 3> faces;
  std::array<CoarseGrid, 3> grids;
  std::size_t thinnest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    faces[axis] = flat_faces(body, part, pairs, axis);
    grids[axis] = doubled ? doubled_grid(faces[axis]) : choose_grid(faces[axis], kDoubled, part.name);
    if (faces[axis].area.size() < faces[thinnest].area.size()) thinnest = axis;
  }
  // Cells of another shape have another error: where the part is thin and must stay finer, all axes do.
  const double wanted = std::min(kDoubled, grids[thinnest].pitch);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    CoarseGrid& grid = grids[axis];
    if (grid.pitch > wanted) grid = choose_grid(faces[axis], wanted, part.name);
    grid.begin += grid.pitch * std::floor((faces[axis].begin - grid.begin) / grid.pitch + kOnPlane);
  }
  return grids;
}

}  // namespace flexel::simulate
