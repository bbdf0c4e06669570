// Contact over long times and across events: a block that rests, memory that an event does not take, blocks
// that lie flush or inside each other, balls of model `paper`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "formats/body_file.h"
#include "formats/error.h"
#include "simulate/scene_selection.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/contact_case.h"

namespace flexel {
namespace {

using namespace flexel::testing;
using ::testing::HasSubstr;

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
  for (const double turned : {0.0, 0.4, 0.9}) {
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
  const Setting setting = setting_of(body);
  ContactSettings settings = all_parts(body);
  settings.friction = 0.5;
  settings.damping = 1e-4;
  Contacts contacts(settings, setting);
  State state = starting_at_rest(body);
  for (const double angle : {0.0, 0.7, 2.5}) {
    const Mat3 shape = turn(angle, Vec3(1, 2, 3)) * Vec3(0.5, 1.3, 0.6).asDiagonal();
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      state.displacement[e] = shape * body.rest[e] - body.rest[e];
      state.velocity[e] = Vec3(3, -2, 5).cross(shape * body.rest[e]) - 0.5 * body.rest[e];
    }
    contacts.remember(state, 1e-3);
    std::vector<Vec3> forces(body.element_count(), Vec3::Zero());
    contacts.add_forces(state, forces);
    contacts.add_losses(state, forces);
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
  const Setting setting = setting_of(body);
  Contacts contacts(all_parts(body), setting);
  EXPECT_LT(contacts.energy(starting_at_rest(body)), 1e-20);
}

// The sides of a block that is pressed and slides out look at each other while they are far inside: the way
// out gives no more than the pressing took.
TEST(Contact, ABlockThatSlidesOutFromUnderAnotherIsNotThrown) {
  Body body = block("low", {4, 2, 2}, Vec3::Zero());
  append(body, block("high", {4, 2, 1}, Vec3(0, 0, 1.97 * kSide)));
  const Setting setting = setting_of(body);
  Contacts contacts(all_parts(body), setting);
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

TEST(Contact, PartsThatBeginInsideEachOtherAreRefused) {
  const auto refusal = [](const Vec3& origin, double floor) {
    Body body = block("a", {3, 3, 3}, Vec3::Zero());
    append(body, block("b", {3, 3, 3}, origin));
    Scene scene = scene_of(1e-4);
    scene.get<Contact>().planes.emplace_back();
    scene.get<Contact>().planes[0].name = "floor";
    scene.get<Contact>().planes[0].point = Vec3(0, 0, floor);
    try {
      (void)testing::run_timed(std::move(body), scene);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal(Vec3(0, 0, 3 * kSide), 0), "");
  EXPECT_EQ(refusal(Vec3(3 * kSide, 0.004, 0), 0), "");
  EXPECT_THAT(refusal(Vec3(0, 0, 2.9 * kSide), 0), HasSubstr("parts \"a\" and \"b\" overlap by 1 mm"));
  EXPECT_THAT(refusal(Vec3(0.003, 0.002, 1.5 * kSide), 0), HasSubstr("overlap"));
  EXPECT_THAT(refusal(Vec3(0, 0, 3 * kSide), 0.2 * kSide), HasSubstr("inside floor"));
}

TEST(Contact, PartsThatBeginInsideEachOtherAreLetOutGently) {
  Body body = block("a", {2, 2, 2}, Vec3::Zero());
  append(body, block("b", {2, 2, 2}, Vec3(0.002, 0, 1.6 * kSide)));
  Scene scene = scene_of(0.012);
  scene.get<Contact>().parting = 0.008;
  const TimedCase made = testing::run_timed(std::move(body), scene);
  double low = -1, high = 1, fastest = 0;
  const Column& velocity = made.body.element_columns.at("velocity");
  for (std::uint32_t e = 0; e < made.body.element_count(); ++e) {
    const double z = made.body.position[e].z();
    if (e < made.body.parts[0].element_end)
      low = std::max(low, z);
    else
      high = std::min(high, z);
    fastest = std::max(fastest, std::abs(velocity.values[3 * e + 2]));
  }
  EXPECT_GT(high - low, 0);
  EXPECT_LT(fastest, 0.05 * std::sqrt(kGum.young / kGum.density));
  // all of their energy is the work of the letting out, and has been booked as such
  const double work = made.history.column("overlap work").back();
  EXPECT_GT(work, 0);
  EXPECT_NEAR(made.history.column("kinetic").back() + made.history.column("elastic").back(), work,
              0.01 * work);
  expect_books_close(made.result);
  EXPECT_LT(book(made.result, "worst_contact_error"), 0.01 * work);
  for (const char* axis : {"momentum x", "momentum y", "momentum z"})
    EXPECT_LT(std::abs(made.history.column(axis).back()), 1e-12) << axis;
}

TEST(Contact, APartThatBeginsInsideAPlaneIsLetOutGently) {
  Scene scene = scene_of(0.02);
  scene.get<Contact>().planes.push_back(plane_at(0.4 * kSide));
  scene.get<Contact>().parting = 0.01;
  const TimedCase made = testing::run_timed(block("a", {2, 2, 2}), scene);
  double low = 1;
  for (const Vec3& at : made.body.position) low = std::min(low, at.z());
  EXPECT_GT(low, 0.4 * kSide);
  EXPECT_LT(low, 1.5 * kSide);  // not thrown
  expect_books_close(made.result);
}

// A ball of 5 cells' radius on its own lattice, the cells at its surface part of a voxel.
Body solid_ball(const std::string& name, const Vec3& centre) {
  constexpr int kRadius = 5;
  BoxOptions options;
  options.name = name;
  options.cells = {2 * kRadius, 2 * kRadius, 2 * kRadius};
  options.spacing = Vec3::Constant(kSide);
  options.origin = centre - Vec3::Constant(kRadius * kSide);
  options.fill = [](int i, int j, int k) {
    double nearest = 1e9, farthest = 0;  // cells, of its corners
    for (int n = 0; n < 8; ++n) {
      const Vec3 at = Vec3(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2)) - Vec3::Constant(kRadius);
      nearest = std::min(nearest, at.norm());
      farthest = std::max(farthest, at.norm());
    }
    return nearest >= kRadius ? 0 : farthest > kRadius ? 0.5 : 1;
  };
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> polygons;
  constexpr std::uint32_t kRings = 24, kAround = 36;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring)
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const double theta = std::numbers::pi * ring / kRings, phi = 2 * std::numbers::pi * a / kAround;
      vertices.push_back(centre + kRadius * kSide *
                                      Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                           std::cos(theta)));
      if (ring == kRings) continue;
      const std::uint32_t i = ring * kAround + a, j = ring * kAround + (a + 1) % kAround;
      polygons.push_back({i, i + kAround, j + kAround});
      polygons.push_back({i, j + kAround, j});
    }
  return within_block(box_body(options), vertices, polygons);
}

// Why a run that lets out, or does not, refuses; "": it does not.
std::string refusal_of_overlap(const Body& below, const Body& above, double parting) {
  Body body = below;
  append(body, above);
  Scene scene = scene_of(1e-6);
  scene.get<Contact>().parting = parting;
  try {
    (void)testing::run_timed(std::move(body), scene);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double millimetres_in(const std::string& refusal) {
  const std::size_t at = refusal.find("overlap by ");
  return at == std::string::npos ? 0 : std::stod(refusal.substr(at + 11));
}

// However shallow they are at the rim.
TEST(Contact, OverlapsDeeperThanContactFeelsAreRefusedEvenIfTheyAreToPart) {
  const Body low = block("a", {3, 3, 3}, Vec3::Zero()), ball = solid_ball("a", Vec3::Zero());
  const Body slab = block("a", {9, 6, 4}, Vec3(-0.05, -0.01, -4 * kSide));
  const auto turned = [](double
                             depth) {  // an edge along y goes in deepest, `depth` cells under the slab's top
    const Mat3 tilt = turn(0.2, Vec3::UnitY());
    return block("b", {6, 4, 4}, Vec3(0.5 * kSide, 0, -depth * kSide) - tilt * Vec3(6 * kSide, 0, 0), tilt);
  };
  for (const double parting : {0.0, 0.01}) {
    const auto depth = [&](const Body& below, const Body& above) {
      return millimetres_in(refusal_of_overlap(below, above, parting));
    };
    EXPECT_NEAR(depth(low, block("b", {3, 3, 3}, Vec3(0, 0, 1.5 * kSide))), 15, 1e-6);
    EXPECT_NEAR(depth(ball, solid_ball("b", Vec3(0, 0, 7 * kSide))), 30, 1.5);
    EXPECT_NEAR(depth(slab, turned(2.5)), 25, 2.5);
  }
  // what is within reach everywhere is let out
  const double parting = 0.01;
  EXPECT_EQ(refusal_of_overlap(ball, solid_ball("b", Vec3(0, 0, 9.2 * kSide)), parting), "");
  EXPECT_EQ(refusal_of_overlap(slab, turned(0.8), parting), "");
  EXPECT_EQ(refusal_of_overlap(low, block("b", {1, 1, 3}, Vec3(kSide, kSide, 2.2 * kSide)), parting), "");
  EXPECT_EQ(refusal_of_overlap(low, block("b", {3, 3, 3}, Vec3(0, 2.5 * kSide, 2.5 * kSide)), parting), "");
  // the sides of what ends in a cut cell, which is not looked into, come out with that end
  BoxOptions options{{3, 3, 3}, Vec3::Constant(kSide)};
  options.name = "a";
  options.fill = [](int, int, int k) { return k == 2 ? 0.9 : 1; };
  Body cut = box_body(options);
  for (Vec3& at : cut.surface.vertices) at.z() = std::min(at.z(), 2.9 * kSide);
  EXPECT_EQ(refusal_of_overlap(cut, block("b", {3, 3, 3}, Vec3(0, 0, 2.5 * kSide)), parting), "");
  EXPECT_NEAR(millimetres_in(refusal_of_overlap(cut, block("b", {3, 3, 3}, Vec3(0, 0, 2.5 * kSide)), 0)), 4,
              1e-6);
  // and is not told to ask for what it asked for
  const std::string told = refusal_of_overlap(low, block("b", {3, 3, 3}, Vec3(0, 0, kSide)), parting);
  EXPECT_THAT(told, HasSubstr("larger cells: \"overlap\" = \"part\" lets out up to 9 mm"));
}

// What comes near only while it slides goes on as deep as its neighbours are.
TEST(Contact, PartsThatSlideWhileTheyAreLetOutAreNotThrown) {
  const auto strained = [](double speed) {
    Body body = block("a", {6, 3, 2}, Vec3::Zero());
    append(body, block("b", {6, 3, 2}, Vec3(0, 0, 1.6 * kSide)));
    Scene scene = scene_of(0.024);
    scene.get<Contact>().parting = 0.02;
    throw_part(scene, "b", Vec3(speed, 0, 0));
    const TimedCase made = testing::run_timed(std::move(body), scene);
    double low = -1, high = 1;
    for (std::uint32_t e = 0; e < made.body.element_count(); ++e) {
      double& face = e < made.body.parts[0].element_end ? low : high;
      const double z = made.body.position[e].z();
      face = &face == &low ? std::max(low, z) : std::min(high, z);
    }
    EXPECT_GT(high - low, 0) << speed;
    expect_books_close(made.result);
    double most = 0;
    const std::vector<double>&elastic = made.history.column("elastic"),
          &stored = made.history.column("contact stored");
    for (std::size_t row = 0; row < elastic.size(); ++row) most = std::max(most, elastic[row] + stored[row]);
    return most;
  };
  const double still = strained(0);
  ASSERT_GT(still, 0);
  EXPECT_LT(strained(1.5), 2 * still);
}

// Two blocks that are held apart by less than they overlap.
Scene held_while_let_out(const std::string& events) {
  Scene scene = scene_of(0.03);
  scene.get<Contact>().parting = 0.02;
  scene.get<Damping>().entries.push_back({1e-4, std::nullopt, ""});
  scene.get<Ties>().ties.push_back(make_fix(select_by_name("a/z0")));
  scene.get<Ties>().ties.push_back(make_fix(select_by_name("b/z1")));
  scene.events = parse_scene(events + "[run]\ntime = \"30 ms\"\n", "test").events;
  return scene;
}

TEST(Contact, LettingOutGoesOnOverAnEvent) {
  const auto run = [](const std::string& events) {
    Body body = block("a", {2, 2, 2}, Vec3::Zero());
    append(body, block("b", {2, 2, 2}, Vec3(0, 0, 1.8 * kSide)));
    return testing::run_timed(std::move(body), held_while_let_out(events));
  };
  const TimedCase plain = run("");
  const TimedCase edited =
      run("[[event]]\nat = \"10 ms\"\ndo = \"edit\"\nwhere = \"b\"\ndensity = 1.000001\n");
  for (const char* column : {"overlap work", "contact stored", "elastic"}) {
    const double expected = plain.history.column(column).back();
    ASSERT_GT(expected, 0) << column;
    EXPECT_NEAR(edited.history.column(column).back(), expected, 1e-3 * expected) << column;
  }
}

TEST(Contact, APartThatJoinsInsideAnotherIsRefusedOrLetOut) {
  const std::string path = ::testing::TempDir() + "joins.vtu";
  const auto run = [&](double depth, double parting, std::optional<double> step = {}) {
    write_body(block("b", {2, 2, 2}, Vec3(0, 0, (2 - depth) * kSide)), path);
    Scene scene = scene_of(0.02);
    scene.run.step = step;
    scene.get<Contact>().parting = parting;
    throw_part(scene, "a", Vec3(0, 0, 0), Vec3(0, 0, 1));  // it has moved by then
    scene.events = parse_scene("[[event]]\nat = \"5 ms\"\ndo = \"add\"\nbody = \"" + path +
                                   "\"\n[run]\ntime = \"20 ms\"\n",
                               "test")
                       .events;
    for (Event& each : scene.events) (void)each.prepare();
    return testing::run_timed(block("a", {2, 2, 2}, Vec3::Zero()), scene);
  };
  const auto refusal = [&](double depth, double parting) {
    try {
      (void)run(depth, parting);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal(0.4, 0), HasSubstr("overlap by 4 mm at 0.005 s, when it joins"));
  EXPECT_THAT(refusal(1.5, 0.01), HasSubstr("overlap by 15 mm"));

  const TimedCase out = run(0.4, 0.01);
  const double spun = out.history.column("kinetic")[0];
  const double work = out.history.column("overlap work").back();
  ASSERT_GT(work, 0);
  EXPECT_NEAR(out.history.column("kinetic").back() + out.history.column("elastic").back(), spun + work,
              0.02 * (spun + work));
  EXPECT_LT(std::abs(book(out.result, "worst_contact_error")), 0.02 * work);
  expect_books_close(out.result);

  // what is too shallow to be refused presses at once: the event gave that
  const TimedCase pressed = run(0.04, 0, 1e-5);
  const double given = pressed.history.column("events work").back();
  ASSERT_GT(given, 0);
  EXPECT_NEAR(pressed.history.column("kinetic").back() + pressed.history.column("elastic").back(),
              spun + given, 0.1 * given);
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
    Setting setting = setting_of(body);
    setting.materials[0].young = young_a;
    setting.materials[1].young = young_b;
    Contacts contacts(all_parts(body), setting);
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
}  // namespace flexel
