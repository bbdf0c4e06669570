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
constexpr std::size_t kConstantsRow = 8;  // PairConstants, with which a ContactPair begins
constexpr std::size_t kPairRow = 16;      // ContactPair
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

// Pairs for a kernel: `which` [count] numbers of pairs, and by these numbers `sides` and the rows of ContactPair.
struct PairView {
  const std::uint32_t* which;
  std::size_t count;
  const PairSides* sides;
  const double* pairs;   // rows
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
// What is remembered of pairs, by their numbers, and what they go through beside being evaluated: nothing without
// `motions`. A step of `drift` s, or none where that is negative, which leaves slips and softness as they are; friction and
// damping of those that do not stick, where there is `rubbing`.
struct PairStep {
  double* records = nullptr;        // rows
  double damping = 0, drift = -1;   // s
  const double* motions = nullptr;  // rows, by numbers of points
  double* rubbing = nullptr;        // rows
  double* lost = nullptr;           // (PairView::count) J, by hardening
  std::uint8_t* marks = nullptr;    // (PairView::count) sums of the following
};
constexpr std::uint8_t kPresses = 1, kStiffens = 2, kHardens = 4;
constexpr double kStiffening = 1.25;  // times as stiff as in the linear range, from which kStiffens

// pair_state() of PairView::which, to their rows of `states`; `allowed` [m] (count), or nothing: ContactPair::rest_overlap.
using EvaluatePairs = void (*)(const PairView& pairs, const double* allowed, const PairStep& step,
                               double* states);

// PointMotion of points `which` [count], from their rows of `states`, to their rows of `motions`.
using MovePoints = void (*)(const CarriedPoint* points, const std::uint32_t* which, std::size_t count,
                            const double* velocity, const double* states, double* motions);

// Adds up the loads of PairView::which, by their rows of `states` and of `rubbing`, either of which may be nothing, to the
// rows of their points, one pair after another.
using CollectLoads = void (*)(const PairView& pairs, const double* states, const double* rubbing,
                              double* loads);
// Adds `loads` (rows) of points `which` [count] to `forces` (elements x 3) [N].
using SpreadLoads = void (*)(const CarriedPoint* points, const double* states, const std::uint32_t* which,
                             std::size_t count, const double* loads, double* forces);

struct ContactTable {
  PlacePoints place;
  LookAtPairs look;
  EvaluatePairs evaluate;
  MovePoints move;
  CollectLoads collect;
  SpreadLoads spread;
};

[[nodiscard]] const ContactTable& contacts_portable();
[[nodiscard]] const ContactTable& contacts_avx2();
[[nodiscard]] const ContactTable& contacts_avx512();

}  // namespace flexel::simulate::contact_kernels
