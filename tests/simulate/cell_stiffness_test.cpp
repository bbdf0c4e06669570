// The tangent stiffness that is made on demand is the one that Cells stores.
#include "simulate/equilibrium/cell_stiffness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <ostream>
#include <random>

#include "base/error.h"
#include "base/parallel.h"
#include "formats/lattice/merge.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/equilibrium/mechanics.h"
#include "simulate/scene/effects.h"
#include "simulate/scene/scene.h"
#include "tests/sanitized.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/law_materials.h"
#include "tests/simulate/numbered_body.h"
#include "tests/simulate/scene_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using testing::kGumYoung;

// A part turned in space, with slivers and a hole, spacings that differ.
BoxOptions near_box() {
  const auto [along, wide, high] =
      less_if_sanitized(std::array{19, 7, 6}, std::array{9, 4, 3}, "a sixth of the cells");
  BoxOptions near;
  near.name = "near";
  near.cells = {along, wide, high};
  near.spacing = Vec3(0.1, 0.11, 0.09);
  near.axes =
      (Eigen::AngleAxisd(0.5, Vec3::UnitX()) * Eigen::AngleAxisd(0.4, Vec3::UnitY())).toRotationMatrix();
  near.fill = [](int i, int j, int k) {
    return i == 4 && j == 3 ? 0 : 0.05 + 0.9 * ((i + 2 * j + 3 * k) % 7) / 7;
  };
  return near;
}

Body one_box() {
  return box_body(near_box());
}

// Two that touch.
Body two_boxes() {
  const BoxOptions near = near_box();
  BoxOptions far = near;
  far.name = "far";
  far.cells[0] = 5;
  far.origin = near.axes * Vec3(near.cells[0] * 0.1, 0, 0);
  far.fill = {};
  Body body = box_body(near);
  append(body, box_body(far));
  return body;
}

Scene held_scene(LawName law = LawName::neo_hooke) {
  Scene scene;
  scene.materials["gum"] = {"gum", kGumYoung, 0.3, 580, "test"};
  if (law == LawName::mooney_rivlin) scene.materials["gum"] = testing::mooney_rivlin_material();
  if (law == LawName::arruda_boyce) scene.materials["gum"] = testing::arruda_boyce_material();
  if (law == LawName::orthotropic) scene.materials["gum"] = testing::orthotropic_material();
  scene.material = "gum";
  scene.get<Supports>().ties.push_back(make_fix(select_by_name("near/x0")));
  Selection ball;
  ball.kind = Selection::Kind::sphere;
  ball.radius = 0.3;
  Tie slide = make_fix(ball);
  slide.axes = {true, false, true};
  scene.get<Supports>().ties.push_back(slide);
  return scene;
}

std::vector<Vec3> random_vectors(std::size_t count, double size) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<Vec3> values;
  for (std::size_t e = 0; e < count; ++e)
    values.emplace_back(uniform(engine), uniform(engine), uniform(engine));
  return values;
}

struct TangentCase {
  double size, squeeze;  // m, 1
  bool project, stressed;
  LawName law = LawName::neo_hooke;
};

void PrintTo(const TangentCase& each, std::ostream* out) {
  *out << "law " << static_cast<int>(each.law) << ", off by " << each.size << ", squeezed by " << each.squeeze
       << (each.project ? ", projected" : "") << (each.stressed ? ", stressed" : "");
}

class CellStiffnessOf : public ::testing::TestWithParam<TangentCase> {
 protected:
  CellStiffnessOf()
      : body_(two_boxes()),
        scene_(held_scene(GetParam().law)),
        problem_{body_, materials_of_parts(scene_, body_), {}, {}, {}, {}},
        stored_(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::stored),
        made_(problem_, active_effects(scene_.effects, problem_), StiffnessStorage::made) {
    State state{random_vectors(body_.element_count(), GetParam().size), 1};
    for (std::size_t e = 0; e < body_.element_count(); ++e)
      state.displacement[e] -= GetParam().squeeze * body_.rest[e];
    state_ = state;
    corner_ = stored_.cells().smallest_corner_jacobian(state).value;
    const std::vector<Vec3> step = random_vectors(body_.element_count(), 0.01);
    stress_ = stored_.cells().predicted_stress(state, step);
    for (Mechanics* each : {&stored_, &made_})
      each->assemble(state, {GetParam().project, GetParam().stressed ? &stress_ : nullptr});
  }

  void expect_same() const {
    const LinearOperator &a = stored_.tangent(), &b = made_.tangent();
    ASSERT_NE(dynamic_cast<const CellStiffness*>(&b), nullptr);
    double largest = 0;
    for (const Block& block : a.diagonal()) largest = std::max(largest, block.norm());
    const std::vector<Vec3> x = random_vectors(a.rows(), 1);
    std::vector<Vec3> stored, made;
    multiply(a, x, stored);
    multiply(b, x, made);
    const std::vector<Block> diagonal = a.diagonal(), other = b.diagonal();
    for (std::size_t e = 0; e < a.rows(); ++e) {
      ASSERT_LT((stored[e] - made[e]).norm(), 1e-12 * largest) << e;
      ASSERT_LT((diagonal[e] - other[e]).norm(), 1e-12 * largest) << e;
    }
    std::vector<Block> room;
    const std::size_t begin = 7, end = a.rows() - 3;
    const Block* expected = a.blocks(begin, end, room);
    const Block* found = b.blocks(begin, end, room);
    for (std::uint64_t q = 0; q < a.row_offsets()[end] - a.row_offsets()[begin]; ++q)
      ASSERT_LT((expected[q] - found[q]).norm(), 1e-12 * largest) << q;
  }

  void expect_same_bits() {
    const std::vector<Vec3> x = random_vectors(body_.element_count(), 1);
    std::vector<Vec3> one, four;
    {
      const ThreadLimit limit(1);
      multiply(made_.tangent(), x, one);
    }
    const ThreadLimit limit(4);
    multiply(made_.tangent(), x, four);
    EXPECT_EQ(one, four);
  }

  Body body_;
  Scene scene_;
  Problem problem_;
  Mechanics stored_, made_;
  State state_;
  std::vector<Mat3> stress_;
  double corner_ = 1;  // smallest J of one
};

constexpr TangentCase kSqueezed{0.02, 0.2, false, false};  // indefinite
constexpr TangentCase kFolding{0.035, 0, false, false};
INSTANTIATE_TEST_SUITE_P(
    Forms, CellStiffnessOf,
    ::testing::Values(TangentCase{0, 0, false, false}, kSqueezed, TangentCase{0.02, 0.2, true, false},
                      TangentCase{0.02, 0.2, false, true}, TangentCase{0.02, 0.2, true, true}, kFolding,
                      TangentCase{0.035, 0, true, false}, TangentCase{0.035, 0, true, true}));

std::vector<TangentCase> of_other_laws() {
  std::vector<TangentCase> cases;
  for (const LawName law : {LawName::mooney_rivlin, LawName::arruda_boyce, LawName::orthotropic})
    for (const bool project : {false, true})
      for (const bool stressed : {false, true})
        for (const double squeeze : {0.0, 0.1})
          cases.push_back({squeeze > 0 ? 0.02 : 0, squeeze, project, stressed, law});
  return cases;
}
INSTANTIATE_TEST_SUITE_P(Laws, CellStiffnessOf, ::testing::ValuesIn(of_other_laws()));

TEST_P(CellStiffnessOf, IsTheStoredOneForAnyNumberOfThreads) {
  if (GetParam().size == kFolding.size) {
    EXPECT_LT(corner_, 0.1);
  }
  expect_same();
  expect_same_bits();
  for (Mechanics* each : {&stored_, &made_}) each->eliminate_prescribed();
  expect_same();
}

// Of an implicit step: forces, energy and the diagonal that is kept.
TEST_P(CellStiffnessOf, EvaluatesStatesAsTheCellsDo) {
  made_.assemble(state_, {});
  const std::vector<Block> before = made_.tangent().diagonal();
  made_.set_inertia(std::vector<double>(body_.element_count(), 100));
  stored_.set_inertia(std::vector<double>(body_.element_count(), 100));
  State inside_out = state_;
  for (std::size_t e = 0; e < body_.element_count(); ++e)
    inside_out.displacement[e] = Vec3(-2 * body_.rest[e].x(), 0, 0);
  EXPECT_EQ(made_.elastic_energy(inside_out), std::numeric_limits<double>::infinity());
  Forces found = made_.forces(inside_out);
  EXPECT_FALSE(made_.is_sound(inside_out, found));
  found = made_.forces(state_);
  const Forces expected = stored_.forces(state_);
  EXPECT_EQ(made_.is_sound(state_, found), stored_.is_sound(state_, expected));
  double largest = 0;
  for (const Vec3& force : expected.total) largest = std::max(largest, force.norm());
  for (std::size_t e = 0; e < body_.element_count(); ++e)
    ASSERT_LE((found.total[e] - expected.total[e]).norm(), 1e-11 * largest) << e;
  const double energy = stored_.elastic_energy(state_);
  EXPECT_NEAR(made_.elastic_energy(state_), energy, 1e-11 * energy);
  const std::vector<Block> after = made_.tangent().diagonal();
  for (std::size_t e = 0; e < body_.element_count(); ++e)
    ASSERT_LT((after[e] - before[e] - 100 * Block::Identity()).norm(), 1e-12 * after[e].norm()) << e;
}

TEST(CellStiffness, CellsBesideGapsAreNoRun) {
  const Body body = testing::cells_beside_gaps(16, 0.1);
  ASSERT_EQ(body.element_count(), 8 * body.cell_count());
  const Scene scene = held_scene();
  const Problem problem{body, materials_of_parts(scene, body), {}, {}, {}, {}};
  Mechanics stored(problem, {}, StiffnessStorage::stored), made(problem, {}, StiffnessStorage::made);
  const State state{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
  for (Mechanics* each : {&stored, &made}) each->assemble(state);
  const std::vector<Vec3> x = random_vectors(body.element_count(), 1);
  std::vector<Vec3> expected, found;
  multiply(stored.tangent(), x, expected);
  multiply(made.tangent(), x, found);
  for (std::size_t e = 0; e < expected.size(); ++e)
    ASSERT_LT((expected[e] - found[e]).norm(), 1e-9 * kGumYoung * 0.1) << e;
}

// Stands for other processes, by mechanics of its own.
class OtherProcesses : public CellsElsewhere {
 public:
  explicit OtherProcesses(Mechanics& other) : other_(other) {}
  [[nodiscard]] Figures figures(const State& state) override {
    return {other_.elastic_energy(state), other_.cells().smallest_jacobian(state),
            other_.smallest_corner_jacobian(state)};
  }
  void add_forces(const State& state, std::vector<Vec3>& forces) override {
    other_.add_elastic_forces(state, forces);
  }
  [[nodiscard]] std::optional<bool> has_positive_tangent(const State&) override { return std::nullopt; }
  void multiply(const std::vector<Vec3>& x, std::vector<Vec3>& y) override {
    assemble();
    simulate::multiply(other_.tangent(), x, y);
  }
  [[nodiscard]] std::vector<Vec3> diagonal() override {
    assemble();
    std::vector<Vec3> diagonal;
    for (const Block& block : other_.tangent().diagonal()) diagonal.emplace_back(block.diagonal());
    return diagonal;
  }

 private:
  void assemble() {
    other_.assemble({std::vector<Vec3>(other_.body().element_count(), Vec3::Zero()), 1});
    other_.eliminate_prescribed();
  }
  Mechanics& other_;
};

TEST(CellsElsewhere, DoWhatIsDoneHere) {
  const Body body = one_box();
  const Scene scene = held_scene();
  const Problem problem{body, materials_of_parts(scene, body), {}, {}, {}, {}};
  Mechanics here(problem, active_effects(scene.effects, problem)),
      there(problem, active_effects(scene.effects, problem)),
      moved(problem, active_effects(scene.effects, problem));
  moved.move_cells(std::make_shared<OtherProcesses>(there));
  const State state{random_vectors(body.element_count(), 1e-3), 1};
  EXPECT_EQ(moved.elastic_energy(state), here.elastic_energy(state));
  EXPECT_EQ(moved.most_compressed(state).name, here.most_compressed(state).name);
  EXPECT_LT(moved.most_compressed(state).value, 1);
  EXPECT_EQ(moved.smallest_corner_jacobian(state).value, here.smallest_corner_jacobian(state).value);
  EXPECT_EQ(moved.forces(state).total, here.forces(state).total);
  const std::vector<std::uint8_t> tied = moved.tied_elements();
  EXPECT_EQ(tied, here.tied_elements());
  EXPECT_NE(std::count(tied.begin(), tied.end(), 2), 0);
  moved.move_cells(nullptr);  // made again
  EXPECT_EQ(moved.elastic_energy(state), here.elastic_energy(state));
}

// Of a box that is held along two axes, or by elements at one point.
TEST(CellsElsewhere, TellWhatIsFreeAsIsToldHere) {
  const Body body = one_box();
  Scene scene = held_scene();
  const Tie ball = scene.get<Supports>().ties.back();
  for (const Tie& tie : {make_fix(select_by_name("near/x0")), ball}) {
    scene.get<Supports>().ties = {tie};
    scene.get<Supports>().ties.front().axes = {true, false, true};
    const Problem problem{body, materials_of_parts(scene, body), {}, {}, {}, {}};
    Mechanics here(problem, active_effects(scene.effects, problem)),
        there(problem, active_effects(scene.effects, problem)),
        moved(problem, active_effects(scene.effects, problem));
    moved.move_cells(std::make_shared<OtherProcesses>(there));
    const State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1};
    const auto told = [&](Mechanics& mechanics) -> std::string {
      try {
        refuse_free_motions(mechanics, rest, "scene.toml");
      } catch (const InputError& error) {
        return error.what();
      }
      return "nothing is free";
    };
    EXPECT_EQ(told(moved), told(here));
    EXPECT_NE(told(here).find("is free to translate along"), std::string::npos) << told(here);
  }
}

TEST(Mechanics, StiffnessOfEffectsIsTheSlopeOfTheirForces) {
  const Body body = one_box();
  const Scene scene = held_scene();
  const Problem problem{body, materials_of_parts(scene, body), {}, {}, {}, {}};
  Mechanics mechanics(problem, active_effects(scene.effects, problem));
  const State rest{std::vector<Vec3>(body.element_count(), Vec3::Zero()), 1},
      moved{random_vectors(body.element_count(), 1), 1};
  const std::vector<Vec3> before = mechanics.forces_of_effects(rest),
                          after = mechanics.forces_of_effects(moved);
  std::vector<Vec3> pulled(body.element_count());
  multiply(mechanics.stiffness_of_effects(rest), moved.displacement, pulled);
  double largest = 0;
  for (const Vec3& each : pulled) largest = std::max(largest, each.norm());
  EXPECT_GT(largest, 0);
  for (std::size_t e = 0; e < pulled.size(); ++e)
    ASSERT_LT((after[e] - before[e] + pulled[e]).norm(), 1e-12 * largest) << e;
}

}  // namespace
}  // namespace flexel::simulate
