// Every plane of lattice points is swept by itself, row by row along x, with a cursor in each of the four
// adjacent rows of voxels. In the common case, a point inside matter with one piece in each voxel around it,
// there is one element. Otherwise the pieces around the point (of up to eight voxels) are joined where they
// meet, and each group with a kept piece gets an element. Numbers are local to the plane until all planes are
// done.
#include "voxelize/lattice/elements.h"

#include <algorithm>

#include "base/bucket.h"
#include "base/disjoint_sets.h"
#include "base/parallel.h"

namespace flexel::voxelize {
namespace {

constexpr std::size_t kNoEntry = ~std::size_t{0};

// Where the elements of a piece are put.
class Entries {
 public:
  explicit Entries(std::size_t pieces) : count_(pieces) {}
  Entries(const std::vector<std::uint32_t>& number, std::uint32_t first, std::size_t count)
      : number_(&number), first_(first), count_(count) {}
  [[nodiscard]] std::size_t of(std::size_t piece) const {
    if (number_ == nullptr) return piece;
    const std::uint32_t number = (*number_)[piece];
    return number >= kLeftOut ? kNoEntry : number - first_;
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  const std::vector<std::uint32_t>* number_ = nullptr;
  std::uint32_t first_ = 0;
  std::size_t count_ = 0;
};

// A piece beside the lattice point.
struct Neighbour {
  const Slab* slab = nullptr;
  std::uint32_t piece = 0;  // within the slab
  std::size_t entry = 0;    // in of_piece, or kNoEntry
  int voxel = 0;            // which of the eight: di + 2 dj + 4 dk, 0 below the point, 1 above it
};

// A row of voxels and how far the sweep has come.
struct Cursor {
  const Slab* slab = nullptr;
  std::uint32_t at = 0, end = 0;
  std::size_t global = 0;  // number of the slab's first piece
};

struct PlaneElements {
  std::vector<Index3> index;
  std::vector<std::uint16_t> number;
};

class PlaneSweep {
 public:
  PlaneSweep(const Voxels& voxels, const Entries& entries, int k, PlaneElements& out,
             std::vector<std::array<std::uint32_t, 8>>& of_piece)
      : voxels_(voxels), entries_(entries), k_(k), out_(out), of_piece_(of_piece) {}

  void run() {
    int begin = 0, end = 0;
    bool any = false;
    for (int dk = 0; dk < 2; ++dk)
      if (const Slab* slab = voxels_.slab(k_ - 1 + dk); slab != nullptr && slab->rows() > 0) {
        begin = any ? std::min(begin, slab->j_begin) : slab->j_begin;
        end = any ? std::max(end, slab->j_begin + slab->rows()) : slab->j_begin + slab->rows();
        any = true;
      }
    if (!any) return;
    for (int j = begin; j <= end; ++j) sweep_row(j);
  }

 private:
  void sweep_row(int j) {
    for (int row = 0; row < 4; ++row) cursors_[row] = cursor(j - 1 + (row & 1), k_ - 1 + (row >> 1));
    int i = 0;
    while (next_voxel(i)) {
      do {
        gather(i);
        if (!neighbours_.empty()) add_point(i, j);
        ++i;
      } while (ahead_ > 0);
    }
  }

  // The lowest voxel that no cursor has passed.
  bool next_voxel(int& i) const {
    bool any = false;
    for (const Cursor& c : cursors_)
      if (c.at < c.end) {
        i = any ? std::min(i, c.slab->pieces[c.at].i) : c.slab->pieces[c.at].i;
        any = true;
      }
    return any;
  }

  Cursor cursor(int j, int k) const {
    const Slab* slab = voxels_.slab(k);
    if (slab == nullptr || j < slab->j_begin || j >= slab->j_begin + slab->rows()) return {};
    return {slab, slab->row_begin[j - slab->j_begin], slab->row_begin[j - slab->j_begin + 1],
            voxels_.first_piece[k - voxels_.k_begin]};
  }

  // The pieces around point i: those of voxels i - 1, which the cursors then pass, and of voxels i, which are
  // ahead.
  void gather(int i) {
    neighbours_.clear();
    ahead_ = 0;
    for (int row = 0; row < 4; ++row) {
      Cursor& c = cursors_[row];
      for (; c.at < c.end && c.slab->pieces[c.at].i == i - 1; ++c.at) add_neighbour(c, c.at, 2 * row);
      std::uint32_t ahead = c.at;
      for (; ahead < c.end && c.slab->pieces[ahead].i == i; ++ahead) add_neighbour(c, ahead, 2 * row + 1);
      ahead_ += static_cast<int>(ahead - c.at);
    }
  }

  void add_neighbour(const Cursor& c, std::uint32_t piece, int voxel) {
    neighbours_.push_back({c.slab, piece, entries_.of(c.global + piece), voxel});
  }

  static const Piece& piece_of(const Neighbour& n) { return n.slab->pieces[n.piece]; }

  void set(const Neighbour& n, std::uint32_t element) {
    if (n.entry != kNoEntry) of_piece_[n.entry][7 - n.voxel] = element;
  }

  // All eight voxels are there in one piece each, and the point is inside all of them.
  [[nodiscard]] bool inside() const {
    if (neighbours_.size() != 8) return false;
    return std::all_of(neighbours_.begin(), neighbours_.end(), [](const Neighbour& n) {
      return !(piece_of(n).flags & kOneOfSeveral) && piece_of(n).corners >> (7 - n.voxel) & 1;
    });
  }

  void add_point(int i, int j) {
    if (inside() && std::any_of(neighbours_.begin(), neighbours_.end(),
                                [this](const Neighbour& n) { return has_cell(voxels_, piece_of(n)); })) {
      const std::uint32_t element = add_element(i, j, 0);
      for (const Neighbour& n : neighbours_) set(n, element);
      return;
    }
    join();
    add_groups(i, j);
  }

  void join() {
    const auto count = static_cast<std::uint32_t>(neighbours_.size());
    std::sort(neighbours_.begin(), neighbours_.end(), [](const Neighbour& a, const Neighbour& b) {
      return a.voxel != b.voxel ? a.voxel < b.voxel : a.piece < b.piece;
    });
    sets_.reset(count);
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = a + 1; b < count; ++b) {
        const int difference = neighbours_[b].voxel - neighbours_[a].voxel;
        if ((neighbours_[a].voxel & difference) != 0) continue;
        const int axis = difference == 1 ? 0 : difference == 2 ? 1 : difference == 4 ? 2 : -1;
        if (axis < 0) continue;
        if (meet(*neighbours_[a].slab, neighbours_[a].piece, *neighbours_[b].slab, neighbours_[b].piece,
                 axis))
          sets_.unite(a, b);
      }
  }

  void add_groups(int i, int j) {
    const auto count = static_cast<std::uint32_t>(neighbours_.size());
    kept_.assign(count, false);
    for (std::uint32_t n = 0; n < count; ++n)
      if (has_cell(voxels_, piece_of(neighbours_[n]))) kept_[sets_.root(n)] = true;
    element_.assign(count, kNoElement);
    std::uint16_t number = 0;
    for (std::uint32_t n = 0; n < count; ++n) {
      const std::uint32_t root = sets_.root(n);
      if (root == n && kept_[n]) element_[n] = add_element(i, j, number++);
      set(neighbours_[n], element_[root]);
    }
  }

  std::uint32_t add_element(int i, int j, std::uint16_t number) {
    out_.index.push_back({i, j, k_});
    out_.number.push_back(number);
    return static_cast<std::uint32_t>(out_.index.size() - 1);
  }

  const Voxels& voxels_;
  const Entries& entries_;
  int k_;
  PlaneElements& out_;
  std::vector<std::array<std::uint32_t, 8>>& of_piece_;
  std::array<Cursor, 4> cursors_;
  std::vector<Neighbour> neighbours_;
  int ahead_ = 0;
  DisjointSets sets_;
  std::vector<bool> kept_;
  std::vector<std::uint32_t> element_;
};

void concatenate(const std::vector<PlaneElements>& planes, const std::vector<std::uint32_t>& begin,
                 LatticeElements& elements) {
  resize_touched(elements.index, begin.back());
  resize_touched(elements.number, begin.back());
  parallel_for_each(
      planes.size(),
      [&](std::size_t p) {
        std::copy(planes[p].index.begin(), planes[p].index.end(), elements.index.begin() + begin[p]);
        std::copy(planes[p].number.begin(), planes[p].number.end(), elements.number.begin() + begin[p]);
      },
      4);
}

// Numbers within planes become numbers within the part.
void shift_numbers(const Voxels& voxels, const Entries& entries, const std::vector<std::uint32_t>& begin,
                   std::vector<std::array<std::uint32_t, 8>>& of_piece) {
  parallel_for_each(
      voxels.slabs.size(),
      [&](std::size_t s) {
        for (std::size_t p = voxels.first_piece[s]; p < voxels.first_piece[s + 1]; ++p) {
          const std::size_t entry = entries.of(p);
          if (entry == kNoEntry) continue;
          for (int a = 0; a < 8; ++a)
            if (of_piece[entry][a] != kNoElement) of_piece[entry][a] += begin[s + (a >> 2)];
        }
      },
      2);
}

LatticeElements make(const Voxels& voxels, const Entries& entries) {
  LatticeElements elements;
  resize_touched(elements.of_piece, entries.count());
  std::vector<PlaneElements> planes(voxels.slabs.size() + 1);
  parallel_for_each(
      planes.size(),
      [&](std::size_t p) {
        PlaneSweep(voxels, entries, voxels.k_begin + static_cast<int>(p), planes[p], elements.of_piece).run();
      },
      2);
  std::vector<std::uint32_t> begin(1, 0);
  for (const PlaneElements& plane : planes)
    begin.push_back(begin.back() + static_cast<std::uint32_t>(plane.index.size()));
  concatenate(planes, begin, elements);
  shift_numbers(voxels, entries, begin, elements.of_piece);
  return elements;
}

}  // namespace

LatticeElements make_elements(const Voxels& voxels) {
  return make(voxels, Entries(voxels.piece_count()));
}

LatticeElements make_elements(const Voxels& voxels, const std::vector<std::uint32_t>& number,
                              std::uint32_t first, std::size_t count) {
  return make(voxels, Entries(number, first, count));
}

}  // namespace flexel::voxelize
