// A coarse cell that matter of several processes makes is a cell of each at first. What joins them is known by the faces between
// fine cells of two processes, which are called by the numbers of their elements.
#include "simulate/estimate/coarsen_pieces.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/files/packing.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/estimate/coarse_grid.h"
#include "simulate/estimate/coarsen.h"

namespace flexel::simulate {
namespace {

// A face of an own fine cell that meets one of another process.
struct SharedFace {
  std::array<std::int64_t, 4> elements{};  // their numbers over all pieces, ascending
  std::array<std::uint32_t, 4> cells{};    // coarse, along the face; the first `count`
  std::int32_t voxel = 0;                  // of these, along the axis
  std::uint16_t axis = 0, count = 0;
  std::uint32_t upper = 0;  // 1: of the two the own cell is the lower one
  [[nodiscard]] auto place() const { return std::tuple(axis, elements); }
};

// What a process makes of its own cells.
struct OwnCoarse {
  std::vector<Index3> lattice_index;                        // (elements)
  std::vector<std::array<std::uint32_t, 8>> cell_elements;  // (cells)
  std::vector<double> fill;                                 // (cells)
  std::vector<std::uint32_t> surface_cell_offsets, surface_cells;
  std::vector<SharedFace> faces;
};

template <class Archive>
void visit_own(Archive& archive, OwnCoarse& own) {
  visit_all(archive, own.lattice_index, own.cell_elements, own.fill, own.surface_cell_offsets,
            own.surface_cells, own.faces);
}

// The own cells alone, with all elements. `number`: (cells of `body`) of each there.
Body own_cells(const Body& body, std::vector<std::uint32_t>& number) {
  constexpr std::uint32_t kNone = ~0u;
  Body own;
  own.parts = body.parts;
  own.lattice_index = body.lattice_index;
  own.rest = body.rest;
  number.assign(body.cell_count(), kNone);
  for (std::uint32_t c = 0; c < body.cell_count(); ++c) {
    if (!counts_cell(c)) continue;
    number[c] = static_cast<std::uint32_t>(own.cell_elements.size());
    own.cell_elements.push_back(body.cell_elements[c]);
    own.fill.push_back(body.fill[c]);
  }
  own.broken.assign(own.fill.size(), 0);
  own.parts[0].cell_begin = 0;
  own.parts[0].cell_end = static_cast<std::uint32_t>(own.fill.size());
  for (std::size_t p = 0; p + 1 < body.surface_cell_offsets.size(); ++p) {
    own.surface_cell_offsets.push_back(static_cast<std::uint32_t>(own.surface_cells.size()));
    for (std::uint32_t at = body.surface_cell_offsets[p]; at < body.surface_cell_offsets[p + 1]; ++at)
      if (number[body.surface_cells[at]] != kNone)
        own.surface_cells.push_back(number[body.surface_cells[at]]);
  }
  own.surface_cell_offsets.push_back(static_cast<std::uint32_t>(own.surface_cells.size()));
  return own;
}

SharedFace shared_face(const Body& own, std::uint32_t cell, std::uint16_t axis, bool upper,
                       const Coarsening& coarse, const std::array<CoarseGrid, 3>& grids) {
  SharedFace face;
  face.axis = axis;
  face.upper = upper;
  const std::array<std::uint32_t, 8>& corners = own.cell_elements[cell];
  std::size_t n = 0;
  for (std::uint32_t a = 0; a < 8; ++a)
    if ((a >> axis & 1u) == face.upper) face.elements[n++] = other_pieces()->number_of(corners[a]);
  std::sort(face.elements.begin(), face.elements.end());
  const Index3& at = own.lattice_index[corners[0]];
  const std::array<GridCut, 3> cuts{cut(grids[0], at[0]), cut(grids[1], at[1]), cut(grids[2], at[2])};
  const std::uint32_t place = upper ? cuts[axis].count - 1 : 0;
  face.voxel = cuts[axis].voxel + static_cast<std::int32_t>(place);
  std::uint32_t box = coarse.offsets[cell];
  std::array<std::uint32_t, 3> here{};
  for (here[2] = 0; here[2] < cuts[2].count; ++here[2])
    for (here[1] = 0; here[1] < cuts[1].count; ++here[1])
      for (here[0] = 0; here[0] < cuts[0].count; ++here[0], ++box)
        if (here[axis] == place) face.cells[face.count++] = coarse.cells[box];
  return face;
}

OwnCoarse coarsen_own(const Body& body, const std::array<CoarseGrid, 3>& grids, const FacePairs& pairs,
                      Lattice& lattice) {
  std::vector<std::uint32_t> number;
  const Body own = own_cells(body, number);
  Coarsening coarse = coarsening(own, grids);
  lattice = coarse.body.parts[0].lattice;
  OwnCoarse made;
  for (std::uint16_t axis = 0; axis < 3; ++axis)
    for (const auto& [low, high] : pairs[axis])
      if (counts_cell(low) != counts_cell(high)) {
        const bool upper = counts_cell(low);
        made.faces.push_back(shared_face(own, number[upper ? low : high], axis, upper, coarse, grids));
      }
  made.lattice_index = std::move(coarse.body.lattice_index);
  made.cell_elements = std::move(coarse.body.cell_elements);
  made.fill = std::move(coarse.body.fill);
  made.surface_cell_offsets = std::move(coarse.body.surface_cell_offsets);
  made.surface_cells = std::move(coarse.body.surface_cells);
  return made;
}

// What the processes made, one after another, and which of it is one.
class Joint {
 public:
  explicit Joint(std::vector<OwnCoarse> parts) {
    for (OwnCoarse& part : parts) append(part);
    cells_.reset(all_.fill.size());
    elements_.reset(all_.lattice_index.size());
    join_faces();
  }

  // In the order of every body. `coarse` has its only part.
  void append_to(Body& coarse) {
    const std::vector<std::uint32_t> element = append_elements(coarse), cell = append_cells(coarse, element);
    coarse.surface_cell_offsets = {0};
    std::vector<std::uint32_t> under;
    for (const std::vector<std::uint32_t>& each : surface_) {
      under.clear();
      for (const std::uint32_t c : each) under.push_back(cell[c]);
      append_cells_under(under, coarse);
    }
  }

 private:
  void append(OwnCoarse& part) {
    const auto cells = static_cast<std::uint32_t>(all_.fill.size()),
               elements = static_cast<std::uint32_t>(all_.lattice_index.size());
    for (std::array<std::uint32_t, 8> corners : part.cell_elements) {
      for (std::uint32_t& corner : corners) corner += elements;
      all_.cell_elements.push_back(corners);
    }
    for (SharedFace face : part.faces) {
      for (std::uint32_t& cell : face.cells) cell += cells;
      all_.faces.push_back(face);
    }
    all_.lattice_index.insert(all_.lattice_index.end(), part.lattice_index.begin(), part.lattice_index.end());
    all_.fill.insert(all_.fill.end(), part.fill.begin(), part.fill.end());
    surface_.resize(part.surface_cell_offsets.size() - 1);
    for (std::size_t p = 0; p < surface_.size(); ++p)
      for (std::uint32_t at = part.surface_cell_offsets[p]; at < part.surface_cell_offsets[p + 1]; ++at)
        surface_[p].push_back(cells + part.surface_cells[at]);
    part = {};
  }

  // The cells on both sides of a face, along it.
  void join(const SharedFace& lower, const SharedFace& upper) {
    const std::uint32_t bit = 1u << lower.axis;
    for (std::size_t n = 0; n < lower.count; ++n) {
      const auto &a = all_.cell_elements[lower.cells[n]], &b = all_.cell_elements[upper.cells[n]];
      const bool one = lower.voxel == upper.voxel;
      if (one) cells_.unite(lower.cells[n], upper.cells[n]);
      for (std::uint32_t corner = 0; corner < 8; ++corner)
        if (one || (corner & bit) != 0) elements_.unite(a[corner], b[one ? corner : corner ^ bit]);
    }
  }

  void join_faces() {
    std::vector<SharedFace>& faces = all_.faces;
    std::sort(faces.begin(), faces.end(),
              [](const SharedFace& a, const SharedFace& b) { return a.place() < b.place(); });
    for (std::size_t begin = 0, end = 0; begin < faces.size(); begin = end) {
      while (end < faces.size() && faces[end].place() == faces[begin].place()) ++end;
      for (std::size_t a = begin; a < end; ++a)
        for (std::size_t b = begin; b < end; ++b)
          if (faces[a].upper == 1 && faces[b].upper == 0) join(faces[a], faces[b]);
    }
    faces = {};
  }

  [[nodiscard]] static auto order_of(const Index3& at, std::uint32_t n) {
    return std::tuple(at[2], at[1], at[0], n);
  }

  // The roots of `sets`, by place and number; `at`: of a root.
  template <class At>
  [[nodiscard]] static std::vector<std::uint32_t> roots(DisjointSets& sets, std::size_t count, const At& at) {
    std::vector<std::uint32_t> found;
    for (std::uint32_t n = 0; n < count; ++n)
      if (sets.root(n) == n) found.push_back(n);
    std::sort(found.begin(), found.end(),
              [&](std::uint32_t a, std::uint32_t b) { return order_of(at(a), a) < order_of(at(b), b); });
    return found;
  }

  std::vector<std::uint32_t> append_elements(Body& coarse) {
    const auto at = [&](std::uint32_t n) { return all_.lattice_index[n]; };
    std::vector<std::uint32_t> number(all_.lattice_index.size());
    for (const std::uint32_t root : roots(elements_, number.size(), at)) {
      const bool again = !coarse.lattice_index.empty() && coarse.lattice_index.back() == at(root);
      number[root] = static_cast<std::uint32_t>(coarse.element_count());
      coarse.piece.push_back(again ? static_cast<std::uint16_t>(coarse.piece.back() + 1) : std::uint16_t{0});
      coarse.lattice_index.push_back(at(root));
      coarse.rest.push_back(coarse.parts[0].lattice.to_world(Vec3(at(root)[0], at(root)[1], at(root)[2])));
    }
    for (std::uint32_t n = 0; n < number.size(); ++n) number[n] = number[elements_.root(n)];
    return number;
  }

  std::vector<std::uint32_t> append_cells(Body& coarse, const std::vector<std::uint32_t>& element) {
    const auto at = [&](std::uint32_t n) { return all_.lattice_index[all_.cell_elements[n][0]]; };
    std::vector<std::uint32_t> number(all_.fill.size());
    for (const std::uint32_t root : roots(cells_, number.size(), at)) {
      number[root] = static_cast<std::uint32_t>(coarse.cell_elements.size());
      std::array<std::uint32_t, 8> corners = all_.cell_elements[root];
      for (std::uint32_t& corner : corners) corner = element[corner];
      coarse.cell_elements.push_back(corners);
    }
    coarse.fill.assign(coarse.cell_elements.size(), 0);
    for (std::uint32_t n = 0; n < number.size(); ++n) {
      number[n] = number[cells_.root(n)];
      double& fill = coarse.fill[number[n]];
      fill = std::min(1.0, fill + all_.fill[n]);
    }
    return number;
  }

  OwnCoarse all_;
  std::vector<std::vector<std::uint32_t>> surface_;  // (polygons) the cells under each
  DisjointSets cells_, elements_;
};

void refuse_together(const Body& body) {
  std::string why;
  try {
    refuse_to_coarsen(body);
  } catch (const InputError& error) {
    why = error.what();
  }
  if (over_pieces(why.empty() ? 0 : 1) > 0)
    throw InputError(why.empty() ? "a piece of the body cannot be coarsened" : why);
}

}  // namespace

bool have_moments(const Body& body) {
  return over_pieces(body.moment_cells.empty() ? 0 : 1) > 0;
}

Body coarsened_from_pieces(const Body& body) {
  refuse_together(body);
  const FacePairs pairs = face_pairs(body);
  Lattice lattice;
  Packer packer;
  {
    OwnCoarse own =
        coarsen_own(body, choose_grids(body, body.parts[0], pairs, have_moments(body)), pairs, lattice);
    visit_own(packer, own);
  }
  std::vector<Bytes> gathered = other_pieces()->gather(std::move(packer.bytes));
  Body coarse;
  if (!other_pieces()->is_first()) return coarse;
  std::vector<OwnCoarse> all(gathered.size());
  for (std::size_t n = 0; n < all.size(); ++n) {
    Unpacker unpacker(gathered[n], "the message of a process", "is damaged");
    visit_own(unpacker, all[n]);
    gathered[n] = {};
  }
  Part part = body.parts[0];
  part.lattice = lattice;
  coarse.parts.push_back(part);
  Joint(std::move(all)).append_to(coarse);
  coarse.parts[0].element_begin = coarse.parts[0].cell_begin = 0;
  coarse.parts[0].element_end = static_cast<std::uint32_t>(coarse.element_count());
  coarse.parts[0].cell_end = static_cast<std::uint32_t>(coarse.cell_count());
  complete_at_rest(body.surface, coarse);
  return coarse;
}

}  // namespace flexel::simulate
