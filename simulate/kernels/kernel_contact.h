// Contact points and pairs of them, eight side by side, as plain data: simulate/contact/pairs/pair_states.h keeps the
// rows, simulate/kernels/kernel_contact.cpp is the loops, compiled once per instruction set as kernel_table.cpp is.
// Whatever is near another lies anywhere in memory, so points and pairs are rows of whole cache lines, of which eight
// are turned into columns in registers. What each kernel computes is said, and computed one by one, beside the
// structures that the rows are: PointState, PairConstants, PairState (the bits are the same).
#pragma once
#include <cstddef>
#include <cstdint>

namespace flexel::simulate::contact_kernels {

constexpr std::size_t kLanes = 8;

// A contact point and the elements that carry it; what does not change.
struct alignas(64) CarriedPoint {
  double weights[kLanes];  // of the elements, 0 behind the last one
  double rest[3], normal[3];
  double own_plane, radius;  // of ContactSide, where the cell gives a normal
  double slopes[9];          // 1/m, of the weights along each axis of its cell (CarryingCells::slopes), or 0
  double ball, broken;       // 1 or 0: ContactShape::ball; the cell is
  std::uint32_t cell;        // in CarryingCells::cells()
  std::uint32_t count;       // of elements
  std::uint32_t elements[kLanes];  // of the body; behind the last one the first again
};

// Doubles of the rows, and places in them.
constexpr std::size_t kPointRow = 24;  // PointState
constexpr std::size_t kSideRow = 8;    // ContactSide: position, normal, own_plane, radius
constexpr std::size_t kInverse = 8, kShapeless = 17, kNormalRate = 18;
constexpr std::size_t kConstantsRow = 8;  // PairConstants
constexpr std::size_t kStateRow = 32;     // PairState

// Two points, or a point and a plane.
struct PairSides {
  std::uint32_t i, j;  // rows of points; of planes where `of_plane`
  std::uint32_t of_plane;
};

// Pairs for a kernel: `which` [count] numbers of pairs, and by these numbers `sides` and the rows of their constants,
// `stride` bytes apart.
struct PairView {
  const std::uint32_t* which;
  std::size_t count;
  const PairSides* sides;
  const char* constants;
  std::size_t stride;
  const double* points;  // rows
  const double* planes;  // rows of kSideRow
};

// The state of points `which` [count], to their rows of `states`.
using PlacePoints = void (*)(const CarriedPoint* points, const std::uint32_t* which, std::size_t count,
                             const double* displacement, double* states);
// PairStates::PairProximity of PairView::which, but for what is watched: m and turns that it can bear, and whether
// it is near; `pressed` [m]: the gap at which it begins to press (count).
using LookAtPairs = void (*)(const PairView& pairs, const double* pressed, double* path, double* turn,
                             std::uint8_t* near);
// pair_state() of PairView::which, to their rows of `states`; `allowed`, `soft` [m] (count).
using EvaluatePairs = void (*)(const PairView& pairs, const double* allowed, const double* soft,
                               double* states);

struct ContactTable {
  PlacePoints place;
  LookAtPairs look;
  EvaluatePairs evaluate;
};

[[nodiscard]] const ContactTable& contacts_portable();
[[nodiscard]] const ContactTable& contacts_avx2();
[[nodiscard]] const ContactTable& contacts_avx512();

}  // namespace flexel::simulate::contact_kernels
