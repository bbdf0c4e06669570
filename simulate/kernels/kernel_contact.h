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
constexpr std::size_t kRecordRow = 8;     // PairRecord
constexpr std::size_t kMotionRow = 16;    // PointMotion
constexpr std::size_t kRubbingRow = 8;    // PairRubbing
constexpr std::size_t kLoadRow = 16;      // PointLoad

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
// Of PairView::which: m and turns (BodyMotion) that it can bear before it presses, and 0 where it is not near for
// certain, beyond the kernel or turned away; `pressed` [m]: the gap at which it begins to press (count).
using LookAtPairs = void (*)(const PairView& pairs, const double* pressed, double* path, double* turn,
                             std::uint8_t* near);
// pair_state() of PairView::which, to their rows of `states`; `allowed`, `soft` [m] (count).
using EvaluatePairs = void (*)(const PairView& pairs, const double* allowed, const double* soft,
                               double* states);

// PointMotion of points `which` [count], from their rows of `states`, to their rows of `motions`.
using MovePoints = void (*)(const CarriedPoint* points, const std::uint32_t* which, std::size_t count,
                            const double* velocity, const double* states, double* motions);

// Of ContactFriction: tau [s]; `drift` [s] of the step that is finished, where the slips in `records` are to be brought
// up to date by it, or negative.
struct Rubbing {
  double damping, drift;
  const double *states, *motions;
  double* records;
};
// Friction and damping of pairs that do not stick, one after another to `rubbing` (PairView::count rows); `friction`: mu
// (count).
using RubPairs = void (*)(const PairView& pairs, const Rubbing& with, const double* friction,
                          double* rubbing);

// Adds `loads` (count rows) of points `which` [count] to `forces` (elements x 3) [N].
using SpreadLoads = void (*)(const CarriedPoint* points, const double* states, const std::uint32_t* which,
                             std::size_t count, const double* loads, double* forces);

struct ContactTable {
  PlacePoints place;
  LookAtPairs look;
  EvaluatePairs evaluate;
  MovePoints move;
  RubPairs rub;
  SpreadLoads spread;
};

[[nodiscard]] const ContactTable& contacts_portable();
[[nodiscard]] const ContactTable& contacts_avx2();
[[nodiscard]] const ContactTable& contacts_avx512();

}  // namespace flexel::simulate::contact_kernels
