// Centre placement in a scene: loads, ties, probes, bonds, crumbs, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/effects/gravity.h"
#include "simulate/matter/interface_points.h"
#include "simulate/matter/interpolation_weights.h"
#include "tests/simulate/scene_case.h"
#include "tests/simulate/study_beam.h"

namespace flexel::simulate {
namespace {

using testing::centre_body;
using testing::CentreOptions;
using testing::gum_scene;
using testing::half_space;
using ::testing::HasSubstr;
using testing::refusal;
using testing::simulate_quietly;

CentreOptions bar_of_voxels(std::array<int, 3> voxels = {8, 3, 3}) {
  CentreOptions options;
  options.voxels = voxels;
  options.spacing = 0.1;
  options.name = "bar";
  return options;
}

void fix(Scene& scene, const std::string& where) {
  scene.get<Supports>().ties.push_back(make_fix(select_by_name(where)));
}

TEST(Centre, NearestElementIsThatOfASearchOverAll) {
  CentreOptions options = bar_of_voxels({6, 5, 4});
  options.axes = Eigen::AngleAxisd(0.6, Vec3(1, 2, 2).normalized()).toRotationMatrix();
  options.origin = Vec3(1, -2, 3);
  options.inside = [](int i, int j, int k) { return (i * 7 + j * 5 + k * 3) % 4 != 0; };
  const Body body = centre_body(options);
  const Problem problem{body, {}, {}, {}, {}, {}};
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> uniform(-0.5, 1.5);
  NearestElement kept(problem, 0);  // which has looked in other voxels before
  const auto nearest_inward = [&](const Vec3& point, const Vec3& outward) {
    std::optional<std::uint32_t> best;
    std::pair<bool, double> least{true, 0.2};  // outward; two voxels
    for (std::uint32_t e = 0; e < body.element_count(); ++e) {
      const Vec3 way = body.rest[e] - point;
      const std::pair<bool, double> own{outward.dot(way) > 0, way.norm()};
      if (own.second > 0.2 || !(own < least)) continue;
      least = own;
      best = e;
    }
    return best;
  };
  int found = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 point =
        body.parts[0].lattice.to_world(Vec3(6 * uniform(engine), 5 * uniform(engine), 4 * uniform(engine)));
    double least = 1e300;
    std::uint32_t expected = 0;
    for (std::uint32_t e = 0; e < body.element_count(); ++e)
      if (const double distance = (body.rest[e] - point).norm(); distance < least) {
        least = distance;
        expected = e;
      }
    const auto nearest = nearest_element(problem, 0, point, Vec3::Zero());
    ASSERT_EQ(nearest.has_value(), least <= 0.2) << trial;
    EXPECT_EQ(kept(point, Vec3::Zero()), nearest) << trial;
    const Vec3 beside = point + 0.01 * Vec3(uniform(engine), uniform(engine), uniform(engine));
    for (const Vec3& outward : {Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(1, 1, 1)})
      EXPECT_EQ(kept(beside, outward), nearest_inward(beside, outward)) << trial;
    if (!nearest) continue;
    EXPECT_EQ(*nearest, expected);
    ++found;
  }
  EXPECT_GT(found, 500);
}

// Across a slit the element of the wrong leaf may be nearer; the normal tells which is meant.
TEST(Centre, SurfaceOfASlitKeepsToItsOwnLeaf) {
  CentreOptions options = bar_of_voxels({4, 4, 3});
  options.inside = [](int, int, int k) { return k != 1; };
  const Body body = centre_body(options);
  const Problem problem{body, {}, {}, {}, {}, {}};
  const Vec3 near_upper(0.15, 0.15, 0.16);
  const auto upper = nearest_element(problem, 0, near_upper, -Vec3::UnitZ());
  const auto lower = nearest_element(problem, 0, near_upper, Vec3::UnitZ());
  ASSERT_TRUE(upper && lower);
  EXPECT_EQ(body.lattice_index[*upper][2], 2);
  EXPECT_EQ(body.lattice_index[*lower][2], 0);
}

TEST(Centre, GradientCarriesAffineDisplacementsBeyondTheElements) {
  const Body body = centre_body(bar_of_voxels());
  const Problem problem{body, {}, {}, {}, {}, {}};
  Mat3 gradient;
  gradient << 0.1, -0.2, 0.3, 0.05, 0.2, -0.1, 0.4, 0, 0.1;
  for (const Vec3& point : {Vec3(0, 0, 0), Vec3(0.8, 0.15, 0.3), Vec3(0.41, 0.02, 0.17)}) {
    const auto element = nearest_element(problem, 0, point, Vec3::Zero());
    ASSERT_TRUE(element);
    const InterpolationWeights carrier = with_gradient(problem, {{*element}, {1}, 1}, point);
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    for (std::uint32_t a = 0; a < carrier.count; ++a) {
      sum += carrier.weights[a] * (gradient * body.rest[carrier.elements[a]]);
      weights += carrier.weights[a];
    }
    EXPECT_NEAR(weights, 1, 1e-13);
    EXPECT_LT((sum - gradient * point).norm(), 1e-13);
  }
}

TEST(Centre, LoadsAndGravityKeepTheirTotals) {
  Body body = centre_body(bar_of_voxels());
  Scene scene = gum_scene();
  fix(scene, "bar/x0");
  scene.get<Loads>().loads.push_back(make_push(select_by_name("bar/x1"), Vec3(1, 2, -3)));
  scene.get<Loads>().loads.push_back(make_pressure(select_by_name("bar/z1"), 10));
  scene.get<Loads>().loads.push_back(make_push(half_space(Vec3(0.7, 0, 0), Vec3::UnitX()), Vec3(0, 0.5, 0)));
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  const SimulateResult result = simulate_quietly(body, scene);
  const double weight = 0.8 * 0.3 * 0.3 * 1000 * 9.81;
  EXPECT_LT((result.loads[0].force - Vec3(0, 0, -weight)).norm(), 1e-10 * weight);
  EXPECT_LT((result.loads[1].force - Vec3(1, 2, -3)).norm(), 1e-13);
  EXPECT_LT((result.loads[2].force - Vec3(0, 0, -10 * 0.8 * 0.3)).norm(), 1e-13);
  EXPECT_LT((result.loads[3].force - Vec3(0, 0.5, 0)).norm(), 1e-13);
  EXPECT_LT(result.imbalance.norm(), 1e-6 * weight);
  EXPECT_NEAR(result.mass, 72, 1e-9);
}

TEST(Centre, TurnedAsAWholeItKeepsItsShape) {
  Body body = centre_body(bar_of_voxels());
  Scene scene = gum_scene();
  Tie turn = make_move(select_by_name("bar/x0"), Vec3(0.1, 0, 0));
  turn.motion.axis = Vec3::UnitZ();
  turn.motion.through = Vec3(0.2, 0.3, 0);
  turn.motion.angle = 0.7;
  const Motion motion = turn.motion;
  scene.get<Supports>().ties.push_back(turn);
  Probe corner;
  corner.at = Vec3(0.8, 0.3, 0.3);
  Probe end;
  end.where = select_by_name("bar/x1");
  scene.probes = {corner, end};
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_LT((result.probes[0].displacement - motion.displacement(*corner.at, 1)).norm(), 1e-6);
  EXPECT_LT((result.probes[1].displacement - motion.displacement(Vec3(0.8, 0.15, 0.15), 1)).norm(), 1e-6);
  EXPECT_NEAR(result.smallest_jacobian, 1, 1e-6);
}

TEST(Centre, ALooseVoxelIsCarriedAlong) {
  CentreOptions options = bar_of_voxels({16, 10, 10});
  options.inside = [](int i, int j, int k) { return i < 13 || (i == 15 && j == 5 && k == 5); };
  Body body = centre_body(options);
  Scene scene = gum_scene();
  fix(scene, "bar/x0");
  scene.get<Loads>().loads.push_back(make_push(half_space(Vec3(1.2, 0, 0), Vec3::UnitX()), Vec3(0, 0, -50)));
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_EQ(result.stray_cells, 1u);
  EXPECT_NEAR(result.mass, 1301, 1e-6);
  std::uint32_t loose = 0, nearest = 0, next = 0;
  for (std::uint32_t e = 0; e < body.element_count(); ++e) {
    if (body.lattice_index[e] == Index3{15, 5, 5}) loose = e;
    if (body.lattice_index[e] == Index3{12, 5, 5}) nearest = e;
    if (body.lattice_index[e] == Index3{11, 5, 5}) next = e;
  }
  const auto moved = [&](std::uint32_t e) -> Vec3 { return body.position[e] - body.rest[e]; };
  EXPECT_GT(moved(nearest).norm(), 1e-4);
  EXPECT_LT((moved(loose) - (4 * moved(nearest) - 3 * moved(next))).norm(), 1e-12);
}

// A single element at the end of a fin hangs on three in a row, all in one plane with it: nothing holds it
// across, but it is small and goes with the block.
TEST(Centre, ATipOfOneElementTurnsWithTheRest) {
  CentreOptions options = bar_of_voxels({15, 12, 10});
  options.inside = [](int i, int j, int k) {
    return i < 13 || (i == 13 && k == 5) || (i == 14 && j == 5 && k == 5);
  };
  Body body = centre_body(options);
  Scene scene = gum_scene();
  Tie turn = make_move(select_by_name("bar/x0"), Vec3::Zero());
  turn.motion.axis = Vec3::UnitZ();
  turn.motion.angle = 0.5;
  const Motion motion = turn.motion;
  scene.get<Supports>().ties.push_back(turn);
  const SimulateResult result = simulate_quietly(body, scene);
  EXPECT_EQ(result.stray_cells, 1u);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    EXPECT_LT((body.position[e] - body.rest[e] - motion.displacement(body.rest[e], 1)).norm(), 1e-5) << e;
}

TEST(Centre, RefusesWhatNothingHolds) {
  Scene scene = gum_scene();
  scene.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  EXPECT_THAT(refusal(centre_body(bar_of_voxels()), scene), HasSubstr("nothing holds part \"bar\""));
  fix(scene, "bar/x0");
  CentreOptions parted = bar_of_voxels();
  parted.inside = [](int i, int, int) { return i != 4; };
  EXPECT_THAT(refusal(centre_body(parted), scene), HasSubstr("the one of 27 elements near"));
  EXPECT_THAT(refusal(centre_body(bar_of_voxels({6, 5, 1})), scene), HasSubstr("lie in one plane"));
  scene.get<Supports>().ties[0].axes = {true, false, true};
  EXPECT_THAT(refusal(centre_body(bar_of_voxels()), scene),
              HasSubstr("\"bar\" is free to translate along y"));
}

TEST(Centre, RefusesModelsThatDoNotFit) {
  Scene scene = gum_scene();
  fix(scene, "bar/x0");
  for (const char* model : {"cells", "springs"}) {
    scene.parts["bar"].model = model;
    EXPECT_THAT(refusal(centre_body(bar_of_voxels()), scene), HasSubstr("--placement corner"));
  }
  scene.parts["bar"].model = "";
  scene.parts["bar"].hooke = "ganoveli";
  EXPECT_THAT(refusal(centre_body(bar_of_voxels()), scene), HasSubstr("did you mean \"ganovelli\""));
  scene.parts["bar"].hooke = "";
  Body uneven = centre_body(bar_of_voxels());
  uneven.parts[0].lattice.spacing.z() *= 1.1;
  EXPECT_THAT(refusal(uneven, scene), HasSubstr("cubic"));
}

// A bar in two parts, cut at x = 0.4 m, each with its own placement.
Body two_bars(Placement first, Placement second, double begin = 0.4) {
  const auto half = [&](Placement placement, double from, const std::string& name) {
    if (placement == Placement::centre) {
      CentreOptions options = bar_of_voxels({4, 3, 3});
      options.origin.x() = from;
      options.name = name;
      return centre_body(options);
    }
    testing::BoxOptions options;
    options.cells = {4, 3, 3};
    options.spacing = Vec3::Constant(0.1);
    options.origin.x() = from;
    options.name = name;
    return testing::box_body(options);
  };
  Body body = half(first, 0, "left");
  append(body, half(second, begin, "right"));
  return body;
}

SimulateResult bent(Body body, bool one) {
  Scene scene = gum_scene();
  fix(scene, one ? "bar/x0" : "left/x0");
  scene.get<Loads>().loads.push_back(make_push(half_space(Vec3(0.7, 0, 0), Vec3::UnitX()), Vec3(0, 0, -1)));
  Probe end;
  end.where = half_space(Vec3(0.7, 0, 0), Vec3::UnitX());
  scene.probes = {end};
  return simulate_quietly(body, scene);
}

TEST(Centre, PartsThatTouchAreBonded) {
  const double whole = bent(centre_body(bar_of_voxels()), true).probes[0].displacement.z();
  const SimulateResult both = bent(two_bars(Placement::centre, Placement::centre), false);
  ASSERT_EQ(both.bonds.size(), 1u);
  EXPECT_NEAR(both.bonds[0].area, 0.09, 1e-12);
  EXPECT_NEAR(both.probes[0].displacement.z() / whole, 1, 0.06);
  // The end of cells is softer; the bond to it holds all the same.
  const SimulateResult mixed = bent(two_bars(Placement::centre, Placement::corner), false);
  ASSERT_EQ(mixed.bonds.size(), 1u);
  EXPECT_NEAR(mixed.bonds[0].area, 0.09, 1e-12);
  EXPECT_LT(mixed.imbalance.norm(), 1e-6);
}

TEST(Centre, BondsDoNotResistRotation) {
  for (const Placement second : {Placement::centre, Placement::corner}) {
    Body body = two_bars(Placement::centre, second);
    Scene scene = gum_scene();
    Tie turn = make_move(select_by_name("left/x0"), Vec3::Zero());
    turn.motion.axis = Vec3(1, 1, 0).normalized();
    turn.motion.angle = 1.0;
    const Motion motion = turn.motion;
    scene.get<Supports>().ties.push_back(turn);
    const SimulateResult result = simulate_quietly(body, scene);
    for (std::size_t e = 0; e < body.element_count(); ++e)
      EXPECT_LT((body.position[e] - body.rest[e] - motion.displacement(body.rest[e], 1)).norm(), 1e-5);
    EXPECT_LT(result.elastic_energy, 1e-6);
  }
}

TEST(Centre, PartsApartDoNotTouch) {
  const Body apart = two_bars(Placement::centre, Placement::centre, 0.402);
  EXPECT_TRUE(touching_points({apart, {}, {}, {}, {}, {}}).empty());
}

}  // namespace
}  // namespace flexel::simulate
