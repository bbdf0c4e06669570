// The kernels of contact against the same one by one: the bits of every instruction set that this machine runs are
// those of pair_state() and ContactSurface::at().
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "base/instruction_set.h"
#include "simulate/contact/contact_friction.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;
using contact_kernels::ContactTable;

std::vector<const ContactTable*> kernel_tables() {
  std::vector<const ContactTable*> tables{&contact_kernels::contacts_portable()};
#if defined(__x86_64__)
  if (runs(InstructionSet::avx2)) tables.push_back(&contact_kernels::contacts_avx2());
  if (runs(InstructionSet::avx512)) tables.push_back(&contact_kernels::contacts_avx512());
#endif
  return tables;
}

template <class Row>
const double* rows(const std::vector<Row>& values) {
  return reinterpret_cast<const double*>(values.data());
}
template <class Row>
double* rows(std::vector<Row>& values) {
  return reinterpret_cast<double*>(values.data());
}

void expect_same(const PairState& expected, const PairState& found) {
  ASSERT_EQ(expected.near, found.near);
  if (!expected.near) return;
  ASSERT_EQ(expected.deep, found.deep);
  ASSERT_EQ(expected.gap, found.gap);
  if (expected.deep) return;
  for (const auto& [a, b] : {std::pair(expected.force, found.force),
                             {expected.turning[0], found.turning[0]},
                             {expected.turning[1], found.turning[1]},
                             {expected.normal, found.normal},
                             {expected.offset, found.offset}})
    ASSERT_EQ(a, b);
  for (double PairState::*value : {&PairState::weight, &PairState::energy, &PairState::pressure,
                                   &PairState::stiffness, &PairState::share, &PairState::along,
                                   &PairState::length, &PairState::narrowing, &PairState::facing_slope})
    ASSERT_EQ(expected.*value, found.*value);
}

// Faces, edges and balls at random distances and angles, and planes; soft and hard; thirteen pairs, which is no
// multiple of the lanes.
TEST(ContactKernels, PairsAreThoseOfPairState) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> one(-1, 1);
  const auto vector = [&] { return Vec3(one(random), one(random), one(random)); };
  constexpr std::size_t kPoints = 10, kPairs = 13;
  std::size_t pressing = 0, deep = 0, apart = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<PointState> points(kPoints);
    std::vector<ContactSide> planes{{0.1 * vector(), vector().normalized(), 1, 0}};
    for (std::size_t n = 0; n < kPoints; ++n) {
      const bool ball = n % 4 == 3;
      points[n].side = {
          0.4 * vector() + Vec3(0, 0, n % 2 ? 0.2 : -0.2),
          ball ? Vec3(Vec3::Zero()) : Vec3((Vec3(0, 0, n % 2 ? -1 : 1) + 0.5 * vector()).normalized()),
          ball || n % 4 == 2 ? 0.0 : 1.0, ball ? 0.3 : 0.0};
    }
    std::vector<contact_kernels::PairSides> sides;
    std::vector<ContactPair> pairs;
    std::vector<PairRecord> records;
    std::vector<double> allowed;
    std::vector<std::uint32_t> which;
    for (std::uint32_t p = 0; p < kPairs; ++p) {
      const bool plane = p % 5 == 4;
      sides.push_back({p % 10, plane ? 0 : (p * 3 + 1) % 10, plane ? 1u : 0u});
      pairs.push_back({{{2 + one(random), plane ? 0 : 0.7, 0.3, 0.8, 0.3, {0.01, 0.25, 0}}}});
      allowed.push_back(p % 3 ? 0 : 0.02);
      pairs.back().rest_overlap = allowed.back();
      records.emplace_back().soft = p % 2 ? 0 : 0.03 + 0.02 * one(random);
      which.push_back(p);
    }
    for (const ContactTable* table : kernel_tables()) {
      std::vector<PairState> found(kPairs);
      std::vector<std::uint8_t> marks(kPairs);
      std::vector<double> lost(kPairs);
      contact_kernels::PairStep step;
      step.records = rows(records);
      step.marks = marks.data();
      step.lost = lost.data();
      table->evaluate({which.data(), kPairs, sides.data(), rows(pairs), rows(points), rows(planes)},
                      trial % 2 ? allowed.data() : nullptr, step, rows(found));
      for (std::size_t p = 0; p < kPairs; ++p) {
        ContactSide i = points[sides[p].i].side, j;
        if (sides[p].of_plane) {
          const ContactSide& plane = planes[sides[p].j];
          j = plane;
          j.position = i.position - (i.position - plane.position).dot(plane.normal) * plane.normal;
          i.own_plane = 0;
        } else {
          j = points[sides[p].j].side;
        }
        const PairState expected =
            pair_state(i, j, pairs[p].properties.constants, allowed[p], records[p].soft);
        expect_same(expected, found[p]);
        ASSERT_EQ((marks[p] & contact_kernels::kPresses) != 0,
                  expected.near && !expected.deep && expected.pressure > 0);
        if (HasFatalFailure()) return;
        pressing += expected.pressure > 0;
        deep += expected.deep;
        apart += !expected.near;
      }
    }
  }
  EXPECT_GT(pressing, 500u);
  EXPECT_GT(deep, 100u);
  EXPECT_GT(apart, 500u);
}

void expect_near(const PointState& expected, const PointState& found) {
  EXPECT_LT((expected.side.position - found.side.position).norm(), 1e-13 * kSide);
  EXPECT_LT((expected.side.normal - found.side.normal).norm(), 1e-11);
  EXPECT_LT((expected.inverse - found.inverse).norm(), 1e-11 * expected.inverse.norm());
  EXPECT_EQ(expected.side.own_plane, found.side.own_plane);
  EXPECT_EQ(expected.side.radius, found.side.radius);
  EXPECT_EQ(expected.shapeless, found.shapeless);
  if (std::isfinite(expected.normal_rate))
    EXPECT_NEAR(expected.normal_rate, found.normal_rate, 1e-11 * expected.normal_rate);
  else
    EXPECT_EQ(expected.normal_rate, found.normal_rate);
}

void expect_same(const PointState& expected, const PointState& found) {
  EXPECT_EQ(expected.side.position, found.side.position);
  EXPECT_EQ(expected.side.normal, found.side.normal);
  EXPECT_EQ(expected.inverse, found.inverse);
  EXPECT_EQ(expected.normal_rate, found.normal_rate);
}

// Blocks that are turned, and squeezed and folded at random; of the contact points some are on edges.
TEST(ContactKernels, PointsAreThoseOfTheSurface) {
  Body body = block("a", {2, 1, 2}, Vec3::Zero(), turn(0.4, Vec3(1, 2, 3)));
  append(body, block("b", {1, 2, 1}, kSide * Vec3(0, 0, 2.1)));
  const Problem problem = problem_of(body);
  const ContactSettings settings = all_parts(body);
  const ContactSurface surface(problem, settings.parts);
  PairList list(settings, problem, surface);
  State state = starting_at_rest(body);
  (void)list.update(state, false);
  CarryingCells cells(surface);
  cells.reset(list);
  std::vector<std::uint32_t> which(list.points().size());
  for (std::uint32_t n = 0; n < which.size(); ++n) which[n] = n;
  ASSERT_GT(which.size(), 8u);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> one(-1, 1);
  std::size_t shapeless = 0;
  for (int trial = 0; trial < 60; ++trial) {
    for (Vec3& u : state.displacement)
      u = (trial % 10 + 1) * 0.15 * kSide * Vec3(one(random), one(random), one(random));
    std::vector<PointState> first;
    for (const ContactTable* table : kernel_tables()) {
      std::vector<PointState> found(which.size());
      table->place(cells.points().data(), which.data(), which.size(), state.displacement.data()->data(),
                   rows(found));
      if (first.empty()) first = found;
      for (const std::uint32_t n : which) {
        const PointState expected = surface.at(list.points()[n], state);
        expect_near(expected, found[n]);
        expect_same(first[n], found[n]);
        shapeless += expected.shapeless;
      }
    }
  }
  EXPECT_GT(shapeless, 20u);
}

template <class Row>
void expect_same_bytes(const std::vector<Row>& expected, const std::vector<Row>& found) {
  ASSERT_EQ(expected.size(), found.size());
  EXPECT_EQ(std::memcmp(expected.data(), found.data(), sizeof(Row) * found.size()), 0);
}

// What all kernels make of two blocks that are pressed into each other and slide.
struct KernelResults {
  std::vector<double> path, turn, lost, forces;
  std::vector<std::uint8_t> near, marks;
  std::vector<PairState> states;
  std::vector<PointMotion> motions;
  std::vector<PairRecord> records;
  std::vector<PairRubbing> rubbing;
};

KernelResults results_of(const ContactTable& table, const PairList& list, const CarryingCells& cells,
                         const State& state) {
  const std::size_t count = list.pairs().size();
  std::vector<std::uint32_t> points(list.points().size()), pairs(count);
  for (std::uint32_t n = 0; n < points.size(); ++n) points[n] = n;
  std::vector<contact_kernels::PairSides> sides;
  std::vector<double> zero(count, 0);
  for (std::uint32_t p = 0; p < count; ++p) {
    pairs[p] = p;
    sides.push_back({list.pairs()[p].i, list.pairs()[p].j, 0});
  }
  KernelResults made{std::vector<double>(count),       std::vector<double>(count),
                     std::vector<double>(count),       std::vector<double>(3 * state.displacement.size(), 0),
                     std::vector<std::uint8_t>(count), std::vector<std::uint8_t>(count),
                     std::vector<PairState>(count),    std::vector<PointMotion>(points.size()),
                     std::vector<PairRecord>(count),   std::vector<PairRubbing>(count)};
  std::vector<PointState> at(points.size());
  std::vector<PointLoad> loads(points.size());
  table.place(cells.points().data(), points.data(), points.size(), state.displacement.data()->data(),
              rows(at));
  const contact_kernels::PairView view{pairs.data(),       count,    sides.data(),
                                       rows(list.pairs()), rows(at), nullptr};
  table.look(view, zero.data(), made.path.data(), made.turn.data(), made.near.data());
  table.move(cells.points().data(), points.data(), points.size(), state.velocity.data()->data(), rows(at),
             rows(made.motions));
  for (PairRecord& record : made.records) record.soft = 0.02 * kSide;
  table.evaluate(view, zero.data(),
                 {rows(made.records), 1e-4, 1e-3, rows(made.motions), rows(made.rubbing), made.lost.data(),
                  made.marks.data()},
                 rows(made.states));
  table.collect(view, rows(made.states), rows(made.rubbing), rows(loads));
  table.spread(cells.points().data(), rows(at), points.data(), points.size(), rows(loads),
               made.forces.data());
  return made;
}

// What collect() makes of rows one by one, as contact_loads.h has it.
TEST(ContactKernels, LoadsAreThoseOfPairsOneByOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> one(-1, 1);
  const auto vector = [&] { return Vec3(one(random), one(random), one(random)); };
  constexpr std::uint32_t kPoints = 5, kPairs = 17;
  std::vector<contact_kernels::PairSides> sides;
  std::vector<PairState> states(kPairs);
  std::vector<PairRubbing> rubbing(kPairs);
  std::vector<std::uint32_t> which;
  std::vector<PointLoad> along(kPoints), across(kPoints);
  for (std::uint32_t p = 0; p < kPairs; ++p) {
    const bool plane = p % 5 == 4;
    sides.push_back({p % kPoints, plane ? 0 : (p * 3 + 1) % kPoints, plane ? 1u : 0u});
    states[p].force = vector();
    states[p].turning = {vector(), vector()};
    rubbing[p] = {vector(), vector(), 0.5 * static_cast<double>(p % 3)};
    which.push_back(p);
    const auto& [force, way, share] = rubbing[p];
    along[sides[p].i].force -= states[p].force;
    along[sides[p].i].turning += states[p].turning[0];
    across[sides[p].i].force -= force;
    across[sides[p].i].couple -= force * (share * way).transpose();
    if (plane) continue;
    along[sides[p].j].force += states[p].force;
    along[sides[p].j].turning += states[p].turning[1];
    across[sides[p].j].force += force;
    across[sides[p].j].couple += force * ((share - 1) * way).transpose();
  }
  for (const ContactTable* table : kernel_tables()) {
    std::vector<PointLoad> found_along(kPoints), found_across(kPoints);
    const contact_kernels::PairView view{which.data(), kPairs, sides.data(), nullptr, nullptr, nullptr};
    table->collect(view, rows(states), nullptr, rows(found_along));
    table->collect(view, nullptr, rows(rubbing), rows(found_across));
    for (std::uint32_t n = 0; n < kPoints; ++n)
      for (const auto& [expected, found] :
           {std::pair(along[n], found_along[n]), std::pair(across[n], found_across[n])}) {
        EXPECT_EQ(expected.force, found.force);
        EXPECT_EQ(expected.turning, found.turning);
        EXPECT_EQ(expected.couple, found.couple);
      }
  }
}

TEST(ContactKernels, EveryInstructionSetGivesTheSameBits) {
  Body body = block("a", {3, 2, 2});
  append(body, block("b", {2, 2, 2}, kSide * Vec3(0.3, 0.2, 1.98), turn(0.02, Vec3(1, 2, 0))));
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.self = false;
  settings.friction = 0.3;
  const ContactSurface surface(problem, settings.parts);
  PairList list(settings, problem, surface);
  State state = starting_at_rest(body);
  (void)list.update(state, false);
  CarryingCells cells(surface);
  cells.reset(list);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> one(-1, 1);
  for (Vec3& u : state.displacement) u = 0.02 * kSide * Vec3(one(random), one(random), one(random));
  for (Vec3& v : state.velocity) v = Vec3(one(random), one(random), one(random));
  const KernelResults first = results_of(*kernel_tables().front(), list, cells, state);
  std::size_t sliding = 0;
  for (const PairRecord& record : first.records) sliding += record.slip != Vec3::Zero();
  EXPECT_GT(sliding, 10u);
  for (const ContactTable* table : kernel_tables()) {
    const KernelResults found = results_of(*table, list, cells, state);
    expect_same_bytes(first.path, found.path);
    expect_same_bytes(first.turn, found.turn);
    expect_same_bytes(first.forces, found.forces);
    expect_same_bytes(first.near, found.near);
    expect_same_bytes(first.marks, found.marks);
    expect_same_bytes(first.lost, found.lost);
    expect_same_bytes(first.motions, found.motions);
    expect_same_bytes(first.rubbing, found.rubbing);
    for (std::size_t p = 0; p < found.states.size(); ++p) {
      expect_same(first.states[p], found.states[p]);
      EXPECT_EQ(first.records[p].slip, found.records[p].slip);
      EXPECT_EQ(first.records[p].soft, found.records[p].soft);
    }
  }
}

// Friction by the kernel against that of pairs looked at one by one, as those that can stick are: they stick by
// nothing here.
TEST(ContactKernels, FrictionIsThatOfPairsOneByOne) {
  Body body = block("a", {3, 2, 2});
  append(body, block("b", {2, 2, 2}, kSide * Vec3(0.3, 0.2, 2.02), turn(0.02, Vec3(1, 2, 0))));
  const Problem problem = problem_of(body);
  ContactSettings plain = all_parts(body);
  plain.friction = 0.3;
  plain.planes.push_back(plane_at(0.02 * kSide));
  ContactSettings sticking = plain;
  sticking.stick.assign(2, 1e-12);
  Contacts kernel(plain, problem), one_by_one(sticking, problem);
  State state = starting_at_rest(body);
  constexpr double kStep = 1e-3;
  double largest = 0;
  for (int step = 0; step < 40; ++step) {
    for (std::uint32_t e = 0; e < body.element_count(); ++e) {
      const bool upper = e >= body.parts[1].element_begin;
      state.velocity[e] = (upper ? 1 : 0) * kSide * Vec3(2 + step % 7, step % 5 - 1.5, step < 10 ? -8 : 0.2) +
                          0.1 * kSide * Vec3(body.rest[e].y(), -body.rest[e].x(), 0) / kSide;
      state.displacement[e] += kStep * state.velocity[e];
    }
    state.time = (step + 1) * kStep;
    std::vector<Vec3> expected(body.element_count(), Vec3::Zero()), found = expected;
    for (const auto& [contacts, forces] : {std::pair(&kernel, &found), std::pair(&one_by_one, &expected)}) {
      contacts->finish_step(state, kStep);
      contacts->finish_losses(state, kStep);
      contacts->add_dissipative_forces(state, *forces);
    }
    double whole = 0, wrong = 0;
    for (std::size_t e = 0; e < found.size(); ++e) {
      whole = std::max(whole, expected[e].norm());
      wrong = std::max(wrong, (found[e] - expected[e]).norm());
    }
    ASSERT_LE(wrong, 1e-6 * whole) << step;
    largest = std::max(largest, whole);
  }
  EXPECT_GT(largest, 1e-3);
}

}  // namespace
}  // namespace flexel::simulate
