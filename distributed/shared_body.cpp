// Ranks ask for a number by the numbers that pieces' files give their points.
#include "distributed/shared_body.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <optional>
#include <utility>

#include "base/error.h"
#include "formats/lattice/fields.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/lattice/fused_points.h"
#include "simulate/contact/pairs/stuck_places.h"
#include "simulate/matter/firm_groups.h"
#include "simulate/matter/stress.h"

namespace flexel::distributed {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

// What an error says, and on which ranks.
struct Told {
  std::string where, what;
  bool memory = false;
};

void broadcast_from(int from, std::string& text) {
  std::uint64_t size = text.size();
  ok(MPI_Bcast(&size, 1, MPI_UINT64_T, from, PETSC_COMM_WORLD));
  text.resize(size);
  ok(MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, from, PETSC_COMM_WORLD));
}

void refuse_if(SharedBody& body, bool here, const char* why) {
  double anywhere = here ? 1 : 0;
  body.sum(std::span(&anywhere, 1));
  if (anywhere > 0) throw WholeBodyNeeded(why);
}

}  // namespace

void all_or_none(const std::function<void()>& own) {
  std::optional<Told> told;
  try {
    own();
  } catch (const InputError& error) {
    told = Told{error.where(), error.what()};
  } catch (const std::bad_alloc&) {
    told = Told{"", "", true};
  }
  int mine = told ? rank() : ranks(), first = 0;
  ok(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  if (first == ranks()) return;
  Told all = first == rank() ? *told : Told();
  int memory = all.memory;
  ok(MPI_Bcast(&memory, 1, MPI_INT, first, PETSC_COMM_WORLD));
  if (memory != 0) throw std::bad_alloc();
  broadcast_from(first, all.where);
  broadcast_from(first, all.what);
  throw InputError(all.where, all.what);
}

SharedBody::SharedBody(const PieceFiles& files, LetFirst let_first) : let_first_(std::move(let_first)) {
  const auto each = static_cast<std::uint32_t>(files.files.size()) / static_cast<std::uint32_t>(ranks());
  first_ = each * static_cast<std::uint32_t>(rank());
  end_ = first_ + each;
  all_or_none([&] { around_ = join_around(files, first_, end_); });
  simulate::erase_stress_columns(body());
  refuse_parts();
  choose_own();
  number_elements();
  make_vectors();
  measure();
  refuse_fragments();
  refuse_far_surface();
}

// Freeing what all ranks share would wait for those that know of no error.
SharedBody::~SharedBody() {
  if (std::uncaught_exceptions() > 0) (void)vectors_.release();
}

void SharedBody::refuse_parts() {
  const Body& own = body();
  refuse_if(*this, own.parts.size() != 1, "it has several parts");
  refuse_if(*this, std::any_of(own.broken.begin(), own.broken.end(), [](auto broken) { return broken != 0; }),
            "cells of it are broken");
  refuse_if(*this, !own.cell_columns.empty() || !own.element_columns.empty(),
            "its cells or elements have columns, of an earlier run or an edit");
  refuse_if(*this,
            !fused_points(own).empty() || own.notes.contains(kCarvedNote) ||
                own.notes.contains(simulate::kStuckNote),
            "an earlier run or an edit cut or joined it");
}

// The lowest rank that has a cell of an element owns it. All cells around those of own cells are here.
void SharedBody::choose_own() {
  const std::uint32_t each = end_ - first_;
  std::vector<std::uint8_t> here(body().element_count(), 0);
  std::vector<std::uint32_t> lowest(here.size(), ~0u);
  for (std::size_t c = 0; c < body().cell_count(); ++c)
    for (const std::uint32_t e : body().cell_elements[c]) {
      here[e] |= around_.ring[c] == 0;
      lowest[e] = std::min(lowest[e], around_.piece[c] / each);
    }
  owns_.resize(here.size());
  for (std::size_t e = 0; e < here.size(); ++e)
    owns_[e] = here[e] != 0 && lowest[e] == static_cast<std::uint32_t>(rank());
}

void SharedBody::number_elements() {
  owned_ = static_cast<PetscInt>(std::count(owns_.begin(), owns_.end(), 1));
  ok(MPI_Exscan(&owned_, &first_number_, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  if (rank() == 0) first_number_ = 0;
  const std::vector<std::int64_t>& begins = around_.first_point;
  Vector by_point, found;
  const auto count = static_cast<PetscInt>(around_.point.size());
  ok(VecCreateMPI(PETSC_COMM_WORLD, static_cast<PetscInt>(begins[end_] - begins[first_]), PETSC_DETERMINE,
                  by_point.fill()));
  ok(VecSet(by_point, -1));
  PetscInt next = first_number_;
  std::vector<PetscInt> points;
  for (std::size_t e = 0; e < owns_.size(); ++e) {
    points.push_back(static_cast<PetscInt>(around_.point[e]));
    if (owns_[e]) ok(VecSetValue(by_point, points.back(), static_cast<double>(next++), INSERT_VALUES));
  }
  ok(VecAssemblyBegin(by_point));
  ok(VecAssemblyEnd(by_point));
  Indices of_here;
  ok(ISCreateGeneral(PETSC_COMM_SELF, count, points.data(), PETSC_COPY_VALUES, of_here.fill()));
  ok(VecCreateSeq(PETSC_COMM_SELF, count, found.fill()));
  Scatter ask;
  ok(VecScatterCreate(by_point, of_here, found, nullptr, ask.fill()));
  ok(VecScatterBegin(ask, by_point, found, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(ask, by_point, found, INSERT_VALUES, SCATTER_FORWARD));
  const double* values = nullptr;
  ok(VecGetArrayRead(found, &values));
  bool all = true;
  for (PetscInt e = 0; e < count; ++e) {
    number_.push_back(static_cast<PetscInt>(values[e]));
    all &= values[e] >= 0;
  }
  ok(VecRestoreArrayRead(found, &values));
  around_.point = {};  // as all are known by their numbers
  around_.piece = {};
  refuse_if(*this, !all, "elements of it are of no cell");
}

void SharedBody::make_vectors() {
  vectors_ = std::make_unique<Vectors>();
  const auto count = static_cast<PetscInt>(number_.size());
  ok(VecCreate(PETSC_COMM_WORLD, vectors_->global.fill()));
  ok(VecSetSizes(vectors_->global, 3 * owned_, PETSC_DETERMINE));
  ok(VecSetBlockSize(vectors_->global, 3));
  ok(VecSetType(vectors_->global, VECSTANDARD));
  ok(VecCreateSeq(PETSC_COMM_SELF, 3 * count, vectors_->local.fill()));
  Indices blocks;
  ok(ISCreateBlock(PETSC_COMM_SELF, 3, count, number_.data(), PETSC_COPY_VALUES, blocks.fill()));
  ok(VecScatterCreate(vectors_->global, blocks, vectors_->local, nullptr, vectors_->to_local.fill()));
}

void SharedBody::measure() {
  const auto own = static_cast<std::uint32_t>(std::count(around_.ring.begin(), around_.ring.end(), 0));
  std::vector<std::uint32_t> counts(static_cast<std::size_t>(ranks()));
  ok(MPI_Allgather(&own, 1, MPI_UINT32_T, counts.data(), 1, MPI_UINT32_T, PETSC_COMM_WORLD));
  cells_before_ = {0};
  for (const std::uint32_t count : counts) cells_before_.push_back(cells_before_.back() + count);
  first_cell_ = cells_before_[static_cast<std::size_t>(rank())];
  cells_ = cells_before_.back();
  double all = owned_;
  sum(std::span(&all, 1));
  elements_ = static_cast<std::size_t>(all);
  box_ = bounding_box(body().rest);
  ok(MPI_Allreduce(MPI_IN_PLACE, box_.min.data(), 3, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD));
  ok(MPI_Allreduce(MPI_IN_PLACE, box_.max.data(), 3, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  const std::vector<std::uint32_t>& offsets = body().surface_cell_offsets;
  with_cells_.resize(body().surface.polygon_count());
  for (std::size_t p = 0; p < with_cells_.size(); ++p) with_cells_[p] = offsets[p + 1] > offsets[p];
  ok(MPI_Allreduce(MPI_IN_PLACE, with_cells_.data(), static_cast<int>(with_cells_.size()), MPI_UINT8_T,
                   MPI_MAX, PETSC_COMM_WORLD));
}

// Groups of cells that no more than a hinge holds together need the whole body, and so do loose crumbs.
void SharedBody::refuse_fragments() {
  const std::vector<std::uint32_t> group = simulate::firm_groups(body());
  std::vector<std::uint32_t> set(body().element_count(), kNoSet);
  bool hinged = false;
  for (const bool ghosts : {false, true})
    for (std::size_t c = 0; c < group.size(); ++c)
      for (const std::uint32_t e : body().cell_elements[c]) {
        if (around_.ring[c] != (ghosts ? 1 : 0) || (ghosts && set[e] == kNoSet)) continue;
        hinged |= set[e] != kNoSet && set[e] != group[c];
        set[e] = group[c];
      }
  refuse_if(*this, hinged, "cells of it hang together by corners or edges alone");
  if (join_sets(set) != 1) throw WholeBodyNeeded("its matter is in several pieces");
}

// What lies under no cell within a spacing of it moves with the nearest of all, which no rank knows.
void SharedBody::refuse_far_surface() {
  const std::vector<std::uint32_t> around = polygons_around_vertices(body().surface, with_cells_);
  own_vertices_.assign(around.size(), 0);
  for (std::size_t v = 0; v < around.size(); ++v) {
    if (around[v] == kNoPolygonAround) continue;
    const auto at = locate_on_surface(body(), around[v], body().surface.vertices[v]);
    own_vertices_[v] = at && owns_cell(at->cell) && is_near(body(), *at);
  }
  std::vector<std::uint8_t> found = own_vertices_;
  ok(MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_UINT8_T, MPI_SUM,
                   PETSC_COMM_WORLD));
  for (std::size_t v = 0; v < around.size(); ++v)
    if (found[v] != (around[v] == kNoPolygonAround ? 0 : 1))
      throw WholeBodyNeeded("some of its surface is further than a cell from any cell under it");
}

void SharedBody::give(const std::vector<Vec3>& values, Vec to) const {
  double* array = nullptr;
  ok(VecGetArray(to, &array));
  for (std::size_t e = 0; e < values.size(); ++e)
    if (owns_[e]) Eigen::Map<Vec3>(array + 3 * (number_[e] - first_number_)) = values[e];
  ok(VecRestoreArray(to, &array));
}

void SharedBody::give_sum(const std::vector<Vec3>& values, Vec to) {
  double* array = nullptr;
  ok(VecGetArray(vectors_->local, &array));
  for (std::size_t e = 0; e < values.size(); ++e) Eigen::Map<Vec3>(array + 3 * e) = values[e];
  ok(VecRestoreArray(vectors_->local, &array));
  ok(VecZeroEntries(to));
  ok(VecScatterBegin(vectors_->to_local, vectors_->local, to, ADD_VALUES, SCATTER_REVERSE));
  ok(VecScatterEnd(vectors_->to_local, vectors_->local, to, ADD_VALUES, SCATTER_REVERSE));
}

std::vector<Vec3> SharedBody::take(Vec from) {
  ok(VecScatterBegin(vectors_->to_local, from, vectors_->local, INSERT_VALUES, SCATTER_FORWARD));
  ok(VecScatterEnd(vectors_->to_local, from, vectors_->local, INSERT_VALUES, SCATTER_FORWARD));
  std::vector<Vec3> values(number_.size());
  const double* array = nullptr;
  ok(VecGetArrayRead(vectors_->local, &array));
  for (std::size_t e = 0; e < values.size(); ++e) values[e] = Eigen::Map<const Vec3>(array + 3 * e);
  ok(VecRestoreArrayRead(vectors_->local, &array));
  return values;
}

// All get the same bits.
void SharedBody::sum(std::span<double> values) {
  const std::vector<double> own(values.begin(), values.end());
  const int count = static_cast<int>(own.size());
  ok(MPI_Reduce(own.data(), values.data(), count, MPI_DOUBLE, MPI_SUM, 0, PETSC_COMM_WORLD));
  ok(MPI_Bcast(values.data(), count, MPI_DOUBLE, 0, PETSC_COMM_WORLD));
}

bool SharedBody::take_of_largest(double key, std::span<double> values) {
  std::vector<double> keys(static_cast<std::size_t>(ranks()));
  ok(MPI_Allgather(&key, 1, MPI_DOUBLE, keys.data(), 1, MPI_DOUBLE, PETSC_COMM_WORLD));
  const auto from = static_cast<int>(std::max_element(keys.begin(), keys.end()) - keys.begin());
  ok(MPI_Bcast(values.data(), static_cast<int>(values.size()), MPI_DOUBLE, from, PETSC_COMM_WORLD));
  return from == rank();
}

void SharedBody::sum_at_elements(std::vector<Vec3>& values) {
  give_sum(values, vectors_->global);
  values = take(vectors_->global);
}

void SharedBody::take_from_owners(std::span<double> values, std::size_t width) {
  std::vector<Vec3> some(number_.size(), Vec3::Zero());
  for (std::size_t first = 0; first < width; first += 3) {
    const std::size_t count = std::min<std::size_t>(3, width - first);
    for (std::size_t e = 0; e < some.size(); ++e)
      std::copy_n(&values[width * e + first], count, some[e].data());
    give(some, vectors_->global);
    some = take(vectors_->global);
    for (std::size_t e = 0; e < some.size(); ++e)
      std::copy_n(some[e].data(), count, &values[width * e + first]);
  }
}

// Each set takes the lowest number of its elements, and of the sets that other ranks have of them, until none changes.
std::uint32_t SharedBody::join_sets(std::vector<std::uint32_t>& set) {
  std::uint32_t count = 0;
  for (const std::uint32_t each : set)
    if (each != kNoSet) count = std::max(count, each + 1);
  std::vector<double> lowest(count, kNothing);
  for (std::size_t e = 0; e < set.size(); ++e)
    if (set[e] != kNoSet) lowest[set[e]] = std::min(lowest[set[e]], static_cast<double>(number_[e]));
  for (double changed = 1; changed > 0;) {
    double* array = nullptr;
    ok(VecGetArray(vectors_->local, &array));
    for (std::size_t e = 0; e < set.size(); ++e)
      Eigen::Map<Vec3>(array + 3 * e).setConstant(set[e] == kNoSet ? kNothing : lowest[set[e]]);
    ok(VecRestoreArray(vectors_->local, &array));
    ok(VecSet(vectors_->global, kNothing));
    ok(VecScatterBegin(vectors_->to_local, vectors_->local, vectors_->global, MIN_VALUES, SCATTER_REVERSE));
    ok(VecScatterEnd(vectors_->to_local, vectors_->local, vectors_->global, MIN_VALUES, SCATTER_REVERSE));
    const std::vector<Vec3> found = take(vectors_->global);
    changed = 0;
    for (std::size_t e = 0; e < set.size(); ++e)
      if (set[e] != kNoSet && found[e].x() < lowest[set[e]]) {
        lowest[set[e]] = found[e].x();
        ++changed;
      }
    sum(std::span(&changed, 1));
  }
  std::vector<double> roots;  // numbers of the elements that sets are called by
  for (std::size_t e = 0; e < set.size(); ++e)
    if (set[e] != kNoSet && owns_[e] && lowest[set[e]] == static_cast<double>(number_[e]))
      roots.push_back(lowest[set[e]]);
  int own = static_cast<int>(roots.size());
  std::vector<int> counts(static_cast<std::size_t>(ranks())), begins(counts.size(), 0);
  ok(MPI_Allgather(&own, 1, MPI_INT, counts.data(), 1, MPI_INT, PETSC_COMM_WORLD));
  for (std::size_t r = 1; r < counts.size(); ++r) begins[r] = begins[r - 1] + counts[r - 1];
  std::vector<double> all(static_cast<std::size_t>(begins.back() + counts.back()));
  ok(MPI_Allgatherv(roots.data(), own, MPI_DOUBLE, all.data(), counts.data(), begins.data(), MPI_DOUBLE,
                    PETSC_COMM_WORLD));
  std::sort(all.begin(), all.end());
  for (std::uint32_t& each : set)
    if (each != kNoSet)
      each = static_cast<std::uint32_t>(std::lower_bound(all.begin(), all.end(), lowest[each]) - all.begin());
  return static_cast<std::uint32_t>(all.size());
}

std::vector<Bytes> SharedBody::gather(Bytes own) {
  std::vector<Bytes> all;
  if (rank() != 0) {
    send(0, own);
    return all;
  }
  all.push_back(std::move(own));
  for (int from = 1; from < ranks(); ++from) all.push_back(receive(from));
  return all;
}

void SharedBody::let_first(const std::function<void()>& work) {
  const WithoutOtherPieces whole;
  let_first_(work);
}

Vec3 SharedBody::rest_of_corner(std::uint32_t cell, std::uint32_t corner) {
  const auto after = std::upper_bound(cells_before_.begin(), cells_before_.end(), cell);
  const auto from = static_cast<int>(after - cells_before_.begin()) - 1;
  Vec3 at = Vec3::Zero();
  if (from == rank()) {
    std::uint32_t left = cell - first_cell_;
    std::uint32_t c = 0;
    while (around_.ring[c] != 0 || left-- > 0) ++c;
    at = body().rest[body().cell_elements[c][corner]];
  }
  ok(MPI_Bcast(at.data(), 3, MPI_DOUBLE, from, PETSC_COMM_WORLD));
  return at;
}

}  // namespace flexel::distributed
