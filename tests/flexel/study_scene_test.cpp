// Scenes as the runs of a study want them.
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "flexel/study/runs/history_csv.h"
#include "flexel/study/runs/scene_edit.h"
#include "simulate/scene/scene.h"

namespace flexel::study {
namespace {

constexpr const char* kFallScene = R"(material = "steel"
[parts.lid]
hooke = "ganovelli"
model = "paper"
[[fix]]
where = "xmin"
[[load]]
name = "hand"
where = "xmax"
force = ["0 N", "0 N", "-100 N"]
[[load]]
where = { box = { min = [0, 0, 0], max = ["1 mm", "1 mm", "1 mm"] } }
force = ["1 N", 0, 0]
[gravity]
acceleration = [0, 0, "-9.81 m/s2"]
[[event]]
at = "1 ms"
do = "add"
body = "drop.vtu"
[[probe]]
name = "tip"
where = "xmax"
[run]
time = "2 ms"
step = "1 us"
)";

TEST(StudyScene, FactsAreTheScenes) {
  const study::SceneFacts facts = scene_facts(kFallScene, "s.toml");
  EXPECT_TRUE(facts.timed);
  EXPECT_DOUBLE_EQ(facts.duration, 2e-3);
  EXPECT_EQ(facts.integrator, "symplectic");
  EXPECT_EQ(facts.model, "paper");
  EXPECT_EQ(facts.probes, std::vector<std::string>{"tip"});
  std::vector<std::string> names;
  for (const study::SceneEffect& effect : facts.effects) names.push_back(effect.name);
  EXPECT_EQ(names, (std::vector<std::string>{"gravity", "load 1 (hand)", "load 2", "event"}));
}

TEST(StudyScene, EditsAreReadByTheSimulation) {
  study::Configuration wanted;
  wanted.model = "springs";
  wanted.integrator = "verlet";
  wanted.step = 2.5e-7;
  wanted.tolerance = 1e-4;
  const simulate::Scene scene =
      simulate::parse_scene(edited_scene(kFallScene, "s.toml", "/a", {"lid", "box"}, wanted), "s.toml");
  EXPECT_EQ(scene.parts.at("lid").model, "springs");
  EXPECT_EQ(scene.parts.at("lid").hooke, "");
  EXPECT_EQ(scene.parts.at("box").model, "springs");
  EXPECT_EQ(scene.run.method, simulate::TimeMethod::verlet);
  EXPECT_DOUBLE_EQ(*scene.run.step, 2.5e-7);
  EXPECT_DOUBLE_EQ(scene.run.tolerance, 1e-4);
  EXPECT_EQ(scene.get<simulate::Loads>().loads.size(), 2u);
}

TEST(StudyScene, NothingChangedIsTheSameScene) {
  const simulate::Scene scene =
      simulate::parse_scene(edited_scene(kFallScene, "s.toml", "/a", {"lid"}, {}), "s.toml");
  EXPECT_EQ(scene.parts.at("lid").model, "paper");
  EXPECT_EQ(scene.parts.at("lid").hooke, "ganovelli");
  EXPECT_DOUBLE_EQ(*scene.run.step, 1e-6);
}

TEST(StudyScene, OneEffectIsLeftOut) {
  for (const study::SceneEffect& effect : scene_facts(kFallScene, "s.toml").effects) {
    study::Configuration wanted;
    wanted.without = effect.name;
    const std::string text = edited_scene(kFallScene, "s.toml", "/a", {}, wanted);
    const std::size_t before = scene_facts(kFallScene, "s.toml").effects.size();
    EXPECT_EQ(scene_facts(text, "s.toml").effects.size(), before - 1) << effect.name;
  }
  study::Configuration wanted;
  wanted.without = "load 2";
  const simulate::Scene scene =
      simulate::parse_scene(edited_scene(kFallScene, "s.toml", "/a", {}, wanted), "s.toml");
  ASSERT_EQ(scene.get<simulate::Loads>().loads.size(), 1u);
  EXPECT_EQ(scene.get<simulate::Loads>().loads[0].name, "hand");
  wanted.without = "drag";
  EXPECT_THROW((void)edited_scene(kFallScene, "s.toml", "/a", {}, wanted), InputError);
}

TEST(StudyScene, FilesStayThoseOfTheScene) {
  EXPECT_NE(edited_scene(kFallScene, "s.toml", "/a/b", {}, {}).find("/a/b/drop.vtu"), std::string::npos);
}

TEST(StudyHistory, AShiftedMotionLagsByTheShift) {
  std::vector<double> time, reference, motion;
  const double shift = 0.0123;
  for (int i = 0; i <= 1000; ++i) {
    const double t = 1e-3 * i;
    time.push_back(t);
    reference.push_back(1 - std::cos(9 * t));
    motion.push_back(1 - std::cos(9 * (t - shift)));
  }
  EXPECT_NEAR(*lag(time, motion, time, reference), shift, 1e-5);
  EXPECT_NEAR(*lag(time, reference, time, motion), -shift, 1e-5);
  EXPECT_NEAR(*lag(time, reference, time, reference), 0, 1e-6);
  const std::vector<double> still(time.size(), 0.0);
  EXPECT_FALSE(lag(time, motion, time, still));
}

// A probe of a part that comes later has no number before: nan in the history.
TEST(StudyScene, ThePeakIsOfTheRowsThatHaveANumber) {
  const double none = std::nan("");
  EXPECT_EQ(*peak({none, none, 2, 3, 1}), 3);
  EXPECT_EQ(*peak({1, 2}), 2);
  EXPECT_FALSE(peak({none, none}));
  EXPECT_FALSE(peak({}));
}

}  // namespace
}  // namespace flexel::study
