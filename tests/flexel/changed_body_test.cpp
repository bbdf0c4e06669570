// What carving makes of a body and of what is drawn: the rest of both, numbered as before, and closed.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "base/error.h"
#include "flexel/clay/changed_body.h"
#include "flexel/view/view_file.h"
#include "simulate/scene/scene.h"
#include "tests/simulate/box_body.h"

namespace flexel::clay {
namespace {

using simulate::testing::box_body;
using simulate::testing::BoxOptions;

constexpr double kCell = 0.01;  // m

// Bent somehow, of PLA.
ClayDocument block(std::mt19937& random) {
  BoxOptions options;
  options.cells = {6, 5, 4};
  options.spacing = Vec3::Constant(kCell);
  ClayDocument document;
  auto body = std::make_shared<const Body>(box_body(options));
  auto number = std::make_shared<std::vector<std::uint32_t>>(body->element_count());
  std::iota(number->begin(), number->end(), 0U);
  std::uniform_real_distribution<double> any(-1e-3, 1e-3);
  auto displacement = std::make_shared<std::vector<Vec3>>();
  for (std::size_t e = 0; e < body->element_count(); ++e)
    displacement->emplace_back(any(random), any(random), any(random));
  document.start = document.now = {body, number};
  document.material = "PLA";
  document.displacement = displacement;
  return document;
}

Act ball(Act::Kind kind, const Vec3& at, double radius) {
  Act act{kind, "", {}};
  act.at = at;
  act.radius = radius;
  return act;
}

void carve(ClayDocument& document, const Vec3& at, double radius) {
  document.changes.push_back(change_text(ball(Act::Kind::carve, at, radius)));
  apply_changes(document, "");
}

Vec3 random_place(std::mt19937& random) {
  std::uniform_real_distribution<double> any(0, 1);
  return {0.06 * any(random), 0.05 * any(random), 0.04 * any(random)};
}

// By definition: a cell goes that has more than half of its elements in the ball.
std::size_t cells_left(const Body& body, const std::vector<std::pair<Vec3, double>>& balls) {
  std::size_t left = 0;
  for (const auto& corners : body.cell_elements) {
    bool gone = false;
    for (const auto& [at, radius] : balls) {
      int inside = 0;
      for (const std::uint32_t e : corners) inside += (body.rest[e] - at).norm() < radius;
      gone = gone || inside > 4;
    }
    left += !gone;
  }
  return left;
}

TEST(ChangedBody, WhatIsLeftKeepsItsNumbersAndItsPlace) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const ClayDocument first = block(random);
    ClayDocument document = first;
    std::vector<std::pair<Vec3, double>> balls;
    for (int k = 0; k < 3; ++k) {
      balls.emplace_back(random_place(random), 1.6 * kCell);
      try {
        carve(document, balls.back().first, balls.back().second);
      } catch (const InputError&) {  // nothing lies there any more
        document.changes.pop_back();
        balls.pop_back();
      }
    }
    const Body& whole = *first.now.body;
    const Body& left = *document.now.body;
    EXPECT_EQ(left.cell_count(), cells_left(whole, balls)) << trial;
    ASSERT_EQ(document.now.element->size(), left.element_count());
    ASSERT_EQ(document.displacement->size(), left.element_count());
    for (std::size_t e = 0; e < left.element_count(); ++e) {
      const std::uint32_t number = (*document.now.element)[e];
      EXPECT_EQ(left.rest[e], whole.rest[number]);
      EXPECT_EQ((*document.displacement)[e], (*first.displacement)[number]);
    }
    EXPECT_FALSE(left.element_columns.contains("number_at_start"));
  }
}

// Points where their elements carry them; volume and normals of a closed surface.
TEST(ChangedBody, WhatIsDrawnIsClosedAroundWhatIsLeft) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 8; ++trial) {
    ClayDocument document = block(random);
    carve(document, random_place(random), 1.8 * kCell);
    const Body& body = *document.now.body;
    const view::ViewFile file = view::make_live_file(body, "block");
    const view::Drawn& drawn = *file.surface;
    Vec3 closed = Vec3::Zero();
    double volume = 0;
    for (const auto& [a, b, c] : drawn.shape.triangles) {
      const Vec3 &p = drawn.shape.rest[a], &q = drawn.shape.rest[b], &r = drawn.shape.rest[c];
      closed += 0.5 * (q - p).cross(r - p);
      volume += p.dot(q.cross(r)) / 6;
    }
    EXPECT_LT(closed.norm(), 1e-9 * kCell * kCell);
    const double cell = kCell * kCell * kCell;
    EXPECT_NEAR(volume, static_cast<double>(body.cell_count()) * cell, 0.02 * cell) << trial;
    ASSERT_EQ(drawn.carriers.size(), 8 * drawn.shape.rest.size());
    for (std::size_t p = 0; p < drawn.shape.rest.size(); ++p) {
      Vec3 there = Vec3::Zero();
      for (std::size_t a = 8 * p; a < 8 * p + 8; ++a)
        there += drawn.weights[a] * body.rest[drawn.carriers[a]];
      EXPECT_LT((there - drawn.shape.rest[p]).norm(), 1e-9);
    }
    // Faces are those of the part, and one more for the walls.
    ASSERT_EQ(file.faces.size(), 7U);
    ASSERT_EQ(file.face_numbers.size(), 7U);
    EXPECT_EQ(file.face_numbers.back(), 0U);
    const auto on_wall = std::count(drawn.shape.face.begin(), drawn.shape.face.end(), 6U);
    EXPECT_GT(on_wall, 0);
    for (std::size_t t = 0; t < drawn.shape.face.size(); ++t)
      for (const std::uint32_t p : drawn.shape.triangles[t])
        if (drawn.shape.face[t] == 0) {  // "x0"
          EXPECT_NEAR(drawn.shape.rest[p].x(), 0, 1e-9);
        }
  }
}

// By definition: a cell goes that has more than half of its elements in what the ball sweeps, whatever the pieces of its way.
TEST(ChangedBody, AWayThatIsCarvedAlongHasNoGaps) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const ClayDocument first = block(random);
    const double radius = 1.3 * kCell;
    CarvedWay way{{random_place(random), random_place(random), random_place(random)}, radius};
    ClayDocument at_once = first, in_pieces = first;
    at_once.changes = {change_text({way})};
    apply_changes(at_once, "");
    CarvedWay fine{{way.path[0]}, radius};
    for (std::size_t k = 1; k < way.path.size(); ++k)
      for (int share = 1; share <= 4; ++share)
        fine.path.push_back(way.path[k - 1] + 0.25 * share * (way.path[k] - way.path[k - 1]));
    in_pieces.changes = {change_text({fine})};
    apply_changes(in_pieces, "");
    EXPECT_EQ(*at_once.now.element, *in_pieces.now.element) << trial;
    std::size_t left = 0;
    for (const auto& corners : first.now.body->cell_elements) {
      int inside = 0;
      for (const std::uint32_t e : corners) {
        double nearest = 1;
        for (std::size_t k = 1; k < way.path.size(); ++k)
          for (int share = 0; share <= 1000; ++share)
            nearest = std::min(nearest, (first.now.body->rest[e] - way.path[k - 1] -
                                         1e-3 * share * (way.path[k] - way.path[k - 1]))
                                            .norm());
        inside += nearest < radius + 1e-9;
      }
      left += inside <= 4;
    }
    EXPECT_EQ(at_once.now.body->cell_count(), left) << trial;
  }
}

TEST(ChangedBody, NothingIsRefusedAndChangesNothing) {
  std::mt19937 random(7);
  ClayDocument document = block(random);
  EXPECT_THROW(carve(document, {1, 1, 1}, kCell), InputError);
  EXPECT_EQ(document.now.body, document.start.body);
  document.changes.clear();
  EXPECT_THROW(carve(document, Vec3::Zero(), 1), InputError) << "nothing would be left";
}

TEST(ChangedBody, ChangesAreEventsOfTheScene) {
  Act glue = ball(Act::Kind::glue, {0.01, 0.02, 0.03}, 0.004);
  glue.within = 5e-4;
  ClayDocument document;
  document.material = "PLA";
  document.changes = {change_text(ball(Act::Kind::carve, {0.01, 0.02, 0.03}, 0.004)), change_text(glue)};
  document.holds = {"xmin"};
  const simulate::Scene scene = simulate::parse_scene(scene_text(document, "", true), "scene");
  ASSERT_EQ(scene.events.size(), 2U);
  EXPECT_EQ(scene.events[0].name, "carve");
  EXPECT_EQ(scene.events[1].name, "fuse");
  EXPECT_TRUE(scene.run.renormalise);
}

}  // namespace
}  // namespace flexel::clay
