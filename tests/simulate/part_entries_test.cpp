// Entries of a scene for one part, an assembly or every part: which goes before which.
#include "simulate/effects/part_entries.h"

#include <gtest/gtest.h>

#include <random>

#include "base/error.h"
#include "simulate/effects/damping.h"
#include "simulate/effects/fracture.h"
#include "simulate/effects/plasticity.h"
#include "simulate/scene/scene.h"
#include "simulate/thermal/free_strain.h"
#include "simulate/thermal/thermal.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/stepped.h"

namespace flexel::simulate {
namespace {

// (parts) Of a gearbox with a shaft in it: name, and the assemblies around it.
const std::vector<std::pair<std::string, std::string>> kGearbox = {{"housing", "gearbox"},
                                                                   {"lid", "gearbox"},
                                                                   {"rod", "gearbox/shaft"},
                                                                   {"key", "gearbox/shaft"},
                                                                   {"table", ""}};

// One box; the parts after the first have no elements.
Body gearbox() {
  Body body = testing::box_body();
  body.parts.resize(kGearbox.size(), body.parts[0]);
  body.surface.parts.resize(kGearbox.size());
  for (std::size_t p = 0; p < kGearbox.size(); ++p) {
    Part& part = body.parts[p];
    part.name = body.surface.parts[p].name = kGearbox[p].first;
    body.surface.parts[p].assembly = kGearbox[p].second;
    if (p == 0) continue;
    part.element_begin = part.element_end;
    part.cell_begin = part.cell_end;
  }
  return body;
}

struct Entry {
  double value = 0;
  std::optional<std::string> part;
  std::string origin = "scene.toml:1";
};

// (parts) What of the entries is left.
std::vector<double> taken_over(const std::vector<Entry>& entries, const Body& body) {
  std::vector<double> value(body.parts.size());
  for (const auto& [entry, parts] : entries_of_parts(entries, body))
    for (const std::uint32_t p : parts) value[p] = entry->value;
  return value;
}

TEST(PartEntries, TheNarrowestCountsAndOfEqualsTheLast) {
  const Body body = gearbox();
  // name, and how wide it is
  const std::vector<std::pair<std::optional<std::string>, std::size_t>> kNames = {
      {std::nullopt, 100}, {"gearbox", 4}, {"shaft", 2}, {"gearbox/shaft", 2}, {"shaft/key", 1},
      {"housing", 0},      {"lid", 0},     {"rod", 0},   {"key", 0},           {"table", 0}};
  std::mt19937 random(7);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Entry> entries;
    std::vector<double> expected(body.parts.size());
    std::vector<std::size_t> width(body.parts.size(), 1000);
    for (int n = 0; n < 6; ++n) {
      const auto& [name, its] = kNames[random() % kNames.size()];
      entries.push_back({n + 1.0, name});
      for (std::size_t p = 0; p < body.parts.size(); ++p) {
        const std::string path = "/" + kGearbox[p].second + "/" + kGearbox[p].first + "/";
        const bool meant = !name || path.find("/" + *name + "/") != std::string::npos;
        if (!meant || its > width[p]) continue;
        width[p] = its;
        expected[p] = n + 1;
      }
    }
    EXPECT_EQ(taken_over(entries, body), expected) << "trial " << trial;
  }
}

TEST(PartEntries, OfAPartThatIsNotThereAreRefused) {
  const Body body = gearbox();
  try {
    (void)taken_over({{1, "shafd"}}, body);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("the body has no part \"shafd\""), std::string::npos)
        << error.what();
  }
}

// Own, assembly's and everything's, in each order: the part's own wins in it, the assembly's in the others of it.
TEST(PartEntries, EveryEffectTakesThemInThatOrder) {
  const Body body = gearbox();
  const Material steel{"steel", 200e9, 0.3, 7850, "test"};
  const Problem problem = testing::problem_of(body, steel);
  std::vector<Entry> order = {{1, std::nullopt}, {2, "shaft"}, {3, "key"}};
  const std::vector<double> expected = {1, 1, 2, 3, 1};
  const auto less = [](const Entry& a, const Entry& b) { return a.value < b.value; };
  do {
    Damping::Parameters damping;
    Plasticity::Parameters plasticity;
    Fracture::Parameters fracture;
    ThermalSettings heat;
    for (const Entry& each : order) {
      damping.entries.push_back({each.value, each.part, each.origin});
      Plasticity::Entry flow;
      flow.yield = each.value;
      flow.part = each.part;
      plasticity.entries.push_back(flow);
      Fracture::Entry strength;
      strength.strength = each.value;
      strength.part = each.part;
      fracture.entries.push_back(strength);
      TemperatureChange change;
      change.change = each.value;
      change.part = each.part;
      heat.changes.push_back(change);
      Shrinkage shrinkage;
      shrinkage.layer = 1;
      shrinkage.along = -1e-3 * each.value;
      shrinkage.part = each.part;
      heat.shrinkages.push_back(shrinkage);
    }
    KernelEffects plan;
    Damping::make(damping, problem)->configure_kernel(plan);
    Plasticity::make(plasticity, problem)->configure_kernel(plan);
    Fracture::make(fracture, problem)->configure_kernel(plan);
    const FreeStrain strain(body, heat, std::vector<Material>(body.parts.size(), steel));
    const double expansion = *library_thermal_figures("steel").expansion;
    for (std::uint32_t p = 0; p < body.parts.size(); ++p) {
      EXPECT_EQ(plan.damping[p], expected[p]) << "damping of part " << p;
      EXPECT_EQ(plan.plasticity[p].yield, expected[p]) << "plasticity of part " << p;
      EXPECT_EQ(plan.fracture[p].strength, expected[p]) << "fracture of part " << p;
      const Mat3 e = strain.at(p, 0, Vec3::Constant(0.5));
      EXPECT_NEAR(e(0, 0), expansion * expected[p], 1e-12) << "change of temperature of part " << p;
      EXPECT_NEAR(e(2, 2) - e(0, 0), -1e-3 * expected[p], 1e-12) << "shrinkage of part " << p;
    }
  } while (std::next_permutation(order.begin(), order.end(), less));
}

}  // namespace
}  // namespace flexel::simulate
