// The words of a result: what its error bar lets them say, in at most six lines.
#include "simulate/answer.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files/json.h"
#include "simulate/summary.h"

namespace flexel::commands {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kMoved = 1.7e-3;  // m

struct Case {
  simulate::SimulateResult result;
  Body body;
  std::vector<simulate::Material> materials;

  [[nodiscard]] std::string text() const {
    std::string all;
    for (const std::string& line : answer_lines(result, body, materials)) all += line + "\n";
    return all;
  }
  [[nodiscard]] nlohmann::ordered_json strength() const {
    return parse_json(summary_json(result, body, materials))["strength"];
  }
};

// One part of steel that moves 1.7 mm under 5 N, `share` of it uncertain.
Case with_bar(double share) {
  Case made;
  Part part;
  part.name = "lever";
  part.material = "steel";
  part.lattice.spacing = Vec3::Constant(2e-3);
  part.element_end = 2;
  made.body.parts.push_back(part);
  made.body.rest = {Vec3(0, 0, 0), Vec3(0.08, 0.02, 0)};
  made.body.element_columns["von_mises"].values = {47e6, 12e6};
  simulate::Material steel;
  steel.name = "steel";
  steel.yield = 235e6;
  made.materials.push_back(steel);
  simulate::SimulateResult& result = made.result;
  result.largest_displacement = kMoved;
  result.largest_displacement_at = Vec3(0.08, 0.02, 0);
  simulate::ErrorBar bar;
  bar.of = simulate::ErrorBar::Of::largest_displacement;
  bar.value = kMoved;
  bar.bar.half_width = share * kMoved;
  result.error_bars.bars.push_back(bar);
  result.stress = simulate::StressSummary{47e6, Vec3(0, 0, 0), "lever", 0.2};
  result.reactions.push_back({"xmin", Vec3(0, 1e-9, 5), Vec3(0, 0.4, 0)});
  return made;
}

// Beside it a knob of PLA, under 20 MPa.
Case with_two_parts() {
  Case two = with_bar(0.03);
  Part knob;
  knob.name = "knob";
  knob.element_begin = 2;
  knob.element_end = 3;
  two.body.parts.push_back(knob);
  two.body.rest.emplace_back(0.01, 0, 0);
  two.body.element_columns["von_mises"].values.push_back(20e6);
  simulate::Material plastic;
  plastic.name = "PLA";
  two.materials.push_back(plastic);
  return two;
}

TEST(Answer, TheBarDecidesTheWords) {
  EXPECT_THAT(with_bar(0.03).text(), HasSubstr("1.700 mm +- 0.051 mm (3 %), at (80, 20, 0) mm"));
  EXPECT_THAT(with_bar(0.03).text(), HasSubstr("well, within 3 %"));
  EXPECT_THAT(with_bar(0.1).text(), HasSubstr("fairly, within 10 %"));
  EXPECT_THAT(with_bar(0.3).text(), HasSubstr("roughly, within 30 %"));
  const std::string guess = with_bar(0.8).text();
  EXPECT_THAT(guess, HasSubstr("no more than a first guess: 1.7 mm, could be 0.3 to 3.1 mm"));
  EXPECT_THAT(guess, HasSubstr("hardly, off by up to 80 %"));
  EXPECT_THAT(guess, Not(HasSubstr("+-")));
}

// tests/programs/accuracy_test.py has such a part.
TEST(Answer, ABarLargerThanTheValueIsNoBound) {
  const std::string guess = with_bar(2.37).text();
  EXPECT_THAT(guess, HasSubstr("no more than a first guess: 1.7 mm, could be several times as much, at"));
  EXPECT_THAT(guess, HasSubstr("hardly, its error bar is larger than the value\n"));
  EXPECT_THAT(guess, Not(HasSubstr("+-")));
}

TEST(Answer, WhatTheLatticeDoesNotResolveIsSaidBesideTheBar) {
  Case made = with_bar(0.03);
  EXPECT_THAT(made.text(), Not(HasSubstr("not counted")));
  made.body.notes["lost_walls"] = "walls of \"lever\" thinner than a cell (3 % of the places measured)\n";
  EXPECT_THAT(made.text(), HasSubstr("cells beside coarser ones; not counted: walls thinner than a cell (3 % "
                                     "of the places measured)\n"));
  made.body.notes["joined_pieces"] =
      "pieces of \"lever\" in 2 voxels taken as one\npieces of \"a\" in 3 voxels taken as one\n";
  EXPECT_THAT(made.text(), HasSubstr("measured), pieces in 2 voxels taken as one, and 1 more\n"));
}

TEST(Answer, ANarrowSupportIsNamedWhateverItsName) {
  Case made = with_bar(0.79);
  made.result.error_bars.note =
      "the support \"wall: inner\" is narrow (a strip of its area and rim is 1.45 mm wide, under two cells): "
      "the "
      "bars are three times the largest difference; use a smaller spacing";
  EXPECT_THAT(made.text(), HasSubstr("hardly, off by up to 79 %: the support \"wall: inner\" is narrow\n"));
}

TEST(Answer, WithoutABarNothingIsPromised) {
  Case bare = with_bar(0.03);
  bare.result.error_bars = {};
  EXPECT_THAT(bare.text(), HasSubstr("how sure   not known"));
  EXPECT_THAT(bare.text(), HasSubstr("how far    1.7 mm, at"));
  bare.result.error_bars.note = "part \"lever\" is one cell thick";
  EXPECT_THAT(bare.text(), HasSubstr("one cell thick"));
  EXPECT_THAT(bare.text(), HasSubstr("how far    no more than a first guess: 1.7 mm, at"));
  bare.result.timed.emplace();
  EXPECT_THAT(bare.text(), HasSubstr("runs in time have no error bars"));
}

// A twisted bar: a force along it, of second order, says nothing.
TEST(Answer, AMomentIsNamedWhereTheForceSaysLittle) {
  Case made = with_bar(0.03);
  EXPECT_THAT(made.text(), HasSubstr("held by    \"xmin\" with 5 N along +z\n"));
  made.result.reactions[0] = {"xmin", Vec3(0, 3.6e-21, 0), Vec3::Zero()};
  EXPECT_THAT(made.text(), HasSubstr("held by    \"xmin\" with no force\n"));
  simulate::Reaction& reaction = made.result.reactions[0];
  reaction.middle = Vec3(0.5, 0.2, 0);
  reaction.force = Vec3(0.6, 0, 0);
  reaction.moment = Vec3(4, 0, 0) + reaction.middle.cross(reaction.force);
  EXPECT_THAT(made.text(), HasSubstr("with 4 N m about +x and 600 mN along +x"));
  reaction.force.setZero();
  reaction.moment = Vec3(3, 4, 0);
  EXPECT_THAT(made.text(), HasSubstr("with (3, 4, 0) N m\n"));
}

// Moves give the largest displacement, exact on every lattice; what they take to be made is not.
TEST(Answer, WhereMovesDriveTheEnergyIsJudged) {
  Case made = with_bar(1e-6);
  made.result.reactions[0].is_move = true;
  simulate::ErrorBar energy;
  energy.of = simulate::ErrorBar::Of::elastic_energy;
  energy.value = 1;
  energy.bar.half_width = 0.1;
  made.result.error_bars.bars.push_back(energy);
  EXPECT_THAT(made.text(), HasSubstr("fairly, within 10 %"));
  made.result.loads.push_back({"weight", Vec3(0, 0, 1), Vec3::Zero()});
  EXPECT_THAT(made.text(), HasSubstr("fairly, within 10 %"));  // it is still the move that leads
  made.result.error_bars.bars[0].bar.half_width = 0.03 * made.result.largest_displacement;
  EXPECT_THAT(made.text(), HasSubstr("well, within 3 %"));
}

TEST(Answer, HowNearToFailing) {
  Case made = with_bar(0.03);
  EXPECT_THAT(made.text(), HasSubstr("safety factor 5: about 47 MPa of 235 MPa at which steel yields"));
  EXPECT_THAT(made.text(), HasSubstr("smaller cells may show more"));  // no bar of the stress
  made.result.error_bars.von_mises = simulate::StressBar{{47e6, 46e6, 40e6}, simulate::Bar{1e6, 47.5e6, 2}};
  EXPECT_THAT(made.text(), HasSubstr("47.0 MPa +- 1.0 MPa of 235 MPa"));
  EXPECT_THAT(made.text(), Not(HasSubstr("may show more")));
  made.body.element_columns["von_mises"].values[0] = 470e6;
  EXPECT_THAT(made.text(), HasSubstr("TOO WEAK, safety factor 0.5"));
  made.materials[0].yield = 0;
  EXPECT_THAT(made.text(), HasSubstr("strength   unknown of steel"));
  made.materials[0].strength = 940e6;
  EXPECT_THAT(made.text(), HasSubstr("safety factor 2: about 470 MPa of 940 MPa at which steel breaks"));
  made.materials[0].layer_strength = 470e6;
  EXPECT_THAT(made.text(), HasSubstr("safety factor 2 (1 across printed layers)"));
  made.result.stress->thin_walls = 0.9;
  EXPECT_THAT(made.text(), HasSubstr("strength   not known: walls under two cells thick"));
  made.materials[0].layer_strength = 400e6;  // bending would add to what is too much without it
  EXPECT_THAT(made.text(), HasSubstr("TOO WEAK across its layers"));
  made.result.stress->value = made.body.element_columns["von_mises"].values[0] = 4700e6;
  EXPECT_THAT(made.text(), HasSubstr("TOO WEAK"));
  made.result.stress.reset();  // model `paper`
  EXPECT_THAT(made.text(), HasSubstr("strength   not known"));
}

// The part with the largest stress need not be the one that fails.
TEST(Answer, TheWeakestPartCounts) {
  Case two = with_two_parts();
  EXPECT_THAT(two.text(), HasSubstr("steel yields"));
  EXPECT_THAT(two.text(), HasSubstr("unknown of PLA"));
  two.materials[1].strength = 40e6;
  EXPECT_THAT(two.text(),
              HasSubstr("safety factor 2: about 20 MPa of 40 MPa at which PLA breaks, at (10, 0, 0) mm"));
  // what lies beside the largest stress is said of that one alone, as its bar is
  two.result.stress->beside = "a bond";
  EXPECT_THAT(two.text(), HasSubstr("at (10, 0, 0) mm; smaller cells may show more\n"));
  two.result.stress->beside = "";
  two.result.error_bars.von_mises = simulate::StressBar{{47e6, 46e6, 40e6}, simulate::Bar{1e6, 47.5e6, 2}};
  EXPECT_THAT(two.text(), HasSubstr("about 20 MPa of 40 MPa"));
  EXPECT_THAT(two.text(), HasSubstr("at (10, 0, 0) mm; smaller cells may show more\n"));
}

// The largest stress is the steel's, a fifth of its limit: a program that reads on needs the other part's too.
TEST(Answer, TheSummaryHasTheWeakestPart) {
  Case two = with_two_parts();
  EXPECT_EQ(two.strength()["part"], "lever");
  EXPECT_EQ(two.strength()["unknown"], nlohmann::ordered_json({"PLA"}));
  two.materials[1].strength = 16e6;
  const nlohmann::ordered_json found = two.strength();
  EXPECT_EQ(found["share"], 1.25);
  EXPECT_EQ(found["stress"], 20e6);
  EXPECT_EQ(found["limit"], 16e6);
  EXPECT_EQ(found["limit_is"], "strength");
  EXPECT_EQ(found["part"], "knob");
  EXPECT_EQ(found["material"], "PLA");
  EXPECT_EQ(found["at"][0], 0.01);
  EXPECT_TRUE(found["unknown"].empty());
  EXPECT_EQ(found["too_weak"], nlohmann::ordered_json({"knob"}));
  EXPECT_THAT(two.text(), Not(HasSubstr("TOO WEAK too")));
  two.materials[0].yield = 30e6;
  EXPECT_EQ(two.strength()["too_weak"], nlohmann::ordered_json({"lever", "knob"}));
  EXPECT_THAT(two.text(), HasSubstr("; TOO WEAK too: \"knob\""));
  two.materials[0].yield = 235e6;
  two.materials[1].strength = 40e6;
  two.result.stress->thin_walls = 0.9;  // what is safe without bending need not be
  EXPECT_FALSE(two.strength().contains("share"));
  EXPECT_TRUE(two.strength().contains("none"));
}

TEST(Answer, AtMostSixLinesHoweverMuchThereIs) {
  Case made = with_bar(0.3);
  for (int i = 0; i < 9; ++i) {
    made.result.probes.push_back({fmt::format("p{}", i), Vec3::Zero(), Vec3(0, 0, 1e-3)});
    made.result.reactions.push_back({fmt::format("fix {}", i), Vec3(3, 4, 0), Vec3::Zero()});
  }
  const std::vector<std::string> lines = answer_lines(made.result, made.body, made.materials, "look");
  EXPECT_EQ(lines.size(), 6u);
  EXPECT_THAT(made.text(), HasSubstr("and 7 more (--verbose)"));
  EXPECT_THAT(made.text(), HasSubstr("\"xmin\" with 5 N along +z, \"fix 0\" with (3, 4, 0) N"));
  EXPECT_EQ(lines.back(), "next       look");
  for (const std::string& line : lines) EXPECT_EQ(line.find("e+"), std::string::npos) << line;
}

// Planes have no reaction: at rest they bear what the other forces lack.
TEST(Answer, PlanesBearWhatLoadsAndReactionsLack) {
  Case made = with_bar(0.03);
  made.result.loads.resize(1);
  made.result.loads[0].force = Vec3(0, 0, -8);
  made.result.imbalance = Vec3(0, 0, -3);
  EXPECT_THAT(made.text(), Not(HasSubstr("planes")));
  made.result.settled.emplace();
  made.result.settled->tolerance = 1e-5;
  EXPECT_THAT(made.text(), HasSubstr("held by    \"xmin\" with 5 N along +z, planes with 3 N along +z\n"));
  made.result.reactions.clear();
  EXPECT_THAT(made.text(), HasSubstr("held by    planes with 3 N along +z\n"));
  made.result.imbalance = Vec3(0, 0, -1e-5);
  EXPECT_THAT(made.text(), HasSubstr("held by    nothing\n"));
  made.result.imbalance = Vec3(0, 0, -3);
  for (Vec3& each : made.body.rest) each.x() += 1e4;  // far from the origin the load's moment is of its place
  made.result.loads[0].moment = made.body.rest[0].cross(made.result.loads[0].force);
  EXPECT_THAT(made.text(), HasSubstr("held by    planes with 3 N along +z\n"));
}

}  // namespace
}  // namespace flexel::commands
