// Contact over long times and across events: a block that rests, memory that an event does not take, blocks
// that lie flush, balls of model `paper`.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "simulate/effects/contact.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "simulate/input/scene_selection.h"
#include "tests/sanitized.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

// A block on a slope of 0.3 rad with mu = 0.4, above tan 0.3 = 0.31; its way down is the probe's.
struct Slope {
  Scene scene;
  Body body;
  Vec3 down;
};

Slope slope(double time, double turned, std::array<int, 3> cells = {3, 3, 2}) {
  const Mat3 tilt = turn(0.3, Vec3::UnitY());
  Slope made{scene_of(time), block("block", cells, Vec3::Zero(), tilt * turn(turned, Vec3::UnitZ())),
             tilt.col(0)};
  made.scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  made.scene.get<Contact>().friction = 0.4;
  ContactPlane plane;
  plane.normal = tilt.col(2);
  made.scene.get<Contact>().planes.push_back(plane);
  Probe probe;
  probe.name = "middle";
  probe.at = made.body.rest[made.body.element_count() / 2];
  made.scene.probes.push_back(probe);
  return made;
}

std::vector<double> way_down(const TimedCase& made, const Vec3& down) {
  const std::vector<double>&x = made.history.column("middle x"), &z = made.history.column("middle z");
  std::vector<double> way;
  for (std::size_t row = 0; row < x.size(); ++row) way.push_back(x[row] * down.x() + z[row] * down.z());
  return way;
}

TEST(ContactFriction, ABlockRestsForTenSeconds) {
  for (const double turned :
       less_if_sanitized<std::vector<double>>({0.0, 0.4, 0.9}, {0.4}, "one orientation of three")) {
    Slope made = slope(10, turned, {2, 2, 1});
    made.scene.get<RigidParts>().parts = {"block"};
    made.scene.get<Contact>().stiffness = 0.005;  // of 3 E/h: longer steps
    made.scene.get<Contact>().damping = 3e-3;
    const TimedCase run = testing::run_timed(made.body, made.scene);
    const std::vector<double> way = way_down(run, made.down);
    EXPECT_LT(std::abs(way.back()), 0.02 * kSide) << turned;
    // after a second it does not drift
    EXPECT_LT(std::abs(way.back() - way[way.size() / 10]), 1e-9 * kSide) << turned;
    expect_books_close(run.result);
  }
}

// The springs that hold it are stretched; an event that forgot them would let it slip on.
TEST(ContactFriction, WhatHoldsOutlivesAnEvent) {
  const auto rest = [](const std::string& event) {
    Slope made = slope(0.1, 0.4);
    made.scene.get<Damping>().entries.push_back({5e-4, std::nullopt, ""});
    made.scene.get<Contact>().damping = 5e-4;
    made.scene.events = parse_scene(event + "[run]\ntime = \"0.1 s\"\n", "test").events;
    return way_down(testing::run_timed(made.body, made.scene), made.down);
  };
  const std::vector<double> plain = rest("");
  const std::vector<double> edited = rest("[[event]]\nat = \"60 ms\"\ndo = \"edit\"\nstiffness = 1.000001\n");
  ASSERT_GT(plain.back(), 1e-5 * kSide);
  EXPECT_NEAR(edited.back(), plain.back(), 1e-3 * plain.back());
}

// Matter does not rub against itself: neither pairs nor forces of friction in a part that is pressed flat and
// turns (the paper's elements would, where "paper" is asked for).
TEST(ContactFriction, NoneInsideAPartThatIsCompressedAndRotated) {
  const Body body = block("a", {4, 4, 3}, Vec3::Zero(), turn(0.3, Vec3::UnitX()));
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.friction = 0.5;
  settings.damping = 1e-4;
  Contacts contacts(settings, problem);
  State state = starting_at_rest(body);
  for (const double angle : {0.0, 0.7, 2.5}) {
    const Mat3 shape = turn(angle, Vec3(1, 2, 3)) * Vec3(0.5, 1.3, 0.6).asDiagonal();
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      state.displacement[e] = shape * body.rest[e] - body.rest[e];
      state.velocity[e] = Vec3(3, -2, 5).cross(shape * body.rest[e]) - 0.5 * body.rest[e];
    }
    contacts.finish_losses(state, 1e-3);
    std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
    contacts.add_forces(state, forces);
    contacts.add_dissipative_forces(state, forces);
    for (const Vec3& force : forces) EXPECT_EQ(force, Vec3::Zero());
    EXPECT_TRUE(contacts.touching(state).empty());
  }
}

// A block whose surface is cut along its cells, so that blocks side by side share vertices.
Body cut_block(const std::string& name, std::array<int, 3> cells, const Vec3& origin) {
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> polygons;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 1}) {
      const auto u = static_cast<std::size_t>((axis + 1) % 3), v = static_cast<std::size_t>((axis + 2) % 3);
      for (int a = 0; a < cells[u]; ++a)
        for (int b = 0; b < cells[v]; ++b) {
          std::vector<std::uint32_t> quad;
          for (const auto& [du, dv] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
            std::array<int, 3> corner{};
            corner[static_cast<std::size_t>(axis)] = side * cells[static_cast<std::size_t>(axis)];
            corner[u] = a + du;
            corner[v] = b + dv;
            const auto [entry, fresh] =
                numbers.try_emplace(corner, static_cast<std::uint32_t>(vertices.size()));
            if (fresh) vertices.push_back(origin + kSide * Vec3(corner[0], corner[1], corner[2]));
            quad.push_back(entry->second);
          }
          if (side == 0) std::reverse(quad.begin(), quad.end());
          polygons.push_back(quad);
        }
    }
  return within_block(block(name, cells, origin), vertices, polygons);
}

TEST(Contact, BlocksThatLieFlushFeelNothing) {
  Body body = cut_block("a", {3, 3, 2}, Vec3::Zero());
  append(body, cut_block("b", {3, 3, 2}, Vec3(3 * kSide, 0, 0)));
  append(body, cut_block("c", {3, 3, 4}, Vec3(0, 3 * kSide, 0)));
  const Problem problem = problem_of(body);
  Contacts contacts(all_parts(body), problem);
  EXPECT_LT(contacts.energy(starting_at_rest(body)), 1e-20);
}

// A prism of `sides` sides about the z-axis, within `body`; hollow where `inner` [m] is above 0.
Body prism(Body body, std::uint32_t sides, double radius, double inner, double low, double high) {
  std::vector<Vec3> vertices;
  for (const double r : inner > 0 ? std::vector{radius, inner} : std::vector{radius})
    for (const double z : {low, high})
      for (std::uint32_t n = 0; n < sides; ++n) {
        const double angle = 2 * std::numbers::pi * n / sides;
        vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
      }
  std::vector<std::vector<std::uint32_t>> polygons;
  std::vector<std::uint32_t> below, above;
  for (std::uint32_t n = 0; n < sides; ++n) {
    const std::uint32_t next = (n + 1) % sides, up = sides, in = 2 * sides;
    polygons.push_back({n, next, next + up, n + up});
    above.push_back(n + up);
    below.insert(below.begin(), n);
    if (!(inner > 0)) continue;
    polygons.push_back({n + in, n + in + up, next + in + up, next + in});
    polygons.push_back({n + up, next + up, next + in + up, n + in + up});
    polygons.push_back({n, n + in, next + in, next});
  }
  if (!(inner > 0)) polygons.insert(polygons.end(), {below, above});
  return within_block(std::move(body), vertices, polygons);
}

// Facets of one reach into the other, and the rims of the hole lie behind the planes of the pin's patches beside them.
TEST(Contact, APinThatFillsAHoleFeelsNothingUntilItIsPushed) {
  for (const double radius : {1.6 * kSide, 2.7 * kSide}) {
    Body body = prism(block("plate", {12, 12, 4}, Vec3(-6 * kSide, -6 * kSide, -0.5 * kSide)), 18, 5 * kSide,
                      radius, 0, 3 * kSide);
    append(body, prism(block("pin", {8, 8, 8}, Vec3(-4 * kSide, -4 * kSide, -2.5 * kSide)), 16, radius, 0,
                       -1.2 * kSide, 4.1 * kSide));
    const Problem problem = problem_of(body);
    Contacts contacts(all_parts(body), problem);
    State state = starting_at_rest(body);
    const auto force_on_pin = [&](const Vec3& shift) {
      for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
        state.displacement[e] = shift;
      std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
      contacts.add_forces(state, forces);
      Vec3 sum = Vec3::Zero();
      for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
        sum += forces[e];
      return sum;
    };
    constexpr double kPush = 0.05 * kSide;
    const double at_rest = force_on_pin(Vec3::Zero()).norm(), stored = contacts.energy(state);
    const double pushed = -force_on_pin(Vec3(kPush, 0, 0)).x();
    // penalty 3 E / h over the half of the wall that it is pushed against, with the square of the cosine
    const double expected = 3 * kGum.young / kSide * kPush * 0.5 * std::numbers::pi * radius * 3 * kSide;
    EXPECT_GT(pushed, 0.5 * expected) << radius;
    EXPECT_LT(pushed, 1.5 * expected) << radius;
    EXPECT_LT(at_rest, 1e-6 * pushed) << radius;
    EXPECT_LT(stored, 1e-6 * pushed * kPush) << radius;
  }
}

// N, on each element, when what overlaps at rest has been let out in `release` [s] (0: at once) and a part is moved by
// `displacement` [m] of each of its elements.
std::vector<Vec3> forces_let_out(const Body& body, double release, std::size_t part,
                                 const std::function<Vec3(std::uint32_t)>& displacement) {
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.release_time = release;
  Contacts contacts(settings, problem);
  State state = starting_at_rest(body);
  std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
  contacts.add_forces(state, forces);
  state.time = release;
  for (std::uint32_t e = body.parts[part].element_begin; e < body.parts[part].element_end; ++e)
    state.displacement[e] = displacement(e);
  std::fill(forces.begin(), forces.end(), Vec3::Zero());
  contacts.add_forces(state, forces);
  return forces;
}

// Facets do not press, the interference does: as a pin that just fits and swells by as much, let out or at once.
TEST(Contact, APressFitPressesByItsInterference) {
  constexpr double kRelease = 0.01;  // s
  // N, around the pin, which is wider by `interference` [m] at rest and swells by `swelling` [m].
  const auto pressed = [](double radius, double interference, double swelling, double release) {
    Body body = prism(block("plate", {12, 12, 4}, Vec3(-6 * kSide, -6 * kSide, -0.5 * kSide)), 40, 5 * kSide,
                      radius, 0, 3 * kSide);
    append(body, prism(block("pin", {8, 8, 8}, Vec3(-4 * kSide, -4 * kSide, -2.5 * kSide)), 40,
                       radius + interference, 0, -1.2 * kSide, 4.1 * kSide));
    const auto across = [&](std::uint32_t e) { return Vec3(body.rest[e].x(), body.rest[e].y(), 0); };
    const std::vector<Vec3> forces = forces_let_out(
        body, release, 1, [&](std::uint32_t e) -> Vec3 { return swelling / radius * across(e); });
    double sum = 0;
    for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
      sum -= forces[e].dot(across(e).normalized());
    return sum;
  };
  for (const double radius :
       less_if_sanitized<std::vector<double>>({1.6 * kSide, 2.7 * kSide}, {1.6 * kSide}, "one radius of two"))
    for (const double interference : {0.02 * kSide, 0.04 * kSide}) {
      const double swollen = pressed(radius, 0, interference, 0);
      EXPECT_GT(swollen, 0);
      for (const double release : {0.0, kRelease}) {
        EXPECT_NEAR(pressed(radius, interference, 0, release) / swollen, 1, 0.15)
            << radius << " " << interference << " " << release;
        EXPECT_LT(std::abs(pressed(radius, 0, 0, release)), 0.01 * swollen) << radius << " " << release;
      }
    }
}

std::vector<UnsureFit> unsure_of(const Body& body) {
  const Problem problem = problem_of(body);
  ContactSettings settings = all_parts(body);
  settings.release_time = 0.01;
  return Contacts(std::move(settings), problem).unsure_fits();
}

// A pin of `sides[1]` sides in the hole of a plate of `sides[0]`.
struct PinInHole {
  double radius, offset, interference;  // spacings
  std::array<std::uint32_t, 2> sides;

  static inline const Vec3 kWay = Vec3(std::cos(0.3), std::sin(0.3), 0);

  // With the offset and the interference, or in the middle and of the hole's size.
  [[nodiscard]] Body body(bool begins) const {
    const Mat3 aslant = turn(0.07, Vec3::UnitZ());  // facets of both do not lie on each other
    Body made = prism(block("plate", {12, 12, 4}, Vec3(-6 * kSide, -6 * kSide, -0.5 * kSide)), sides[0],
                      5 * kSide, radius * kSide, 0, 3 * kSide);
    const Vec3 to = begins ? Vec3(offset * kSide * kWay) : Vec3(Vec3::Zero());
    Body pin = prism(block("pin", {8, 8, 8}, to + Vec3(-4 * kSide, -4 * kSide, -2.5 * kSide)), sides[1],
                     (begins ? radius + interference : radius) * kSide, 0, -1.2 * kSide, 4.1 * kSide);
    for (Vec3& vertex : pin.surface.vertices) vertex = aslant * vertex + to;
    append(made, pin);
    return made;
  }

  // N, against the offset, let out in `release` [s]; `begins`: as body(), or moved and swollen there.
  [[nodiscard]] double pressed(bool begins, double release) const {
    const Body made = body(begins);
    const std::vector<Vec3> forces = forces_let_out(made, release, 1, [&](std::uint32_t e) -> Vec3 {
      if (begins) return Vec3::Zero();
      return kSide * offset * kWay + interference / radius * Vec3(made.rest[e].x(), made.rest[e].y(), 0);
    });
    double sum = 0;
    for (std::uint32_t e = made.parts[1].element_begin; e < made.parts[1].element_end; ++e)
      sum -= forces[e].dot(kWay);
    return sum;
  }

  [[nodiscard]] std::vector<UnsureFit> unsure() const { return unsure_of(body(true)); }
};

// A pin that is not in the middle of its hole presses as one that is pushed there, however few cells its radius has: the
// facets do not hide the offset, with an interference or without.
TEST(Contact, APinOffTheMiddleOfItsHolePressesAsOneThatIsPushedThere) {
  using At = std::array<double, 3>;
  for (const At& at : less_if_sanitized<std::vector<At>>({{1.3, 0.05, 0.0},
                                                          {1.6, 0.02, 0.0},
                                                          {1.6, 0.05, 0.0},
                                                          {1.6, 0.2, 0.0},
                                                          {1.6, 0.03, 0.03},
                                                          {2.7, 0.03, 0.0},
                                                          {2.7, 0.2, 0.0}},
                                                         {{1.6, 0.03, 0.03}}, "one pin of seven"))
    for (const std::array<std::uint32_t, 2>& sides : {std::array{40u, 40u}, {18u, 16u}}) {
      const PinInHole pin{at[0], at[1], at[2], sides};
      const double pushed = pin.pressed(false, 0);
      EXPECT_GT(pushed, 0);
      EXPECT_NEAR(pin.pressed(true, 0.01) / pushed, 1, pin.offset < 0.03 ? 0.2 : 0.1)
          << pin.radius << " " << pin.offset << " " << pin.interference << " " << sides[0];
    }
}

// A wrong force is told, whatever makes it: a small offset, coarse facets.
TEST(Contact, AFitIsToldWhereFacetsHideIt) {
  if (sanitized()) GTEST_SKIP() << "AFitIsNotToldWhereItIsSure goes the same ways through memory";
  std::size_t wrong = 0;
  for (const double radius : {1.3, 2.7})
    for (const std::array<std::uint32_t, 2>& sides :
         {std::array{40u, 40u}, {18u, 16u}, {10u, 8u}, {12u, 10u}})
      for (const double offset : {0.005, 0.02, 0.05}) {
        const PinInHole pin{radius, offset, 0, sides};
        const double share = pin.pressed(true, 0.01) / pin.pressed(false, 0);
        if (std::abs(share - 1) < 0.3) continue;
        ++wrong;
        EXPECT_EQ(pin.unsure().size(), 1) << radius << " " << offset << " " << sides[0] << ": " << share;
      }
  EXPECT_GT(wrong, 3);
}

TEST(Contact, AFitIsNotToldWhereItIsSure) {
  for (const PinInHole& pin : {PinInHole{1.6, 0, 0, {40, 40}},  // in the middle, and just fits
                               {1.6, 0.03, 0, {40, 40}},
                               {2.7, 0.05, 0, {40, 40}},
                               {1.6, 0, 0.03, {40, 40}},
                               {2.7, 0.2, 0, {18, 16}},
                               {2.7, 0, -0.06, {18, 16}}})  // a clearance
    EXPECT_TRUE(pin.unsure().empty()) << pin.radius << " " << pin.offset << " " << pin.interference;
}

// It touches the plate along a line.
TEST(Contact, ARollerOnAPlateIsNoFit) {
  for (const double radius : {1.6, 2.5, 4.0})
    for (const std::uint32_t sides : {16u, 40u}) {
      Body body = cut_block("plate", {10, 3, 8}, kSide * Vec3(-5, -3 - radius, -1));
      append(body, prism(block("roller", {10, 10, 6}, kSide * Vec3(-5, -5, 0)), sides, radius * kSide, 0,
                         0.5 * kSide, 5.5 * kSide));
      EXPECT_TRUE(unsure_of(body).empty()) << radius << " " << sides;
    }
}

TEST(Contact, AFitIsToldInWhateverOrderThePartsAre) {
  const auto plate = [](const std::string& name, double low) {
    return prism(block(name, {12, 12, 4}, kSide * Vec3(-6, -6, low - 0.5)), 40, 5 * kSide, 1.6 * kSide,
                 low * kSide, (low + 3) * kSide);
  };
  Body pin = prism(block("pin", {8, 8, 10}, kSide * Vec3(-4, -4, -2)), 40, 1.6 * kSide, 0, -1.2 * kSide,
                   7.2 * kSide);
  for (Vec3& vertex : pin.surface.vertices)
    vertex = turn(0.07, Vec3::UnitZ()) * vertex + 0.012 * kSide * PinInHole::kWay;
  Body last = plate("below", 0), first = pin;
  append(last, plate("above", 3));
  append(last, pin);
  append(first, plate("below", 0));
  append(first, plate("above", 3));
  EXPECT_EQ(unsure_of(last).size(), 2);
  EXPECT_EQ(unsure_of(first).size(), 2);
}

TEST(Contact, AFitIsToldWithItsSize) {
  const std::vector<UnsureFit> told = PinInHole{1.6, 0.012, 0, {40, 40}}.unsure();
  ASSERT_EQ(told.size(), 1);
  EXPECT_EQ(told[0].parts, (std::array{0u, 1u}));
  EXPECT_NEAR(told[0].misfit / (std::sqrt(0.5) * 0.012 * kSide), 1, 0.2);  // the mean square of a cosine
  EXPECT_NEAR(told[0].width, kSide, 1e-12);
}

// The tip of a screw presses a pin as one that comes from apart, beside a plate whose hole the pin fills: that fit is not its.
TEST(Contact, WhatOverlapsAPinBesideItsHolePresses) {
  constexpr double kRelease = 0.01;  // s
  // N, on the screw, which begins `depth` [m] in the pin and moves on by `way` [m].
  const auto pressed = [](double radius, double width, double depth, double way, double release) {
    Body body = prism(block("plate", {12, 12, 4}, Vec3(-6 * kSide, -6 * kSide, -0.5 * kSide)), 40, 5 * kSide,
                      radius, 0, 3 * kSide);
    append(body, prism(block("pin", {8, 8, 8}, Vec3(-4 * kSide, -4 * kSide, -2.5 * kSide)), 40, radius, 0,
                       -1.2 * kSide, 4.1 * kSide));
    const double tip = radius - depth, low = 3.05 * kSide;
    std::vector<Vec3> vertices;
    for (const double z : {low, low + width})
      for (const auto& [x, y] : {std::pair{0.0, -0.5}, {3.0, -0.5}, {3.0, 0.5}, {0.0, 0.5}})
        vertices.emplace_back(tip + x * kSide, y * width, z);
    append(body, within_block(
                     block("screw", {5, 4, 4}, Vec3(tip - 0.5 * kSide, -2 * kSide, 2.5 * kSide)), vertices,
                     {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}));
    const Part& screw = body.parts[2];
    const std::vector<Vec3> forces =
        forces_let_out(body, release, 2, [&](std::uint32_t) { return Vec3(-way, 0, 0); });
    double sum = 0;
    for (std::uint32_t e = screw.element_begin; e < screw.element_end; ++e) sum += forces[e].x();
    return sum;
  };
  for (const double radius : less_if_sanitized<std::vector<double>>({1.6 * kSide, 2.7 * kSide}, {2.7 * kSide},
                                                                    "one radius of two")) {
    // a patch of the tip has two of a narrow pin before it, and what they scatter by counts as facets
    const double share = radius < 2 * kSide ? 0.2 : 0.1;
    for (const double width : {0.6 * kSide, kSide})
      for (const double depth : {0.1 * kSide, 0.6 * kSide})
        EXPECT_NEAR(pressed(radius, width, depth, 0, kRelease) / pressed(radius, width, 0, depth, 0), 1,
                    share)
            << radius << " " << width << " " << depth;
  }
}

// Its edge and its faces press, as those of one that comes from apart, but for pairs that come near when they are deep.
TEST(Contact, ATiltedBoxThatBeginsInAFlatFacePresses) {
  struct Begins {
    double angle, depth;  // degrees, spacings
  };
  for (const auto& [angle, depth] : {Begins{3, 0.045}, Begins{10, 0.1}, Begins{20, 0.1}, Begins{40, 0.1}}) {
    const double tilt = angle * std::numbers::pi / 180;
    const auto force_on_box = [&](double above) {  // m, of its lowest edge at rest
      Body body = block("base", {8, 8, 3}, Vec3(-4 * kSide, -4 * kSide, -3 * kSide));
      append(body,
             block("box", {4, 4, 3}, Vec3(-2.3 * kSide, -2.2 * kSide, 4 * kSide * std::sin(tilt) + above),
                   turn(tilt, Vec3::UnitY())));
      const Problem problem = problem_of(body);
      Contacts contacts(all_parts(body), problem);
      State state = starting_at_rest(body);
      std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
      const auto put = [&](double way) {
        for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
          state.displacement[e] = Vec3(0, 0, way);
        std::fill(forces.begin(), forces.end(), Vec3::Zero());
        contacts.add_forces(state, forces);
        contacts.finish_step(state, 0);
      };
      for (int step = 0; above > 0 && step < 4; ++step) put(-0.25 * step * above);
      put(-depth * kSide - above);
      Vec3 sum = Vec3::Zero();
      for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
        sum += forces[e];
      return sum;
    };
    const Vec3 begins = force_on_box(-depth * kSide), comes = force_on_box(0.4 * kSide);
    EXPECT_GT(comes.z(), 1) << angle;  // N
    EXPECT_LT((begins - comes).norm(), 0.02 * comes.norm()) << angle;
  }
}

// The sides of a block that is pressed and slides out look at each other while they are far inside: the way
// out gives no more than the pressing took.
TEST(Contact, ABlockThatSlidesOutFromUnderAnotherIsNotThrown) {
  Body body = block("low", {4, 2, 2}, Vec3::Zero());
  append(body, block("high", {4, 2, 1}, Vec3(0, 0, 1.97 * kSide)));
  const Problem problem = problem_of(body);
  Contacts contacts(all_parts(body), problem);
  State state = starting_at_rest(body);
  const double pressed = contacts.energy(state);
  ASSERT_GT(pressed, 0);
  double before = pressed, work = 0, force_before = 0;
  for (double way = 0; way < 5.5 * kSide; way += 0.01 * kSide) {
    for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
      state.displacement[e] = Vec3(way, 0.1 * way, 0);
    const double energy = contacts.energy(state);
    std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
    contacts.add_forces(state, forces);
    double force = 0;
    for (std::uint32_t e = body.parts[1].element_begin; e < body.parts[1].element_end; ++e)
      force += forces[e].x() + 0.1 * forces[e].y();
    if (way > 0) work += 0.5 * (force + force_before) * 0.01 * kSide;
    force_before = force;
    EXPECT_LT(energy, 1.2 * pressed) << way;
    EXPECT_NEAR(energy + work, pressed, 0.02 * pressed) << way;
    before = energy;
  }
  EXPECT_EQ(before, 0);
}

Body balls(const std::string& name, std::array<int, 3> voxels, const Vec3& origin, double turned = 0) {
  CentreOptions options;
  options.name = name;
  options.voxels = voxels;
  options.spacing = kSide;
  options.origin = origin;
  options.axes = turn(turned, Vec3(0.1, 0.2, 1));
  return centre_body(options);
}

// Two balls push along the line of their centres, with the mean of what their materials give.
TEST(ContactOfPaper, BallsPushAlongTheirCentresWithTheMeanStiffness) {
  Body body = balls("a", {1, 1, 1}, Vec3::Zero());
  append(body, balls("b", {1, 1, 1}, Vec3(0.006, 0.007, 0)));
  State state = starting_at_rest(body);
  const auto force = [&](double young_a, double young_b) {
    Problem problem = problem_of(body);
    problem.materials[0].young = young_a;
    problem.materials[1].young = young_b;
    Contacts contacts(all_parts(body), problem);
    std::vector<Vec3> forces(2, Vec3::Zero());
    contacts.add_forces(state, forces);
    EXPECT_LT((forces[0] + forces[1]).norm(), 1e-12 * forces[0].norm());
    const Vec3 line = (body.rest[1] - body.rest[0]).normalized();
    EXPECT_LT(forces[1].cross(line).norm(), 1e-12 * forces[1].norm());
    return forces[1].dot(line);
  };
  const double soft = force(1e6, 1e6), hard = force(3e6, 3e6);
  EXPECT_GT(soft, 0);
  EXPECT_NEAR(force(1e6, 3e6), 0.5 * (soft + hard), 1e-9 * hard);
}

TEST(ContactOfPaper, ACollisionKeepsMomentaAndBooks) {
  Body body = balls("a", {4, 3, 3}, Vec3::Zero());
  append(body, balls("b", {3, 3, 3}, Vec3(0.003, 0.002, 0.034), 0.2));
  Scene scene = scene_of(0.02);
  throw_part(scene, "b", Vec3(0.3, -0.1, -1), Vec3(5, 2, 3));
  const TimedCase made = testing::run_timed(body, scene);
  expect_momenta_kept(made.history, 1e-9);
  expect_books_close(made.result);
  double met = 0;
  for (const double stored : made.history.column("contact stored")) met = std::max(met, stored);
  EXPECT_GT(met, 0.05 * book(made.result, "largest_term"));
}

}  // namespace
}  // namespace flexel::simulate
