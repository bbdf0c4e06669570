// Equilibrium of boxes: patch test, moves, free motions, crumbs, failure.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/gravity.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using ::testing::HasSubstr;
using testing::refusal;
using testing::simulate_quietly;

BoxOptions uneven_box() {
  BoxOptions options;
  options.cells = {5, 3, 4};
  options.spacing = Vec3(0.002, 0.0023, 0.0019);
  options.origin = Vec3(0.1, -0.2, 0.3);
  options.axes =
      (Eigen::AngleAxisd(0.4, Vec3::UnitZ()) * Eigen::AngleAxisd(-0.7, Vec3::UnitX())).toRotationMatrix();
  return options;
}

Scene steel_scene() {
  Scene scene;
  scene.material = "steel";
  return scene;
}

Selection face(const char* name) {
  return select_by_name(std::string("box/") + name);
}

// Patch test: pulled evenly on two opposite faces, free to narrow, a turned box of uneven spacing has the
// exact uniform strain.
TEST(Equilibrium, UniformStretchIsExact) {
  BoxOptions options = uneven_box();
  options.axes = Mat3::Identity();
  Body body = box_body(options);
  Scene scene = steel_scene();
  const double pressure = -2e6;
  for (const auto& [where, axis] : {std::pair{"x0", 0}, std::pair{"y0", 1}, std::pair{"z0", 2}}) {
    Tie tie = make_fix(face(where));
    tie.axes = {axis == 0, axis == 1, axis == 2};
    scene.get<Supports>().ties.push_back(tie);
  }
  scene.get<Loads>().loads.push_back(make_pressure(face("x1"), pressure));
  Probe probe;
  probe.where = face("x1");
  scene.probes.push_back(probe);
  probe.where = face("x0");
  scene.probes.push_back(probe);
  const SimulateResult result = simulate_quietly(body, scene);
  const double strain = (result.probes[0].displacement.x() - result.probes[1].displacement.x()) / 0.01;
  EXPECT_NEAR(strain / (2e6 / 210e9), 1, 1e-4);  // neo-Hookean at a strain of 1e-5
  // Every cell alike: displacement is affine, so the middle of each row lies between its neighbours. The
  // quadrature of the load is good to half a percent of one cell's share, and so is this.
  double off = 0;
  for (std::uint32_t e = 1; e + 1 < body.element_count(); ++e)
    if (body.lattice_index[e][0] > 0 && body.lattice_index[e][0] < 5)
      off = std::max(off, (body.position[e] - 0.5 * (body.position[e - 1] + body.position[e + 1])).norm());
  EXPECT_LT(off, 5e-3 * strain * 0.002);
}

// A box led at both ends by the same rotation turns as a whole: no stress is left.
TEST(Equilibrium, RigidRotationByMovesIsExact) {
  for (const bool by_surface : {true, false}) {
    Body body = box_body(uneven_box());
    Scene scene = steel_scene();
    Motion motion;
    motion.axis = Vec3(1, 1, 0).normalized();
    motion.through = Vec3(0.1, 0, 0.2);
    motion.angle = 0.6;
    motion.translation = Vec3(0.001, 0, 0.002);
    if (by_surface) {
      for (const char* where : {"x0", "x1"}) {
        Tie tie = make_move(face(where), Vec3::Zero());
        tie.motion = motion;
        scene.get<Supports>().ties.push_back(tie);
      }
    } else {
      Tie tie = make_move(select_by_name("box"), Vec3::Zero());
      tie.motion = motion;
      scene.get<Supports>().ties.push_back(tie);
    }
    const SimulateResult result = simulate_quietly(body, scene);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      EXPECT_LT((body.position[e] - body.rest[e] - motion.displacement(body.rest[e], 1)).norm(), 1e-11);
    EXPECT_LT(result.elastic_energy, 1e-12);
    EXPECT_NEAR(result.smallest_jacobian, 1, 1e-9);
  }
}

// Every piece of the straight way turns by its share of the angle: the end is where they lead to.
TEST(Equilibrium, AnArcIsTheWayBentEvenly) {
  Motion motion;
  motion.axis = Vec3(1, 2, -1).normalized();
  motion.through = Vec3(0.5, -0.3, 0.2);
  motion.arc_from = Vec3(0.1, 0.2, -0.1);
  for (const double angle : {5e-4, -0.8, 2.5, 7.0})
    for (const double share : {0.3, 1.0}) {
      motion.angle = angle;
      const auto turn = [&](double part) { return Eigen::AngleAxisd(part * share * angle, motion.axis); };
      constexpr int kPieces = 2000;  // Simpson's rule
      Vec3 end = *motion.arc_from;
      for (int i = 0; i < kPieces; ++i)
        for (const auto& [at, weight] : {std::pair{0.0, 1.0}, std::pair{0.5, 4.0}, std::pair{1.0, 1.0}})
          end += weight / 6 / kPieces * (turn((i + at) / kPieces) * (motion.through - *motion.arc_from));
      EXPECT_LT((motion.through + motion.displacement(motion.through, share) - end).norm(), 1e-11) << angle;
      const Vec3 arm(0.02, 0.07, -0.04), beside = motion.through + arm;
      EXPECT_LT((beside + motion.displacement(beside, share) - end - turn(1) * arm).norm(), 1e-11) << angle;
    }
}

std::string bent_end(const std::string& more) {
  return "[[move]]\nwhere = { half_space = { point = [\"59 mm\", 0, 0], normal = [1, 0, 0] } }\nrotation = { "
         "axis "
         "= [0, -1, 0], through = [\"60 mm\", \"5 mm\", \"5 mm\"], angle = \"0.8 rad\"" +
         more + " }\n";
}

TEST(Equilibrium, AMoveLeadsAnEndAlongItsArc) {
  Body body = box_body({.cells = {12, 2, 2}, .spacing = Vec3::Constant(0.005)});
  const std::string start = "material = \"rubber\"\n[[fix]]\nwhere = \"box/x0\"\n",
                    arc = bent_end(", arc_from = [0, \"5 mm\", \"5 mm\"]");
  (void)simulate_quietly(body, parse_scene(start + arc, "s.toml"));
  const double radius = 0.06 / 0.8;
  const Vec3 end(radius * std::sin(0.8), 0.005, 0.005 + radius * (1 - std::cos(0.8)));
  const Eigen::AngleAxisd turn(0.8, -Vec3::UnitY());
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] == 12) {
      EXPECT_LT((body.position[e] - end - turn * (body.rest[e] - Vec3(0.06, 0.005, 0.005))).norm(), 1e-14);
    }
  // about the same axis, but not to the same place
  const Body anew = box_body({.cells = {12, 2, 2}, .spacing = Vec3::Constant(0.005)});
  EXPECT_EQ(refusal(anew, parse_scene(start + arc + arc, "s.toml")), "accepted");
  EXPECT_THAT(refusal(anew, parse_scene(start + arc + bent_end(""), "s.toml")),
              HasSubstr("lead the same place"));
}

TEST(Equilibrium, GravityIsCarriedByTheFix) {
  Body body = box_body(uneven_box());
  Scene scene = steel_scene();
  scene.get<Supports>().ties.push_back(make_fix(face("z0")));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  const SimulateResult result = simulate_quietly(body, scene);
  const double mass = 7850 * 60 * 0.002 * 0.0023 * 0.0019;
  EXPECT_NEAR(result.mass, mass, 1e-12 * mass);
  EXPECT_NEAR(result.reactions[0].force.z() / (9.81 * mass), 1, 1e-7);
}

TEST(Equilibrium, LargeMoveOfSelectedElementsIsFollowedExactly) {
  Body body = box_body({.cells = {6, 4, 4}, .spacing = Vec3(0.01, 0.01, 0.01)});
  Scene scene;
  scene.material = "rubber";
  scene.get<Supports>().ties.push_back(make_fix(face("x0")));
  Selection end;
  end.kind = Selection::Kind::half_space;
  end.point = Vec3(0.0599, 0, 0);
  end.normal = Vec3::UnitX();
  scene.get<Supports>().ties.push_back(make_move(end, Vec3(0.03, 0.02, 0)));
  const SimulateResult result = simulate_quietly(body, scene);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] == 6) {
      EXPECT_LT((body.position[e] - body.rest[e] - Vec3(0.03, 0.02, 0)).norm(), 1e-15);
    }
  EXPECT_GT(result.smallest_jacobian, 0.2);
  EXPECT_LT(result.imbalance.norm(), 1e-6 * result.reactions[0].force.norm());
}

TEST(Equilibrium, FreeMotionsAreNamed) {
  Scene nothing = steel_scene();
  nothing.get<Loads>().loads.push_back(make_push(face("x1"), Vec3(1, 0, 0)));
  EXPECT_THAT(refusal(box_body(), nothing), HasSubstr("nothing holds part \"box\""));
  Scene sliding = nothing;
  Tie tie = make_fix(face("x0"));
  tie.axes = {true, false, false};
  sliding.get<Supports>().ties.push_back(tie);
  const std::string message = refusal(box_body(), sliding);
  EXPECT_THAT(message, HasSubstr("part \"box\" is free"));
  EXPECT_THAT(message, HasSubstr("translate along"));
  EXPECT_THAT(message, HasSubstr("rotate about x"));
}

TEST(Equilibrium, DustIsRefused) {
  Body dust = box_body();
  std::fill(dust.broken.begin(), dust.broken.end(), std::uint8_t{1});
  Scene scene = steel_scene();
  Selection low;
  low.kind = Selection::Kind::half_space;
  low.point = Vec3(1e-6, 0, 0);
  low.normal = -Vec3::UnitX();
  scene.get<Supports>().ties.push_back(make_fix(low));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  EXPECT_THAT(refusal(dust, scene), HasSubstr("every cell of the body is broken"));
}

TEST(Equilibrium, SecondBodyNeedsItsOwnFix) {
  Body body = box_body();
  BoxOptions other;
  other.origin = Vec3(10, 0, 0);
  append(body, box_body(other));
  check(body, "merged");
  EXPECT_EQ(body.parts[1].name, "box-2");
  Scene scene = steel_scene();
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("box/x0")));
  scene.get<Loads>().loads.push_back(make_push(select_by_name("box/x1"), Vec3(1, 0, 0)));
  EXPECT_THAT(refusal(body, scene), HasSubstr("part \"box-2\""));
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("box-2")));
  EXPECT_EQ(refusal(body, scene), "accepted");
}

// A crumb of one cell in 2,000 that hangs on nothing goes with its neighbourhood; a large piece is refused.
TEST(Equilibrium, CrumbsAreCarriedAndLargePiecesRefused) {
  BoxOptions options;
  options.cells = {24, 10, 10};
  options.spacing = Vec3::Constant(0.001);
  options.fill = [](int i, int j, int k) {
    return i == 21 || (i > 21 && (j != 4 || k != 4)) || i > 22 ? 0.0 : 1.0;
  };
  Body body = box_body(options);
  Scene scene = steel_scene();
  Selection start;
  start.kind = Selection::Kind::half_space;
  start.point = Vec3(0.0005, 0, 0);
  start.normal = -Vec3::UnitX();
  scene.get<Supports>().ties.push_back(make_fix(start));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_EQ(result.stray_cells, 1u);
  double crumb = 0, tip = 0;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const double sag = body.rest[e].z() - body.position[e].z();
    if (body.lattice_index[e][0] >= 22) crumb += sag / 8;
    if (body.lattice_index[e] == Index3{21, 5, 5}) tip = sag;
  }
  EXPECT_GT(crumb, tip);  // further out than the end of the beam it follows
  EXPECT_LT(crumb, 1.3 * tip);
  options.fill = [](int i, int, int) { return i == 15 ? 0.0 : 1.0; };
  EXPECT_THAT(refusal(box_body(options), scene), HasSubstr("is in 2 pieces"));
}

// Every element of a cell is led, and the end of the way is its mirror image.
TEST(Equilibrium, MirroredCellDiverges) {
  Body body = box_body({.cells = {1, 2, 2}});
  Scene scene;
  scene.material = "rubber";
  Selection end;
  end.kind = Selection::Kind::half_space;
  end.point = Vec3(0.5, 0, 0);
  end.normal = -Vec3::UnitX();
  scene.get<Supports>().ties.push_back(make_fix(end));
  end.normal = Vec3::UnitX();
  scene.get<Supports>().ties.push_back(make_move(end, Vec3(-2, 0, 0)));
  try {
    (void)simulate_quietly(body, scene);
    FAIL() << "a mirrored cell has no equilibrium";
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), HasSubstr("% of the load"));
    EXPECT_THAT(error.what(), HasSubstr("cell"));
  }
}

}  // namespace
}  // namespace flexel::simulate
