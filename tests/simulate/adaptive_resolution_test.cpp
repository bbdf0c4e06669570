// [run] resolution = "adaptive": what is measured, what the policy decides, and runs with it. The swing of a
// whole program, checkpoints and limits: tests/programs/resolution_test.py.
#include "simulate/events/adaptive_resolution.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <random>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/matter/strain_jump.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::at_rest;
using testing::box_body;
using testing::BoxOptions;
using testing::Csv;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using testing::kCauchyGum;
using testing::run_timed;
using testing::TimedCase;

BoxOptions turned_box(std::array<int, 3> cells, double spacing) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(spacing);
  options.axes = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  options.name = "bar";
  return options;
}

// In the lattice's axes x, y, z [m]: bent about y to the curvature, to first order.
State bent(const Body& body, double curvature) {
  State state = at_rest(body);
  state.time = 0;
  const Lattice& lattice = body.parts[0].lattice;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    const Vec3 x = lattice.to_lattice(body.rest[e]).cwiseProduct(lattice.spacing);
    state.displacement[e] =
        lattice.axes * Vec3(-curvature * x.x() * x.z(), 0, 0.5 * curvature * x.x() * x.x());
  }
  return state;
}

TEST(StrainJump, IsThatOfABentBarAndHalfOfItOnHalfOfTheSpacing) {
  const Body body = box_body(turned_box({8, 2, 4}, 1e-3)), fine = box_body(turned_box({16, 4, 8}, 0.5e-3));
  const double curvature = 1e-3;  // 1/m: strain 1e-6 a cell, across the bar
  EXPECT_NEAR(strain_jumps(body, bent(body, curvature)).at(0), curvature * 1e-3, 1e-3 * curvature * 1e-3);
  EXPECT_NEAR(strain_jumps(fine, bent(fine, curvature)).at(0), curvature * 0.5e-3, 1e-3 * curvature * 1e-3);
}

// One cell across, whose middle is not strained at all.
TEST(StrainJump, SeesTheBendingOfWhatIsOneCellThick) {
  const Body body = box_body(turned_box({8, 2, 1}, 1e-3));
  EXPECT_NEAR(strain_jumps(body, bent(body, 1e-3)).at(0), 1e-6, 1e-9);
}

TEST(StrainJump, IsNothingWhereStrainIsUniformOrMatterTurns) {
  const Body body = box_body(turned_box({3, 4, 2}, 1e-3));
  State state = at_rest(body);
  const Mat3 turn = Eigen::AngleAxisd(2, Vec3(3, -1, 2).normalized()).toRotationMatrix();
  const Mat3 stretch = Vec3(1.2, 0.9, 1.05).asDiagonal();
  for (std::size_t e = 0; e < body.element_count(); ++e)
    state.displacement[e] = turn * stretch * body.rest[e] - body.rest[e];
  EXPECT_LT(strain_jumps(body, state).at(0), 1e-13);
}

TEST(StrainJump, BrokenCellsAreLeftOut) {
  Body body = box_body(turned_box({4, 1, 1}, 1e-3));
  State state = at_rest(body);
  for (std::size_t e = 0; e < body.element_count(); ++e)
    if (body.lattice_index[e][0] == 4) state.displacement[e] = Vec3(1e-4, 0, 0);
  EXPECT_GT(strain_jumps(body, state).at(0), 0.01);
  body.broken[3] = 1;
  EXPECT_EQ(strain_jumps(body, state).at(0), 0);
}

TEST(AdaptiveResolution, ElementsOfAFinerPartAreCountedAsTheyWillBe) {
  BoxOptions options = turned_box({5, 3, 4}, 1e-3);
  options.fill = [](int i, int j, int k) { return i == 2 && j > 0 ? 0.0 : 1.0 - 0.1 * ((i + j + k) % 3); };
  for (const Body& body :
       {box_body(options), box_body(turned_box({1, 1, 1}, 1e-3)), box_body(turned_box({7, 2, 3}, 1e-3))}) {
    std::vector<std::vector<Vec3>> none;
    EXPECT_EQ(finer_element_count(body, body.parts[0]),
              at_resolution(body, {1}, ResolutionChange::finer, none).element_count());
  }
}

// What the policy has made of a part's level, from memory().
int level_of(const AdaptiveResolution& policy) {
  return static_cast<int>(policy.memory().at(2));
}

// Whatever bends the bar and comes near it: after a change none back within the least time, and levels within
// bounds.
TEST(AdaptiveResolution, DoesNotFlicker) {
  const Body body = box_body(turned_box({6, 2, 2}, 1e-3));
  const Problem problem = testing::problem_of(body, kCauchyGum);
  Progress quiet("test", Progress::Mode::quiet);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 1);
  for (int kind = 0; kind < 3; ++kind) {
    AdaptiveSettings settings;
    settings.least_time = 0.1;
    settings.finest = 2;
    settings.coarsest = 1;
    AdaptiveResolution policy(settings, body, 10);
    int level = 0, changes = 0;
    double changed = -1;
    bool was_coarser = false;
    for (double time = 0; time < 10; time += 0.01 * any(random)) {
      State state = bent(body, (kind == 1 ? std::max(0.0, std::pow(std::sin(3 * time), 8) - 0.1)
                                          : any(random) * (any(random) < 0.1)) *
                                   20);
      state.time = time;
      std::vector<PartTouch> touches(1);
      if (kind == 2 && any(random) < 0.05) touches[0].gap = touches[0].soon = 1e-4;
      const bool due = policy.look(problem, state, touches, quiet);
      EXPECT_EQ(policy.take_due().size(), due ? 1u : 0u);
      const int now = level_of(policy);
      EXPECT_LE(std::abs(now - level), 1);
      EXPECT_TRUE(now >= -1 && now <= 2) << now;
      EXPECT_EQ(now != level, due);
      if (!due) continue;
      const bool coarser = now < level;
      if (changes > 0 && (coarser || was_coarser)) {
        EXPECT_GE(time - changed, 0.1 * (1 - 1e-12));
      }
      was_coarser = coarser;
      changed = time;
      level = now;
      ++changes;
    }
    EXPECT_GT(changes, 5) << kind;
  }
}

// A checkpoint's memory gives the same decisions.
TEST(AdaptiveResolution, GoesOnFromItsMemory) {
  const Body body = box_body(turned_box({6, 2, 2}, 1e-3));
  const Problem problem = testing::problem_of(body, kCauchyGum);
  Progress quiet("test", Progress::Mode::quiet);
  AdaptiveSettings settings;
  settings.coarsest = 1;
  AdaptiveResolution whole(settings, body, 1), resumed(settings, body, 1);
  int changes = 0;
  for (int n = 0; n < 400; ++n) {
    State state = bent(body, 10 * std::max(0.0, std::pow(std::sin(0.05 * n), 8) - 0.1));
    state.time = 0.0025 * n;
    const bool due = whole.look(problem, state, std::vector<PartTouch>(1), quiet);
    EXPECT_EQ(resumed.look(problem, state, std::vector<PartTouch>(1), quiet), due);
    EXPECT_EQ(whole.take_due().size(), resumed.take_due().size());
    changes += due;
    AdaptiveResolution next(settings, body, 1);
    next.restore(resumed.memory());
    resumed = std::move(next);
  }
  EXPECT_GT(changes, 4);
  EXPECT_EQ(whole.memory(), resumed.memory());
  EXPECT_THROW(whole.restore({1, 2}), InputError);
}

// Room that lacked once is not asked for again until the body has fewer elements, in a resumed run as in the whole one.
TEST(AdaptiveResolution, RemembersThatThereWasNoRoom) {
  const Body body = box_body(turned_box({8, 2, 4}, 1e-3));
  const Problem problem = testing::problem_of(body, kCauchyGum);
  Progress quiet("test", Progress::Mode::quiet);
  AdaptiveSettings settings;
  settings.most_elements = static_cast<double>(body.element_count()) + 1;
  AdaptiveResolution whole(settings, body, 1);
  State state = bent(body, 1e4 * settings.strain_jump);
  state.time = 0;
  EXPECT_FALSE(whole.look(problem, state, std::vector<PartTouch>(1), quiet));
  // What allows more asks whether the memory holds: the whole run does not look for room again.
  settings.most_elements.reset();
  AdaptiveResolution resumed(settings, body, 1), anew(settings, body, 1);
  resumed.restore(whole.memory());
  state.time = 0.1;
  EXPECT_TRUE(anew.look(problem, state, std::vector<PartTouch>(1), quiet));
  EXPECT_FALSE(resumed.look(problem, state, std::vector<PartTouch>(1), quiet));
  std::vector<double> older = whole.memory();  // as checkpoints had it before
  older.pop_back();
  AdaptiveResolution from_older(settings, body, 1);
  from_older.restore(older);
  EXPECT_TRUE(from_older.look(problem, state, std::vector<PartTouch>(1), quiet));
}

// What is pressed stays: its contacts would store another energy.
TEST(AdaptiveResolution, APressedPartStays) {
  const Body body = box_body(turned_box({6, 2, 2}, 1e-3));
  const Problem problem = testing::problem_of(body, kCauchyGum);
  Progress quiet("test", Progress::Mode::quiet);
  AdaptiveResolution policy({}, body, 1);
  State state = bent(body, 5);
  std::vector<PartTouch> touches{{-1e-5, -1e-5, 1}};
  EXPECT_FALSE(policy.look(problem, state, touches, quiet)) << "it stores more than the bar does";
  state.time = 0.1;
  touches[0] = {-3e-4, -3e-4, 1e-12};
  EXPECT_FALSE(policy.look(problem, state, touches, quiet)) << "it is deep";
  state.time = 0.2;
  touches[0] = {-1e-5, -1e-5, 1e-12};
  EXPECT_TRUE(policy.look(problem, state, touches, quiet));
}

// By its narrowest spacing, as events refuse it: else the run would end where it could wait.
TEST(AdaptiveResolution, APressedPartOfLongCellsStays) {
  BoxOptions options = turned_box({6, 2, 2}, 1e-3);
  options.spacing = Vec3(3e-3, 1e-3, 1e-3);
  const Body body = box_body(options);
  const Problem problem = testing::problem_of(body, kCauchyGum);
  Progress quiet("test", Progress::Mode::quiet);
  AdaptiveResolution policy({}, body, 1);
  State state = bent(body, 5);
  EXPECT_FALSE(policy.look(problem, state, {{-1.1e-4, -1.1e-4, 1e-12}}, quiet));
  state.time = 0.1;
  EXPECT_TRUE(policy.look(problem, state, {{-0.9e-4, -0.9e-4, 1e-12}}, quiet));
}

Scene adaptive_scene(const std::string& adaptive, const std::string& more, const std::string& run) {
  return parse_scene(
      fmt::format("material = \"gum\"\n[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.3\n"
                  "density = \"1000 kg/m3\"\n{}[adaptive]\n{}[run]\nresolution = \"adaptive\"\n{}",
                  more, adaptive, run),
      "scene.toml");
}

Body bar_of(std::array<int, 3> cells, double spacing) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = Vec3::Constant(spacing);
  options.name = "bar";
  return box_body(options);
}

// Times at which the books have two rows: those of changes.
std::vector<std::size_t> rows_of_changes(const Csv& history) {
  const std::vector<double>& time = history.column("time");
  std::vector<std::size_t> rows;
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] == time[i - 1]) rows.push_back(i);
  return rows;
}

// Thrown, spinning and bent, undamped and then damped to rest: finer and coarser, by several methods.
TEST(AdaptiveResolution, KeepsMassAndMomenta) {
  for (const char* method : {"symplectic", "verlet", "implicit"}) {
    SCOPED_TRACE(method);
    const bool implicit = std::string(method) == "implicit";
    Body body = bar_of({8, 2, 2}, 5e-3);
    std::vector<Vec3> velocity;
    for (std::size_t e = 0; e < body.element_count(); ++e) {
      const Vec3& x = body.rest[e];
      velocity.push_back(Vec3(1, 0.5, -2) + Vec3(0, 0, 2).cross(x) +
                         Vec3(0, 0, 2e3 * (x.x() - 0.02) * (x.x() - 0.02)));
    }
    testing::set_velocity(body, velocity);
    const TimedCase made =
        run_timed(body, adaptive_scene("strain_jump = 0.004\nleast_time = \"2 ms\"\ncoarsest = 1\n",
                                       "[damping]\ntime = \"400 us\"\n",
                                       fmt::format("time = \"30 ms\"\nmethod = \"{}\"\n{}", method,
                                                   implicit ? "step = \"100 us\"\n" : "")));
    EXPECT_GE(rows_of_changes(made.history).size(), 2u);
    if (!implicit) expect_momenta_kept(made.history, 1e-9);  // Newton's method leaves residual forces
    if (!implicit) expect_books_close(made.result);
    EXPECT_NEAR(made.result.mass, 4e-3, 1e-15);
  }
}

// Held at one end: coarser where nothing happens, and finer than it came after a blow.
TEST(AdaptiveResolution, ACalmSwingIsCoarseAndAStruckOneFine) {
  const char* held = "[[fix]]\nwhere = \"xmin\"\n[damping]\ntime = \"300 us\"\n";
  const std::string settings = "strain_jump = 0.005\nleast_time = \"8 ms\"\ncoarsest = 1\n";
  const TimedCase calm =
      run_timed(bar_of({8, 2, 2}, 5e-3), adaptive_scene(settings, held, "time = \"20 ms\"\n"));
  EXPECT_EQ(calm.body.cell_count(), 4u);
  const std::string blow =
      "[[load]]\nwhere = \"xmax\"\nforce = [0, 0, \"0.3 N\"]\ntime = [\"0 s\", \"12 ms\", \"13 ms\", \"16 "
      "ms\"]\nfactor = [0, 0, 1, 0]\n";
  const TimedCase struck =
      run_timed(bar_of({8, 2, 2}, 5e-3), adaptive_scene(settings, held + blow, "time = \"30 ms\"\n"));
  EXPECT_EQ(struck.body.cell_count(), 256u);
  const std::vector<std::size_t> rows = rows_of_changes(struck.history);
  ASSERT_EQ(rows.size(), 3u) << "coarse, as it came, finer";
  EXPECT_NEAR(struck.history.column("time")[rows[0]], 10e-3, 2.5e-3);
  EXPECT_GT(struck.history.column("time")[rows[1]], 12e-3);
}

const char* const kFloor = "[[plane]]\npoint = [\"0 mm\", \"0 mm\", \"-4 mm\"]\nnormal = [0, 0, 1]\n";

const std::string kDampedFloor = std::string(kFloor) + "[damping]\ntime = \"200 us\"\n";

TimedCase dropped(const std::string& adaptive, double speed, int threads = 0, double spacing = 5e-3) {
  const int cells = static_cast<int>(std::lround(2e-2 / spacing));
  Body body = bar_of({cells, cells, cells}, spacing);
  testing::set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(0, 0, -speed)));
  SimulateOptions options;
  options.threads = threads;
  return run_timed(body,
                   adaptive_scene(adaptive, kDampedFloor, fmt::format("time = \"{} ms\"\n", 12 + 12 / speed)),
                   options);
}

// It becomes finer before it presses, at any speed, and coarse again when it has left the floor.
TEST(AdaptiveResolution, ABlowIsMetByFinerCells) {
  for (const double speed : {0.3, 1.0, 4.0}) {
    SCOPED_TRACE(speed);
    const TimedCase made = dropped("strain_jump = 0.5\nleast_time = \"2 ms\"\n", speed);
    const std::vector<std::size_t> rows = rows_of_changes(made.history);
    ASSERT_FALSE(rows.empty());
    const std::vector<double>& stored = made.history.column("contact stored");
    const double largest = *std::max_element(stored.begin(), stored.end());
    EXPECT_GT(largest, 0);
    for (std::size_t i = 0; i <= rows[0]; ++i) EXPECT_LT(stored[i], 1e-3 * largest);
    const TimedCase fine = dropped("strain_jump = 1e9\ncontact = false\n", speed, 0, 2.5e-3);
    EXPECT_TRUE(rows_of_changes(fine.history).empty());
    EXPECT_LT(testing::book(made.result, "worst_residual"), 2 * testing::book(fine.result, "worst_residual"));
    EXPECT_EQ(rows.size(), 2u);
    EXPECT_EQ(made.body.cell_count(), 64u);
  }
}

TEST(AdaptiveResolution, IsTheSameOnAnyNumberOfThreads) {
  const TimedCase one = dropped("least_time = \"2 ms\"\n", 1, 1),
                  three = dropped("least_time = \"2 ms\"\n", 1, 3);
  EXPECT_EQ(one.body.position, three.body.position);
  EXPECT_EQ(one.history.column("time"), three.history.column("time"));
}

// Of two blocks there is room for one that is finer.
TEST(AdaptiveResolution, StaysWithinItsBounds) {
  Body body = bar_of({4, 4, 4}, 5e-3);
  BoxOptions second;
  second.cells = {4, 4, 4};
  second.spacing = Vec3::Constant(5e-3);
  second.origin = Vec3(0.1, 0, 0);
  second.name = "second";
  append(body, box_body(second));
  testing::set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(0, 0, -1)));
  const auto elements = [&](const std::string& most) {
    return run_timed(body, adaptive_scene("least_time = \"1 s\"\n" + most, kFloor, "time = \"6 ms\"\n"))
        .body.element_count();
  };
  EXPECT_EQ(elements(""), 2 * 729u);
  EXPECT_EQ(elements("max_elements = 1457\n"), 729u + 125u);
  EXPECT_EQ(elements("parts = [\"second\"]\n"), 729u + 125u);
  EXPECT_EQ(elements("parts = [\"second\"]\nfinest = 2\n"), 4913u + 125u);
  const TimedCase coarse = dropped("strain_jump = 0.5\nfinest = 0\ncoarsest = 1\nleast_time = \"1 ms\"\n", 1);
  EXPECT_EQ(coarse.body.cell_count(), 8u);
}

// While nothing changes it is the run of a scene that does not ask for it.
TEST(AdaptiveResolution, LooksWithoutATrace) {
  const std::string load = "[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = \"xmax\"\nforce = [0, 0, \"1 N\"]\n";
  const Scene adaptive = adaptive_scene("strain_jump = 1e9\n", load + kFloor, "time = \"20 ms\"\n");
  Scene fixed = adaptive;
  fixed.run.adaptive.reset();
  EXPECT_EQ(run_timed(bar_of({8, 2, 2}, 5e-3), adaptive).body.position,
            run_timed(bar_of({8, 2, 2}, 5e-3), fixed).body.position);
}

TEST(AdaptiveResolution, RefusesByName) {
  const auto refused = [](const std::string& adaptive, const std::string& more = "",
                          const std::string& run = "time = \"1 ms\"\n") {
    try {
      (void)run_timed(bar_of({2, 2, 2}, 5e-3), adaptive_scene(adaptive, more, run));
    } catch (const InputError& error) {
      return fmt::format("{}: {}", error.where(), error.what());
    }
    return std::string("accepted");
  };
  using ::testing::HasSubstr;
  EXPECT_EQ(refused(""), "accepted");
  EXPECT_THAT(refused("strain_jump = 0\n"), HasSubstr("scene.toml"));
  EXPECT_THAT(refused("calm = 0.6\n"), HasSubstr("at most 0.5"));
  EXPECT_THAT(refused("finest = 0\n"), HasSubstr("both 0"));
  EXPECT_THAT(refused("finest = 5\n"), HasSubstr("whole number from 0 to 4"));
  EXPECT_THAT(refused("least_time = \"0 s\"\n"), HasSubstr("above 0"));
  EXPECT_THAT(refused("parts = []\n"), HasSubstr("list of names"));
  EXPECT_THAT(refused("parts = [\"bat\"]\n"), HasSubstr("bat"));
  EXPECT_THAT(refused("coarsest = 2\n"), HasSubstr("2 x 2 x 2"));
  EXPECT_THAT(refused("max_elements = 30\n"), HasSubstr("\"max_elements\" allows 30"));
  // "finest" = 0 would not do: alone it leaves nothing to change
  EXPECT_THAT(refused("max_elements = 30\n"), HasSubstr("leave \"resolution\" out"));
  EXPECT_THAT(refused("", "[plasticity]\nyield = \"1 kPa\"\n"), HasSubstr("plasticity"));
  EXPECT_THAT(refused("", "[fracture]\nstrength = \"1 kPa\"\n"), HasSubstr("fracture"));
  EXPECT_THAT(refused("", "[parts.bar]\nmodel = \"springs\"\n"), HasSubstr("springs"));
  EXPECT_THAT(refused("", "[parts.bar]\nrigid = true\n"), HasSubstr("rigid"));
  EXPECT_THAT(refused("", "[contact]\nstick = \"1 kPa\"\n"), HasSubstr("stick"));
  EXPECT_THAT(refused("", "[contact]\noverlap = \"part\"\noverlap_time = \"1 ms\"\n"), HasSubstr("overlap"));
  EXPECT_THAT(refused("", "[[event]]\nat = \"0 s\"\ndo = \"renormalise\"\n"), HasSubstr("renormalise"));
  EXPECT_THAT(refused("", "", ""), HasSubstr("timed runs"));
}

}  // namespace
}  // namespace flexel::simulate
