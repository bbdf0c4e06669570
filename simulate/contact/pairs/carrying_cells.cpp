// Points are told by the cells that carry them.
#include "simulate/contact/pairs/carrying_cells.h"

#include <algorithm>
#include <numeric>

#include "base/instruction_set.h"

namespace flexel::simulate {

static_assert(sizeof(ContactSide) == sizeof(double) * contact_kernels::kSideRow &&
              sizeof(PointState) == sizeof(double) * contact_kernels::kPointRow &&
              sizeof(PointMotion) == sizeof(double) * contact_kernels::kMotionRow);

const contact_kernels::ContactTable& contact_kernel_table() {
  using namespace contact_kernels;
#if defined(__x86_64__)
  static const ContactTable& best = best_table(&contacts_portable, &contacts_avx2, &contacts_avx512);
  return best;
#else
  return contacts_portable();
#endif
}

CarryingCells::CarryingCells(const ContactSurface& surface) : surface_(surface) {
  for (std::uint32_t p = 0; p < surface.body().parts.size(); ++p) {
    const std::array<Vec3, 8>& of = surface.gradients(p);
    slopes_.push_back({0.5 * (of[1] - of[0]), 0.5 * (of[2] - of[0]), 0.5 * (of[4] - of[0])});
    const auto& [x, y, z] = slopes_.back();
    steepness_.emplace_back(x.norm(), y.norm(), z.norm());
  }
}

void CarryingCells::reset(const PairList& list) {
  constexpr std::uint32_t kNone = 0xffffffff;
  const std::vector<std::uint32_t>& points = list.points();
  places_.resize(surface_.body().element_count());
  for (std::uint32_t n = 0; n < list.elements().size(); ++n) places_[list.elements()[n]] = n;
  cell_.assign(surface_.body().cell_count(), kNone);
  cells_.clear();
  points_.resize(points.size());
  states_.resize(points.size());
  motions_.resize(points.size());
  wanted_by_.resize(points.size(), 0);
  for (std::uint32_t n = 0; n < points.size(); ++n) {
    const ContactPoint& point = list.point(n);
    const std::optional<std::uint32_t> carrier = surface_.cell(points[n]);
    std::uint32_t own = carrier ? cell_[*carrier] : kNone;
    if (own == kNone) {
      own = static_cast<std::uint32_t>(cells_.size());
      CarryingCell& cell = cells_.emplace_back(CarryingCell{point.part, n, {}, point.at.count});
      for (std::size_t a = 0; a < point.at.count; ++a) cell.corners[a] = places_[point.at.elements[a]];
      if (carrier) cell_[*carrier] = own;
    }
    points_[n] = carried(point, surface_.broken(points[n]));
    points_[n].cell = own;
  }
}

void CarryingCells::want_none() {
  ++asked_;
  wanted_.clear();
}

void CarryingCells::place(const State& state, bool moving) {
  constexpr std::size_t kGrain = 256;
  if (points_.empty()) return;
  parallel_chunks(wanted_.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    auto* states = reinterpret_cast<double*>(states_.data());
    const std::uint32_t* which = wanted_.data() + begin;
    contact_kernel_table().place(points_.data(), which, end - begin, state.displacement.data()->data(),
                                 states);
    if (moving)
      contact_kernel_table().move(points_.data(), which, end - begin, state.velocity.data()->data(), states,
                                  reinterpret_cast<double*>(motions_.data()));
  });
}

CarriedPoint CarryingCells::carried(const ContactPoint& point, bool broken) const {
  CarriedPoint made{};
  for (std::size_t a = 0; a < 8; ++a) {
    const bool used = a < point.at.count;
    made.weights[a] = used ? point.at.weights[a] : 0;
    made.elements[a] = point.at.elements[used ? a : 0];
  }
  made.count = point.at.count;
  for (int axis = 0; axis < 3; ++axis) {
    made.rest[axis] = point.rest[axis];
    made.normal[axis] = point.normal[axis];
    for (int c = 0; c < 3 && point.at.count == 8; ++c)
      made.slopes[3 * axis + c] = slopes_[point.part][static_cast<std::size_t>(axis)][c];
  }
  made.own_plane = point.shape == ContactShape::face ? 1 : 0;
  made.radius = point.radius;
  made.ball = point.shape == ContactShape::ball ? 1 : 0;
  made.broken = broken ? 1 : 0;
  return made;
}

std::array<Vec3, 3> CarryingCells::differences(const CarryingCell& cell, const std::vector<Vec3>& values) {
  const auto at = [&](std::size_t a) -> const Vec3& { return values[cell.corners[a]]; };
  const Vec3 up01 = at(1) - at(0), up23 = at(3) - at(2), up45 = at(5) - at(4), up67 = at(7) - at(6);
  const Vec3 sum01 = at(0) + at(1), sum23 = at(2) + at(3), sum45 = at(4) + at(5), sum67 = at(6) + at(7);
  return {(up01 + up23) + (up45 + up67), (sum23 - sum01) + (sum67 - sum45),
          (sum45 + sum67) - (sum01 + sum23)};
}

// The axes are square to one another.
double CarryingCells::gradient_norm(const CarryingCell& cell, const std::vector<Vec3>& values) const {
  const std::array<Vec3, 3> along = differences(cell, values);
  const Vec3& steepness = steepness_[cell.part];
  return std::sqrt(steepness.x() * steepness.x() * along[0].squaredNorm() +
                   steepness.y() * steepness.y() * along[1].squaredNorm() +
                   steepness.z() * steepness.z() * along[2].squaredNorm());
}

}  // namespace flexel::simulate
