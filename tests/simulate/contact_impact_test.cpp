// Impact and rest in every model that has contact: what an impact gives back, and that what touches stays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulate/effects/gravity.h"
#include "simulate/effects/rigid.h"
#include "tests/sanitized.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/contact_case.h"

namespace flexel::simulate {
namespace {

using namespace flexel::simulate::testing;

struct Case {
  Model model = Model::cells;
  bool rigid = false;
};

class ContactInEveryModel : public ::testing::TestWithParam<Case> {
 protected:
  static Body body(const std::string& name, std::array<int, 3> cells, const Vec3& origin = Vec3::Zero(),
                   const Mat3& axes = Mat3::Identity()) {
    if (GetParam().model != Model::paper) return block(name, cells, origin, axes);
    CentreOptions options;
    options.voxels = cells;
    options.spacing = kSide;
    options.origin = origin;
    options.axes = axes;
    options.name = name;
    return centre_body(options);
  }
  static Scene scene(double time, const Body& body) {
    Scene made = scene_of(time);
    made.model = GetParam().model == Model::springs ? "springs" : "";  // by placement
    if (GetParam().rigid)
      for (const Part& part : body.parts) made.get<RigidParts>().parts.push_back(part.name);
    return made;
  }
};

// Energy of motion and deformation at a row.
double energy_at(const Csv& history, std::size_t row) {
  return history.column("kinetic")[row] + history.column("elastic")[row] + history.column("potential")[row];
}

// Thrown at a plane, without damping, from soft to hard and from slow to fast: e is 1 within 1 % at the step that
// the run chooses, and at shorter ones.
TEST_P(ContactInEveryModel, AnImpactGivesBackWhatItTook) {
  for (const double young :
       less_if_sanitized<std::vector<double>>({2e4, 1e6, 1e9}, {1e6}, "one stiffness of three"))
    for (const double speed :
         less_if_sanitized<std::vector<double>>({0.1, 1.0, 3.0}, {0.1, 1.0}, "two speeds of three")) {
      if (speed > 0.03 * std::sqrt(young / kGum.density)) continue;  // it would be crushed
      for (const double finer : {1.0, 3.7}) {
        const Body thrown = body("a", {3, 3, 3});
        const double sound = std::sqrt(young / kGum.density);
        const double gap = (finer > 1 ? 0.3 : 2.7) * kSide;  // from afar, where steps are long, and from near
        Scene made = scene(gap / speed + 40 * kSide / sound, thrown);
        made.materials["gum"].young = young;
        throw_part(made, "a", Vec3(0, 0, -speed));
        made.get<Contact>().planes.push_back(plane_at(-gap));
        if (finer > 1) made.run.step = testing::run_timed(thrown, made).result.timed->step / finer;
        const TimedCase run = testing::run_timed(thrown, made);
        const std::vector<double>& stored = run.history.column("contact stored");
        ASSERT_GT(*std::max_element(stored.begin(), stored.end()), 0);
        ASSERT_EQ(stored.back(), 0) << young << " " << speed;
        const double before = energy_at(run.history, 0), after = energy_at(run.history, stored.size() - 1);
        EXPECT_NEAR(std::sqrt(after / before), 1, 0.01) << young << " " << speed << " " << finer;
        EXPECT_GT(run.history.column("momentum z").back(), 0);
      }
    }
}

// Exactly in touch with a plane and with each other, aligned and turned: nothing moves.
TEST_P(ContactInEveryModel, WhatTouchesAndIsNotPressedStays) {
  for (const double angle : {0.0, 0.4}) {
    const Mat3 axes = turn(angle, Vec3(1, 2, 3));
    const auto at = [&](double x, double y, double z) { return Vec3(kSide * (axes * Vec3(x, y, z))); };
    Body three = body("a", {3, 3, 2}, at(0, 0, 0), axes);
    append(three, body("b", {2, 3, 2}, at(0.4, -0.3, 2), axes));
    append(three, body("c", {2, 2, 4}, at(3, 0.5, 0), axes));
    Scene made = scene(0.05, three);
    made.get<Contact>().planes.push_back(plane_at(0, axes.col(2)));
    const TimedCase run = testing::run_timed(three, made);
    for (std::size_t e = 0; e < run.body.element_count(); ++e)
      ASSERT_LT((run.body.position[e] - run.body.rest[e]).norm(), 1e-9 * kSide) << angle;
  }
}

// Under its weight, with damping, it comes to rest and stays: after the first half of the run it moves by less
// than a millionth of a cell.
TEST_P(ContactInEveryModel, WhatRestsUnderItsWeightStays) {
  const Body resting = body("a", {2, 2, 2});
  Scene made = scene(less_if_sanitized(2, 1, "half the time"), resting);
  made.run.history_every = 0.2;
  made.get<Gravity>().acceleration = Vec3(0, 0, -9.81);
  made.get<Contact>().planes.push_back(plane_at(0));
  made.get<Contact>().friction = 0.3;
  made.get<Contact>().damping = 2e-4;
  Probe probe;
  probe.name = "middle";
  probe.at = Vec3::Constant(kSide);
  made.probes.push_back(probe);
  const TimedCase run = testing::run_timed(resting, made);
  const std::vector<double>& z = run.history.column("middle z");
  EXPECT_LT(z.back(), 0);
  EXPECT_NEAR(z.back(), z[z.size() / 2], 1e-6 * kSide);
}

INSTANTIATE_TEST_SUITE_P(Models, ContactInEveryModel,
                         ::testing::Values(Case{Model::cells, false}, Case{Model::springs, false},
                                           Case{Model::paper, false}, Case{Model::cells, true},
                                           Case{Model::paper, true}),
                         [](const auto& of) {
                           const char* model = of.param.model == Model::cells     ? "Cells"
                                               : of.param.model == Model::springs ? "Springs"
                                                                                  : "Paper";
                           return std::string(model) + (of.param.rigid ? "Rigid" : "");
                         });

}  // namespace
}  // namespace flexel::simulate
