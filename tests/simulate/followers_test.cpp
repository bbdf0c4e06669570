// Loads that turn with what they act on: resultants, derivatives, closed forms, books, and what is refused.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <tuple>

#include "base/error.h"
#include "base/math/dense.h"
#include "base/stop.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/equilibrium/positive_tangent.h"
#include "simulate/followers/gmres.h"
#include "simulate/followers/pressing_load.h"
#include "simulate/followers/turning_load.h"
#include "simulate/linear/block_jacobi.h"
#include "simulate/linear/vector_products.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using ::testing::HasSubstr;

// Any values in [-size, size].
std::vector<Vec3> any_vectors(std::size_t count, double size, double phase) {
  std::vector<Vec3> values(count);
  for (std::size_t i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis)
      values[i][axis] = size * std::sin(phase + 7.3 * static_cast<double>(3 * i + axis) + axis);
  return values;
}

// Points that are nodes themselves, off any plane.
std::vector<LoadedPoint> points_as_nodes() {
  std::vector<LoadedPoint> points;
  const std::vector<Vec3> places = any_vectors(12, 1, 0.3);
  for (std::size_t i = 0; i < places.size(); ++i)
    points.push_back(
        {places[i].cwiseProduct(Vec3(1, 2, 0.5)), 1 + 0.3 * std::sin(5.0 * static_cast<double>(i))});
  return points;
}

const Vec3 kFollowerForce(3, -2, 5), kFollowerTorque(-1, 4, 2), kFollowerAt(2, 1, -3);

TurningLoad turning_points(const std::vector<LoadedPoint>& points) {
  return *TurningLoad::make(
      points, [](std::size_t q, const auto& each) { each(static_cast<std::uint32_t>(q), 1); }, kFollowerForce,
      kFollowerTorque, kFollowerAt);
}

// Turned by `turn` about the origin, moved, and strained by the part `strain` of any_vectors().
std::vector<Vec3> displaced(const std::vector<LoadedPoint>& points, const Mat3& turn, double strain) {
  std::vector<Vec3> moved = any_vectors(points.size(), strain, 1.1);
  for (std::size_t i = 0; i < points.size(); ++i)
    moved[i] += turn * points[i].position - points[i].position + Vec3(4, -1, 2);
  return moved;
}

Mat3 any_turn(double angle) {
  return Eigen::AngleAxisd(angle, Vec3(1, -2, 3).normalized()).toRotationMatrix();
}

Vec3 middle_of_points(const std::vector<LoadedPoint>& points, const std::vector<Vec3>& moved) {
  Vec3 sum = Vec3::Zero();
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += points[i].weight * (points[i].position + moved[i]);
    total += points[i].weight;
  }
  return sum / total;
}

TEST(Followers, ForceAndMomentTurnWithTheFaceHoweverItIsStrained) {
  const std::vector<LoadedPoint> points = points_as_nodes();
  const TurningLoad load = turning_points(points);
  const std::vector<Vec3> none(points.size(), Vec3::Zero());
  const Vec3 rest_middle = middle_of_points(points, none);
  const Vec3 moment = kFollowerTorque + (kFollowerAt - rest_middle).cross(kFollowerForce);
  for (const double angle : {0.0, 0.7, 3.0})
    for (const double strain : {0.0, 0.2}) {
      const std::vector<Vec3> moved = displaced(points, any_turn(angle), strain);
      std::vector<Vec3> forces(points.size(), Vec3::Zero());
      load.add_forces(moved, 2, forces);
      Vec3 sum = Vec3::Zero(), about = Vec3::Zero();
      const Vec3 middle = middle_of_points(points, moved);
      for (std::size_t i = 0; i < points.size(); ++i) {
        sum += forces[i];
        about += (points[i].position + moved[i] - middle).cross(forces[i]);
      }
      const Vec3 turn = load.turn(moved, Vec3::Zero());
      const Mat3 rotation = turn.norm() > 0
                                ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                                : Mat3(Mat3::Identity());
      if (strain == 0) {
        EXPECT_LT((rotation - any_turn(angle)).norm(), 1e-12);
      }
      EXPECT_LT((sum - 2 * rotation * kFollowerForce).norm(), 1e-12 * sum.norm());
      EXPECT_LT((about - 2 * rotation * moment).norm(), 1e-12 * moment.norm());
    }
}

TEST(Followers, WholeTurnsAreCounted) {
  const std::vector<LoadedPoint> points = points_as_nodes();
  const TurningLoad load = turning_points(points);
  Vec3 turn = Vec3::Zero();
  for (int step = 1; step <= 30; ++step)
    turn = load.turn(displaced(points, any_turn(0.5 * step), 0.05), turn);
  EXPECT_NEAR(turn.norm(), 15, 0.3);
  for (int step = 29; step >= 0; --step) turn = load.turn(displaced(points, any_turn(0.5 * step), 0), turn);
  EXPECT_LT(turn.norm(), 1e-9);
}

// The derivative against central differences, and the transposed one against it.
void expect_change_of(const FollowerLoad& load, const std::vector<Vec3>& moved, double step,
                      double tolerance) {
  const std::size_t n = moved.size();
  const std::vector<Vec3> along = any_vectors(n, 1, 2.2), back = any_vectors(n, 1, 0.9);
  std::vector<Vec3> more(n, Vec3::Zero()), less = more, change = more, transposed = more, ahead = moved,
                                           behind = moved;
  for (std::size_t i = 0; i < n; ++i) {
    ahead[i] += step * along[i];
    behind[i] -= step * along[i];
  }
  load.add_forces(ahead, 1.5, more);
  load.add_forces(behind, 1.5, less);
  load.add_change(moved, 1.5, along, change);
  load.add_transposed_change(moved, 1.5, back, transposed);
  const double size = std::sqrt(dot(change, change));
  ASSERT_GT(size, 0);
  for (std::size_t i = 0; i < n; ++i)
    EXPECT_LT((change[i] - (more[i] - less[i]) / (2 * step)).norm(), tolerance * size);
  EXPECT_NEAR(dot(back, change), dot(along, transposed), 1e-12 * size * std::sqrt(dot(back, back)));
}

TEST(Followers, ChangeOfATurningLoad) {
  const std::vector<LoadedPoint> points = points_as_nodes();
  const TurningLoad load = turning_points(points);
  for (const double angle : {0.0, 0.7, 3.0})
    for (const double strain : {0.0, 0.2})
      expect_change_of(load, displaced(points, any_turn(angle), strain), 1e-5, 1e-9);
  std::vector<LoadedPoint> flat = points;
  for (LoadedPoint& point : flat) point.position.x() = 3;
  expect_change_of(turning_points(flat), displaced(flat, any_turn(2), 0.1), 1e-5, 1e-9);
}

// The eight corners of a unit cube, each face with its four Gauss points: exact for trilinear shapes.
PressingLoad pressed_cube(bool open) {
  PressingLoad load(2);
  const double gauss = 0.5 - 0.5 / std::sqrt(3);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      if (open && axis == 0) continue;
      for (int point = 0; point < 4; ++point) {
        Vec3 at;
        at[axis] = side;
        at[(axis + 1) % 3] = point % 2 ? gauss : 1 - gauss;
        at[(axis + 2) % 3] = point / 2 ? gauss : 1 - gauss;
        std::array<std::uint32_t, 8> nodes{};
        std::array<double, 8> values{};
        std::array<Vec3, 8> gradients{};
        for (std::uint32_t a = 0; a < 8; ++a) {
          nodes[a] = a;
          Vec3 value, slope;
          for (int i = 0; i < 3; ++i) {
            value[i] = a >> i & 1 ? at[i] : 1 - at[i];
            slope[i] = a >> i & 1 ? 1 : -1;
          }
          values[a] = value.prod();
          gradients[a] = Vec3(slope.x() * value.y() * value.z(), value.x() * slope.y() * value.z(),
                              value.x() * value.y() * slope.z());
        }
        Vec3 area = Vec3::Zero();
        area[axis] = (side ? 1 : -1) * 0.25;
        load.add_point(nodes, values, gradients, area);
      }
    }
  return load;
}

double cube_volume(const std::vector<Vec3>& moved) {
  double volume = 0;  // Gauss: exact for the determinant of a trilinear map
  const double gauss = 0.5 - 0.5 / std::sqrt(3);
  for (int p = 0; p < 8; ++p) {
    const Vec3 at(p & 1 ? gauss : 1 - gauss, p & 2 ? gauss : 1 - gauss, p & 4 ? gauss : 1 - gauss);
    Mat3 f = Mat3::Identity();
    for (std::size_t a = 0; a < 8; ++a) {
      Vec3 value, slope;
      for (int i = 0; i < 3; ++i) {
        value[i] = a >> i & 1 ? at[i] : 1 - at[i];
        slope[i] = a >> i & 1 ? 1 : -1;
      }
      f += moved[a] * Vec3(slope.x() * value.y() * value.z(), value.x() * slope.y() * value.z(),
                           value.x() * value.y() * slope.z())
                          .transpose();
    }
    volume += f.determinant() / 8;
  }
  return volume;
}

TEST(Followers, PressureOnAClosedSurfaceIsTheVolumesDerivative) {
  const PressingLoad load = pressed_cube(false);
  const std::vector<Vec3> moved = any_vectors(8, 0.15, 0.4);
  std::vector<Vec3> forces(8, Vec3::Zero()), change = forces, transposed = forces;
  load.add_forces(moved, 1, forces);
  Vec3 sum = Vec3::Zero();
  for (std::size_t a = 0; a < 8; ++a) {
    sum += forces[a];
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Vec3> more = moved, less = moved;
      more[a][axis] += 1e-5;
      less[a][axis] -= 1e-5;
      EXPECT_NEAR(forces[a][axis], -2 * (cube_volume(more) - cube_volume(less)) / 2e-5, 1e-9);
    }
  }
  EXPECT_LT(sum.norm(), 1e-13);
  load.add_change(moved, 1, any_vectors(8, 1, 1), change);
  load.add_transposed_change(moved, 1, any_vectors(8, 1, 1), transposed);
  for (std::size_t a = 0; a < 8; ++a) EXPECT_LT((change[a] - transposed[a]).norm(), 1e-12);
}

TEST(Followers, ChangeOfAPressure) {
  for (const bool open : {false, true})
    expect_change_of(pressed_cube(open), any_vectors(8, 0.3, 0.4), 1e-5, 1e-9);
}

// A matrix that is not symmetric, by blocks on two diagonals: the answer is that of its product.
TEST(Followers, GmresSolvesWhatIsNotSymmetric) {
  constexpr std::uint32_t kRows = 60;
  BlockMatrix matrix;
  matrix.row_offsets = {0};
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (const std::int64_t column : {std::int64_t{row} - 1, std::int64_t{row}, std::int64_t{row} + 1}) {
      if (column < 0 || column >= kRows) continue;
      matrix.columns.push_back(static_cast<std::uint32_t>(column));
      Block block = (column == row ? 2.2 : column < row ? -1.4 : -0.6) * Block::Identity();
      block(0, 1) += 0.3;
      matrix.values.push_back(block);
    }
    matrix.row_offsets.push_back(matrix.columns.size());
  }
  const std::vector<Vec3> wanted = any_vectors(kRows, 1, 0.2);
  std::vector<Vec3> right, found;
  multiply(matrix, wanted, right);
  const StoredMatrix stored(matrix);
  const auto preconditioner = block_jacobi(matrix);
  const LinearResult result = gmres(stored, right, found, *preconditioner, 1e-12, 1000);
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.relative_residual, 1e-12);
  for (std::size_t row = 0; row < kRows; ++row) EXPECT_LT((found[row] - wanted[row]).norm(), 1e-9);
}

constexpr double kBarYoung = 1e9, kBarLength = 0.08;

// A bar 80 x 1 x 1 mm of `across` cells, held at x = 0; without contraction across, so that a circle is
// exact.
Body follower_bar(int across, const Mat3& axes = Mat3::Identity()) {
  return testing::box_body(
      {.cells = {80 * across, across, across}, .spacing = Vec3::Constant(1e-3 / across), .axes = axes});
}

std::string follower_stuff(const std::string& model, double poisson) {
  return fmt::format(
      "model = \"{}\"\nmaterial = \"it\"\n[materials.it]\nyoung = \"1 GPa\"\npoisson = {}\ndensity = \"1000 "
      "kg/m3\"\n[[fix]]\nwhere = \"box/x0\"\n",
      model, poisson);
}

std::string words_for(const Vec3& v, const char* unit) {
  return fmt::format("[\"{:.17g} {}\", \"{:.17g} {}\", \"{:.17g} {}\"]", v.x(), unit, v.y(), unit, v.z(),
                     unit);
}

SimulateResult run_follower(Body& body, const std::string& scene) {
  Progress progress("test", Progress::Mode::quiet);
  SimulateOptions options;
  options.estimate = options.stress = false;
  return simulate(body, parse_scene(scene, "s.toml"), options, progress);
}

// Of the length: how far the middle of the end is from its place on the arc.
double off_the_arc(const std::string& model, double poisson, double angle, const std::string& rest,
                   int across = 4) {
  Body body = follower_bar(across);
  const double moment = kBarYoung * std::pow(1e-3, 4) / 12 * angle / kBarLength;
  const SimulateResult result =
      run_follower(body, follower_stuff(model, poisson) + "[[load]]\nwhere = \"box/x1\"\n" + rest +
                             "torque = " + words_for(Vec3(0, -moment, 0), "N m") +
                             "\n[[probe]]\nname = \"end\"\nat = [\"80 mm\", \"0.5 mm\", \"0.5 mm\"]\n");
  EXPECT_EQ(result.loads.size(), 1u);
  // few connections through the thickness are stiffer than the bar, but bend it evenly all the same
  const double turned = model == "springs" ? -result.loads[0].rotation->y() : angle;
  EXPECT_NEAR(-result.loads[0].rotation->y(), angle, (model == "springs" ? 0.3 : 0.02) * angle);
  const double radius = kBarLength / turned;
  const Vec3 exact(radius * std::sin(turned) - kBarLength, 0, radius * (1 - std::cos(turned)));
  return (result.probes[0].displacement - exact).norm() / kBarLength;
}

// A cantilever under the moment theta E I / L at its end is an arc of the angle theta. Dead forces would
// leave it 30 % and more of the length away.
TEST(Followers, ACantileverIsRolledUpIntoACircle) {
  // model, half turns, cells through the thickness: four start from the equilibrium of two, and take the turns from there
  using Way = std::tuple<const char*, double, int>;
  for (const auto& [model, half_turns, across] : less_if_sanitized<std::vector<Way>>(
           {{"cells", 2, 2}, {"cells", 3, 4}, {"quadratic", 3, 1}, {"springs", 1, 2}},
           {{"cells", 0.5, 2}, {"quadratic", 0.5, 1}}, "one model less, and a quarter of a turn")) {
    const double angle = half_turns * std::numbers::pi;
    const double poisson = model == std::string("springs") ? 0.25 : 0;
    EXPECT_LT(off_the_arc(model, poisson, angle, "follower = true\n", across), 0.01) << model << angle;
  }
}

// Of gum_block() turned by `turn` about the origin.
std::string all_followers(double scale, const Mat3& turn = Mat3::Identity()) {
  return "[[load]]\nwhere = \"box/x1\"\nfollower = true\ntorque = " +
         words_for(turn * scale * Vec3(0.02, -0.05, 0.02), "N m") +
         "\nforce = " + words_for(turn * scale * Vec3(0.5, 0.5, 0), "N") +
         "\nat = " + words_for(turn * Vec3(90, 5, 9), "mm") +
         fmt::format("\n[[load]]\nwhere = \"box/z0\"\nfollower = true\npressure = \"{} kPa\"\n", 20 * scale);
}

// 60 x 20 x 20 mm of gum, whose elements at x = 0 are held: a face would be by springs at equilibrium alone.
std::string follower_gum(const std::string& model, double damping = 0, const Mat3& turn = Mat3::Identity()) {
  return fmt::format(
      "model = \"{}\"\nmaterial = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.25\ndensity = "
      "\"1000 kg/m3\"\n[[fix]]\nwhere = {{ half_space = {{ point = {}, normal = [{}, {}, {}] }} }}\n{}",
      model, words_for(turn * Vec3(1, 0, 0), "mm"), -turn(0, 0), -turn(1, 0), -turn(2, 0),
      damping > 0 ? fmt::format("[damping]\ntime = \"{} s\"\n", damping) : "");
}

Body gum_block() {
  return testing::box_body({.cells = {6, 2, 2}, .spacing = Vec3::Constant(0.01)});
}

// While an answer is told, a run that is to stop is not kept by the question whether it is stable.
TEST(Followers, WhetherTheTangentIsPositiveCanBeStopped) {
  const Body body = gum_block();
  const Scene scene = parse_scene(follower_gum("cells") + all_followers(0.01), "s.toml");
  const Problem problem{body, materials_of_parts(scene, body), {}, models_of_parts(scene, body), {}, {}, {},
                        {}};
  Mechanics mechanics(problem, active_effects(scene.effects, problem));
  const State state{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
  EXPECT_EQ(has_positive_tangent(mechanics, state), true);
  const StopAfter limit(0, "--timeout");
  EXPECT_THROW((void)has_positive_tangent(mechanics, state), TimeoutError);
  const StopWaits answered;
  EXPECT_EQ(has_positive_tangent(mechanics, state), std::nullopt);
}

// What the solver takes for the change of all forces is that.
TEST(Followers, TheWholeTangentIsThatOfTheForces) {
  for (const char* model : {"cells", "springs"}) {
    const Body body = gum_block();
    const Scene scene = parse_scene(follower_gum(model) + all_followers(10), "s.toml");
    const Problem problem{body,
                          materials_of_parts(scene, body),
                          {},
                          models_of_parts(scene, body),
                          hooke_of_parts(scene, body),
                          {},
                          {},
                          {}};
    Mechanics mechanics(problem, active_effects(scene.effects, problem));
    ASSERT_TRUE(mechanics.follows());
    State state{any_vectors(body.element_count(), 1e-3, 0.7), 0.8};
    clear_prescribed(mechanics.constraints(), state.displacement);
    std::vector<Vec3> along = any_vectors(body.element_count(), 1, 0.1), product;
    clear_prescribed(mechanics.constraints(), along);
    mechanics.assemble(state);
    mechanics.eliminate_prescribed();
    multiply(mechanics.whole_tangent(), along, product);
    const double step = 1e-7;
    State more = state, less = state;
    for (std::size_t e = 0; e < along.size(); ++e) {
      more.displacement[e] += step * along[e];
      less.displacement[e] -= step * along[e];
    }
    std::vector<Vec3> up = mechanics.forces(more).total, down = mechanics.forces(less).total;
    std::vector<Vec3> loads(along.size(), Vec3::Zero());
    for (const ActiveEffect& effect : mechanics.effects())
      if (effect->follows()) effect->add_force_change(state, along, false, loads);
    const double size = std::sqrt(dot(product, product)), own = std::sqrt(dot(loads, loads));
    EXPECT_GT(own, 1e-3 * size);  // the loads are seen
    for (std::size_t e = 0; e < along.size(); ++e)
      for (int axis = 0; axis < 3; ++axis)
        if (!(mechanics.constraints().mask[e] >> axis & 1)) {
          EXPECT_NEAR(product[e][axis], -(up[e][axis] - down[e][axis]) / (2 * step), 1e-6 * size);
        }
  }
}

// A part that is turned as a whole, with its loads, has the answer of the one that is not, turned.
TEST(Followers, AnswersDoNotDependOnTheFrame) {
  // points of a pressure at thirds of the sides' halves: on no plane between two cells, where rounding would choose the cell
  // whose gradient they take
  const auto block = [](const Mat3& axes) {
    return testing::box_body({.cells = {4, 2, 2}, .spacing = Vec3(0.015, 0.01, 0.01), .axes = axes});
  };
  const Mat3 turn = any_turn(2.1);
  constexpr double kLike = 1e-4;  // of two edges of one length rounding chooses which is cut
  for (const char* model : {"cells", "quadratic"}) {
    Body straight = block(Mat3::Identity()), turned = block(turn);
    const SimulateResult first = run_follower(straight, follower_gum(model) + all_followers(1));
    const SimulateResult second = run_follower(turned, follower_gum(model, 0, turn) + all_followers(1, turn));
    EXPECT_GT(first.loads[0].rotation->norm(), 0.3);
    EXPECT_LT(first.imbalance.norm(), 1e-6);
    for (std::size_t l = 0; l < 2; ++l) {
      const Vec3 &force = first.loads[l].force, &moment = first.loads[l].moment;
      EXPECT_LT((second.loads[l].force - turn * force).norm(), kLike * force.norm()) << model;
      EXPECT_LT((second.loads[l].moment - turn * moment).norm(), kLike * moment.norm()) << model;
    }
    EXPECT_LT((*second.loads[0].rotation - turn * *first.loads[0].rotation).norm(), kLike) << model;
    for (std::size_t e = 0; e < straight.element_count(); ++e)
      EXPECT_LT((turned.position[e] - turn * straight.position[e]).norm(), kLike * first.largest_displacement)
          << model;
  }
}

TEST(Followers, ModelsAgree) {
  Body cells = gum_block(), quadratic = gum_block();
  const SimulateResult first = run_follower(cells, follower_gum("cells") + all_followers(1));
  const SimulateResult second = run_follower(quadratic, follower_gum("quadratic") + all_followers(1));
  // two cells through the thickness, strains of some percent
  EXPECT_LT((*second.loads[0].rotation - *first.loads[0].rotation).norm(),
            0.1 * first.loads[0].rotation->norm());
  EXPECT_LT((second.loads[0].force - first.loads[0].force).norm(), 0.1 * first.loads[0].force.norm());
}

// Elements of model `paper` lie half a voxel under the surface: loads turn as these do, and are whole.
TEST(Followers, APaperFaceTurnsItsLoads) {
  Body body = testing::centre_body({.voxels = {40, 2, 2}, .spacing = 2e-3});
  const Vec3 force(1, -2, 6), torque(0, -0.1, 0.05);
  const std::string load = "[[load]]\nwhere = \"box/x1\"\nfollower = true\n";
  const SimulateResult result =
      run_follower(body, follower_stuff("paper", 0.25) + load + "force = " + words_for(force, "N") + "\n" +
                             load + "torque = " + words_for(torque, "N m") + "\n");
  std::vector<Vec3> rest, now;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] == 39) {
      rest.push_back(body.rest[e]);
      now.push_back(body.position[e]);
    }
  ASSERT_EQ(rest.size(), 4u);
  const Vec3 middle = (now[0] + now[1] + now[2] + now[3]) / 4;
  Mat3 products = Mat3::Zero();
  for (std::size_t i = 0; i < 4; ++i) products += (now[i] - middle) * rest[i].transpose();
  const Mat3 turn = nearest_rotation(products).rotation;
  EXPECT_GT(Eigen::AngleAxisd(turn).angle(), 0.5);
  EXPECT_LT((result.loads[0].force - turn * force).norm(), 5e-3 * force.norm());
  EXPECT_NEAR(result.loads[0].force.norm(), force.norm(), 1e-9 * force.norm());
  EXPECT_LT((result.loads[1].moment - turn * torque).norm(), 5e-3 * torque.norm());
  EXPECT_NEAR(result.loads[1].moment.norm(), torque.norm(), 1e-9 * torque.norm());
}

// In time: the work of the loads is what the body has, and with damping it comes to rest in the
// equilibrium.
TEST(Followers, BooksCloseInTimeAndTheEndIsTheEquilibrium) {
  for (const char* model :
       less_if_sanitized<std::vector<const char*>>({"cells", "springs"}, {"springs"}, "one model of two")) {
    const testing::TimedCase swung = testing::run_timed(
        gum_block(),
        parse_scene(follower_gum(model) + all_followers(0.5) + "[run]\ntime = \"0.1 s\"\n", "s.toml"));
    testing::expect_books_close(swung.result);
    EXPECT_GT(swung.result.loads[0].rotation->norm(), 0.1);
    const testing::TimedCase damped = testing::run_timed(
        gum_block(),
        parse_scene(follower_gum(model, 0.01) + all_followers(0.5) + "[run]\ntime = \"0.4 s\"\n", "s.toml"));
    Body still = gum_block();
    const SimulateResult rest = run_follower(still, follower_gum(model) + all_followers(0.5));
    EXPECT_LT((*damped.result.loads[0].rotation - *rest.loads[0].rotation).norm(),
              1e-3 * rest.loads[0].rotation->norm())
        << model;
  }
}

// rad, of the free end of a cantilever under an end force that stays square to it, F L^2 / (E I) = `force`:
// from the free end on kappa' = F cos(phi), phi' = -kappa (Timoshenko and Gere 1961, section 2.7).
double turn_of_the_end(double force) {
  constexpr int kSteps = 2000;
  double phi = 0, kappa = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double step = 1.0 / kSteps, half_phi = phi - 0.5 * step * kappa;
    const double half_kappa = kappa + 0.5 * step * force * std::cos(phi);
    phi -= step * half_kappa;
    kappa += step * force * std::cos(half_phi);
  }
  return -phi;
}

TEST(Followers, AForceAcrossBendsACantileverIntoTheElastica) {
  constexpr double kForce = 8, kThick = 4e-3;
  const double turn =
      turn_of_the_end(kForce * kBarLength * kBarLength / (kBarYoung * std::pow(kThick, 4) / 12));
  EXPECT_GT(turn, 1);
  const Vec3 exact = kForce * Vec3(-std::sin(turn), 0, std::cos(turn));
  using Way = std::pair<const char*, const char*>;
  for (const auto& [model, link] : less_if_sanitized<std::vector<Way>>(
           {{"cells", "averaging"}, {"quadratic", "averaging"}, {"quadratic", "rigid"}},
           {{"cells", "averaging"}}, "one of three")) {
    Body body = testing::box_body({.cells = {40, 2, 2}, .spacing = Vec3::Constant(2e-3)});
    const SimulateResult result = run_follower(
        body, follower_stuff(model, 0) +
                  fmt::format("[[load]]\nwhere = \"box/x1\"\nlink = \"{}\"\nfollower = true\nforce = {}\n",
                              link, words_for(Vec3(0, 0, kForce), "N")));
    EXPECT_LT((result.loads[0].force - exact).norm(), 0.02 * kForce) << model << " " << link;
    EXPECT_NEAR(result.loads[0].force.norm(), kForce, 1e-9 * kForce) << model << " " << link;
    EXPECT_LT(result.imbalance.norm(), 1e-4 * kForce) << model << " " << link;
  }
}

// What programs say of a run.
class FollowersSay : public ::testing::Test, public ProgressListener {
 protected:
  void SetUp() override { set_progress_listener(this); }
  void TearDown() override { set_progress_listener(nullptr); }
  void update(const std::string&, double, const std::string&, std::optional<double>) noexcept override {}
  void say(const std::string& line) noexcept override { said_ += line + "\n"; }
  void warn(const std::string& line) noexcept override { warned_ += line + "\n"; }
  std::string said_, warned_;
};

TEST_F(FollowersSay, WhetherAnotherEquilibriumBranchesOff) {
  for (const std::string model : {"cells", "quadratic"})
    for (const bool rigid : {false, true}) {
      said_.clear();
      warned_.clear();
      Body body = gum_block();
      Progress progress("test", Progress::Mode::lines);
      SimulateOptions options;
      options.estimate = options.stress = false;
      (void)simulate(body,
                     parse_scene(follower_gum(model) +
                                     fmt::format("[[load]]\nwhere = \"box/x1\"\nlink = \"{}\"\nfollower = "
                                                 "true\nforce = [0, 0, \"0.2 N\"]\n",
                                                 rigid ? "rigid" : "averaging"),
                                 "s.toml"),
                     options, progress);
      EXPECT_THAT(said_, HasSubstr("[run] time shows flutter")) << model << rigid;
      EXPECT_THAT(warned_, ::testing::Not(HasSubstr("flutter"))) << model << rigid;
    }
}

std::string follower_refusal(const std::string& rest) {
  Body body = gum_block();
  try {
    (void)run_follower(body, follower_gum("cells") + rest);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Followers, WhatTheyDoNotTakeIsRefused) {
  EXPECT_THAT(follower_refusal("[[load]]\nwhere = \"box/x1\"\nbearing = [\"1 N\", 0, 0]\nfollower = true\n"),
              HasSubstr("not with \"bearing\""));
  EXPECT_THAT(follower_refusal("[[load]]\nwhere = \"box/x1\"\nforce = [\"1 N\", 0, 0]\nfollower = 1\n"),
              HasSubstr("needs to be true or false"));
  EXPECT_THAT(follower_refusal(all_followers(0.01) + "[run]\nmodes = 2\n"), HasSubstr("follower"));
  EXPECT_THAT(
      follower_refusal("[[load]]\nwhere = { box = { min = [\"59 mm\", \"-1 mm\", \"-1 mm\"], max = [\"61 "
                       "mm\", \"1 mm\", \"21 mm\"] } }\nforce = [\"1 N\", 0, 0]\nfollower = true\n"),
      HasSubstr("lie on a line"));
}

}  // namespace
}  // namespace flexel::simulate
