// The event `resolution`: lattices, what is carried, momenta, energy, refusals. The swing of a whole program:
// tests/programs/resolution_test.py.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <numeric>

#include "base/error.h"
#include "formats/lattice/merge.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/matter/masses.h"
#include "tests/simulate/box_body.h"
#include "tests/simulate/centre_body.h"
#include "tests/simulate/stepped.h"
#include "tests/simulate/timed_case.h"

namespace flexel::simulate {
namespace {

using testing::box_body;
using testing::BoxOptions;
using testing::centre_body;
using testing::Csv;
using testing::expect_books_close;
using testing::expect_momenta_kept;
using testing::kCauchyGum;
using testing::problem_of;
using testing::run_timed;
using testing::set_velocity;
using testing::shaken;
using testing::TimedCase;
using Fields = std::vector<std::vector<Vec3>>;

Body changed_box(const Body& body, ResolutionChange to, Fields fields = {}) {
  Body made = at_resolution(body, {1}, to, fields);
  made.position = made.rest;
  made.surface = body.surface;
  check(made, "changed");
  return made;
}

BoxOptions turned_box(std::array<int, 3> cells, double spacing) {
  BoxOptions options;
  options.cells = cells;
  options.spacing = spacing * Vec3(1, 1.25, 0.75);
  options.origin = Vec3(0.3, -0.2, 0.1);
  options.axes = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  return options;
}

// With a notch and cells that are partly filled, so that rows end within it.
Body notched_lattice(std::array<int, 3> cells = {5, 3, 4}) {
  BoxOptions options = turned_box(cells, 1e-3);
  options.fill = [](int i, int j, int k) { return i == 2 && j > 0 ? 0.0 : 1.0 - 0.1 * ((i + j + k) % 3); };
  return box_body(options);
}

double mass_of(const Body& body) {
  const std::vector<double> mass = lumped_masses(problem_of(body, kCauchyGum));
  return std::accumulate(mass.begin(), mass.end(), 0.0);
}

TEST(LatticeResolution, FinerBoxIsTheBoxOfSmallerCells) {
  const Body finer = changed_box(box_body(turned_box({3, 2, 4}, 1e-3)), ResolutionChange::finer),
             small = box_body(turned_box({6, 4, 8}, 0.5e-3));
  EXPECT_EQ(finer.lattice_index, small.lattice_index);
  EXPECT_EQ(finer.piece, small.piece);
  EXPECT_EQ(finer.cell_elements, small.cell_elements);
  EXPECT_EQ(finer.fill, small.fill);
  EXPECT_EQ(finer.connections, small.connections);
  EXPECT_EQ(finer.surface_cell_offsets, small.surface_cell_offsets);
  EXPECT_EQ(finer.surface_cells, small.surface_cells);
  for (std::size_t e = 0; e < small.element_count(); ++e)
    EXPECT_LT((finer.rest[e] - small.rest[e]).norm(), 1e-15);
}

TEST(LatticeResolution, CoarserGivesBackWhatWasFiner) {
  const Body body = notched_lattice();
  const State state = shaken(body, 2e-4, 3);
  Fields fields{state.displacement, state.velocity};
  Body finer = at_resolution(body, {1}, ResolutionChange::finer, fields);
  EXPECT_EQ(finer.cell_count(), 8 * body.cell_count());
  finer.surface = body.surface;
  const Body back = at_resolution(finer, {1}, ResolutionChange::coarser, fields);
  EXPECT_EQ(back.lattice_index, body.lattice_index);
  EXPECT_EQ(back.rest, body.rest);
  EXPECT_EQ(back.cell_elements, body.cell_elements);
  EXPECT_EQ(back.surface_cells, body.surface_cells);
  EXPECT_EQ(fields[0], state.displacement);
  EXPECT_EQ(fields[1], state.velocity);
  for (std::size_t c = 0; c < body.cell_count(); ++c) EXPECT_NEAR(back.fill[c], body.fill[c], 1e-15);
}

TEST(LatticeResolution, MassStays) {
  const Body body = notched_lattice({6, 4, 2});
  const double mass = mass_of(body);
  EXPECT_NEAR(mass_of(changed_box(body, ResolutionChange::finer)), mass, 1e-13 * mass);
  const Body finer = changed_box(body, ResolutionChange::finer);
  EXPECT_NEAR(mass_of(changed_box(finer, ResolutionChange::coarser)), mass, 1e-13 * mass);
}

// Parabolas along every axis, and what is of first order in each of the three, where rows have three elements.
TEST(LatticeResolution, CurvedFieldsAreCarriedExactly) {
  const Body body = box_body(turned_box({4, 2, 3}, 1.0));
  const auto field = [](const Vec3& x) -> Vec3 {
    return {1 + x.x() * x.y() * x.z(), x.squaredNorm() - 3 * x.x() * x.y(), x.z() - 2 * x.y() * x.y()};
  };
  const auto along = [&](const Body& of, std::size_t e) {
    return of.parts[0].lattice.axes.transpose() * (of.rest[e] - of.parts[0].lattice.origin);
  };
  Fields fields(1);
  for (std::size_t e = 0; e < body.element_count(); ++e) fields[0].push_back(field(along(body, e)));
  const Body finer = at_resolution(body, {1}, ResolutionChange::finer, fields);
  for (std::size_t e = 0; e < finer.element_count(); ++e)
    EXPECT_LT((fields[0][e] - field(along(finer, e))).norm(), 1e-12);
}

TEST(LatticeResolution, OtherPartsStay) {
  Body body = notched_lattice();
  Fields fields{body.rest};
  const Body same = at_resolution(body, {0}, ResolutionChange::finer, fields);
  EXPECT_EQ(same.rest, body.rest);
  EXPECT_EQ(same.cell_elements, body.cell_elements);
  EXPECT_EQ(same.surface_cells, body.surface_cells);
  EXPECT_EQ(fields[0], body.rest);
}

// Beside one that changes: one with a broken cell, and one at centre placement, whose elements rest half a
// voxel further and whose connections no cell gives.
TEST(LatticeResolution, PartsBesideItStay) {
  for (const ResolutionChange to : {ResolutionChange::finer, ResolutionChange::coarser}) {
    BoxOptions second;
    second.name = "second";
    second.origin = Vec3(0, 0, 5);
    Body body = box_body(turned_box({4, 2, 2}, 1e-3));
    Body broken = box_body(second);
    broken.broken[1] = 1;
    derive_connections(broken);
    const std::size_t first = body.element_count(), cells = body.cell_count();
    append(body, broken);
    append(body, centre_body());
    Fields fields{body.rest};
    const Body made = at_resolution(body, {1, 0, 0}, to, fields);
    const auto tail = [](const auto& rows, std::size_t count) {
      return std::decay_t<decltype(rows)>(rows.end() - static_cast<std::ptrdiff_t>(count), rows.end());
    };
    const std::size_t others = body.element_count() - first, other_cells = body.cell_count() - cells;
    EXPECT_NE(made.element_count(), body.element_count());
    EXPECT_EQ(tail(made.rest, others), tail(body.rest, others));
    EXPECT_EQ(tail(fields[0], others), tail(body.rest, others));
    EXPECT_EQ(tail(made.connections, others), tail(body.connections, others));
    EXPECT_EQ(tail(made.piece, others), tail(body.piece, others));
    EXPECT_EQ(tail(made.broken, other_cells), tail(body.broken, other_cells));
    EXPECT_EQ(made.cell_elements.back()[7] - made.parts[1].element_begin,
              body.cell_elements.back()[7] - body.parts[1].element_begin);
  }
}

TEST(LatticeResolution, RefusesWhatMakesNoLargerCells) {
  const auto refused = [](const Body& body) {
    Fields none;
    try {
      (void)at_resolution(body, {1}, ResolutionChange::coarser, none);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused(box_body(turned_box({4, 3, 2}, 1e-3))), ::testing::HasSubstr("2 x 2 x 2"));
  // A slit of one small cell: two elements at one place, of which a larger cell has neither.
  Body slit = box_body(turned_box({2, 4, 2}, 1e-3));
  EXPECT_EQ(refused(slit), "accepted");
  const auto at = std::find(slit.lattice_index.begin(), slit.lattice_index.end(), Index3{1, 2, 1});
  const auto e = static_cast<std::uint32_t>(at - slit.lattice_index.begin());
  for (auto& corners : slit.cell_elements)
    for (std::uint32_t& corner : corners) corner += corner > e;
  const auto insert = [&](auto& rows) { rows.insert(rows.begin() + e + 1, rows[e]); };
  insert(slit.lattice_index);
  insert(slit.piece);
  slit.piece[e + 1] = 1;
  insert(slit.rest);
  insert(slit.position);
  insert(slit.connections);
  slit.parts[0].element_end += 1;
  for (auto& corners : slit.cell_elements)
    if (slit.lattice_index[corners[0]][1] >= 2)
      for (std::uint32_t& corner : corners) corner += corner == e;
  check(slit, "slit");
  EXPECT_THAT(refused(slit), ::testing::HasSubstr("slit"));
}

Scene changing_scene(const std::string& changes, const std::string& more = "",
                     const std::string& time = "2 ms") {
  return parse_scene(fmt::format(R"(material = "gum"
[materials.gum]
young = "1 MPa"
poisson = 0.3
density = "1000 kg/m3"
{}[run]
time = "{}"
{})",
                                 more, time, changes),
                     "scene.toml");
}

// `keys`: the value of "change", and lines after it.
std::string change_at(const char* at, const char* keys) {
  return fmt::format("[[event]]\nat = \"{}\"\ndo = \"resolution\"\nchange = {}\n", at, keys);
}

Body thrown_bar(unsigned seed, double amplitude) {
  BoxOptions options;
  options.cells = {6, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  options.name = "bar";
  Body body = box_body(options);
  const State state = shaken(body, amplitude, seed);
  std::vector<Vec3> velocity;
  for (std::size_t e = 0; e < body.element_count(); ++e) {
    body.position[e] += state.displacement[e];
    velocity.push_back(Vec3(1, 0.5, -2) + Vec3(30, 10, 20).cross(body.rest[e]) + 0.3 * state.velocity[e]);
  }
  set_velocity(body, velocity);
  return body;
}

// At every event, which has a row before and one after it.
void expect_momenta_kept_at_events(const Csv& history) {
  const std::vector<double>& time = history.column("time");
  std::size_t events = 0;
  for (std::size_t i = 1; i < time.size(); ++i) {
    if (time[i] != time[i - 1]) continue;
    ++events;
    for (const std::string name : {"momentum", "angular momentum"}) {
      double largest = 0;
      for (const char* axis : {" x", " y", " z"})
        largest = std::max(largest, std::abs(history.column(name + axis)[i]));
      for (const char* axis : {" x", " y", " z"})
        EXPECT_NEAR(history.column(name + axis)[i], history.column(name + axis)[i - 1], 1e-9 * largest)
            << name << axis;
    }
  }
  EXPECT_EQ(events, 2u);
}

// Whatever the state: thrown, spinning, shaken at random; by every method of stepping.
TEST(Resolution, KeepsMassAndMomenta) {
  const std::string changes = change_at("0.5 ms", "\"finer\"") + change_at("1 ms", "\"coarser\"");
  const std::array<const char*, 4> methods = {"symplectic", "verlet", "symplectic", "implicit"};
  const std::array<const char*, 4> damping = {"0 s", "20 us", "5 ms", "20 us"};  // the third in stages
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(methods[seed - 1]);
    const bool implicit = seed == 4;
    const Scene scene = changing_scene(fmt::format("method = \"{}\"\n{}{}", methods[seed - 1],
                                                   implicit ? "step = \"50 us\"\n" : "", changes),
                                       fmt::format("[damping]\ntime = \"{}\"\n", damping[seed - 1]));
    const TimedCase made = run_timed(thrown_bar(seed, 5e-4), scene);
    expect_momenta_kept_at_events(made.history);
    if (!implicit) expect_momenta_kept(made.history, 1e-9);  // Newton's method leaves residual forces
    if (!implicit) expect_books_close(made.result);
    EXPECT_EQ(made.body.cell_count(), 24u);
    EXPECT_NEAR(made.result.mass, 24e-3, 1e-15);
  }
}

// Rows of the books at the time of an event, before and after it.
std::vector<std::array<double, 2>> energies_at_events(const Csv& history) {
  std::vector<std::array<double, 2>> found;
  const auto energy = [&](std::size_t row) {
    return history.column("kinetic")[row] + history.column("elastic")[row];
  };
  const std::vector<double>& time = history.column("time");
  for (std::size_t i = 1; i < time.size(); ++i)
    if (time[i] == time[i - 1]) found.push_back({energy(i - 1), energy(i)});
  return found;
}

// A bar of four cells across, bent and let go: under 1 % at every change, which the books enter as work.
TEST(Resolution, EnergyOfABentBarStays) {
  BoxOptions options;
  options.cells = {16, 4, 4};
  options.spacing = Vec3::Constant(2.5e-3);
  options.name = "bar";
  Body body = box_body(options);
  Progress quiet("test", Progress::Mode::quiet);
  const char* bend = R"(material = "gum"
[materials.gum]
young = "1 MPa"
poisson = 0.3
density = "1000 kg/m3"
[[load]]
where = "xmax"
force = [0, 0, "30 mN"]
[[fix]]
where = "xmin"
)";
  (void)simulate(body, parse_scene(bend, "bend.toml"), {}, quiet);
  const TimedCase made = run_timed(
      body, changing_scene(change_at("1 ms", "\"finer\"\npart = \"bar\"") + change_at("4 ms", "\"coarser\"") +
                               change_at("7 ms", "\"finer\"") + change_at("8 ms", "\"coarser\""),
                           "[[fix]]\nwhere = \"xmin\"\n[damping]\ntime = \"200 us\"\n", "10 ms"));
  const auto found = energies_at_events(made.history);
  ASSERT_EQ(found.size(), 4u);
  double given = 0;
  for (const auto& [before, after] : found) {
    EXPECT_NEAR(after, before, 0.01 * before);
    given += after - before;
  }
  EXPECT_NEAR(made.history.column("events work").back(), given, 1e-5 * std::abs(given) + 1e-12);
  expect_books_close(made.result);
}

// The bar pulled by a weight from a face, and led at the other: both go on after the change.
TEST(Resolution, LoadsMovesAndProbesGoOn) {
  BoxOptions options;
  options.cells = {6, 2, 2};
  options.spacing = Vec3::Constant(1e-2);
  options.name = "bar";
  const char* acts = R"([[move]]
where = "x0"
displacement = ["2 mm", 0, 0]
[[load]]
where = "x1"
force = ["1 N", 0, 0]
[damping]
period = "20 ms"
ratio = 1
[[probe]]
name = "end"
at = ["60 mm", "5 mm", "10 mm"]
)";
  const TimedCase plain = run_timed(box_body(options), changing_scene("", acts, "100 ms")),
                  finer = run_timed(box_body(options),
                                    changing_scene(change_at("10 ms", "\"finer\""), acts, "100 ms"));
  EXPECT_EQ(finer.body.cell_count(), 8 * plain.body.cell_count());
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(finer.result.probes[0].displacement[axis], plain.result.probes[0].displacement[axis],
                0.005 * plain.result.probes[0].displacement.norm());
}

TEST(Resolution, Refuses) {
  const auto refused = [](const std::string& changes, const std::string& more = "") {
    try {
      (void)run_timed(thrown_bar(1, 0), changing_scene(changes, more));
    } catch (const InputError& error) {
      return fmt::format("{}: {}", error.where(), error.what());
    }
    return std::string("accepted");
  };
  const std::string finer = change_at("1 ms", "\"finer\"");
  EXPECT_THAT(refused(change_at("1 ms", "\"bigger\"")),
              ::testing::HasSubstr("choose \"finer\" or \"coarser\""));
  EXPECT_THAT(refused(change_at("1 ms", "\"finer\"\npart = \"bat\"")),
              ::testing::HasSubstr("did you mean \"bar\""));
  EXPECT_THAT(refused(change_at("1 ms", "\"finer\"\nevery = \"1 ms\"")), ::testing::HasSubstr("\"every\""));
  EXPECT_EQ(refused(finer, "[contact]\nself = false\n"), "accepted");
  EXPECT_THAT(refused(finer, "[contact]\nstick = \"1 kPa\"\n"), ::testing::HasSubstr("sticks"));
  EXPECT_THAT(refused(finer, "[contact]\noverlap = \"part\"\noverlap_time = \"1 ms\"\n"),
              ::testing::HasSubstr("overlap"));
  EXPECT_THAT(refused(finer, "[plasticity]\nyield = \"1 kPa\"\n"), ::testing::HasSubstr("plasticity"));
  EXPECT_THAT(refused(finer, "[fracture]\nstrength = \"1 kPa\"\n"), ::testing::HasSubstr("fracture"));
  EXPECT_THAT(refused(finer, "[parts.bar]\nmodel = \"springs\"\n"), ::testing::HasSubstr("springs"));
  EXPECT_THAT(refused(finer, "[parts.bar]\nrigid = true\n"), ::testing::HasSubstr("rigid"));
  EXPECT_THAT(refused(fmt::format("{}[[event]]\nat = \"1 ms\"\ndo = \"renormalise\"\n", finer)),
              ::testing::HasSubstr("renormalise"));
  EXPECT_THAT(refused(change_at("0 s", "\"coarser\"") + change_at("1 ms", "\"coarser\"")),
              ::testing::HasSubstr("2 x 2 x 2"));
}

// A block that has bounced goes on as it becomes finer; while it is pressed it cannot.
TEST(Resolution, GoesOnBesideContactAndNotInIt) {
  const auto landed = [](const char* at) {
    BoxOptions options;
    options.cells = {4, 4, 4};
    options.spacing = Vec3::Constant(5e-3);
    options.name = "block";
    Body body = box_body(options);
    set_velocity(body, std::vector<Vec3>(body.element_count(), Vec3(0, 0, -0.1)));
    return run_timed(body,
                     changing_scene(change_at(at, "\"finer\""),
                                    "[[plane]]\npoint = [\"0 mm\", 0, 0]\nnormal = [0, 0, 1]\n", "6 ms"));
  };
  const TimedCase made = landed("4 ms");
  expect_books_close(made.result);
  const double kinetic = made.history.column("kinetic")[0];
  EXPECT_NEAR(made.history.column("kinetic").back() + made.history.column("elastic").back(), kinetic,
              0.02 * kinetic);
  EXPECT_GT(made.history.column("momentum z").back(), 0) << "it has bounced";
  EXPECT_EQ(made.body.cell_count(), 512u);
  try {
    (void)landed("0.5 ms");
    FAIL();
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("\"block\" is pressed"));
  }
}

// A box between two layers of elements holds one more on the finer lattice, which had moved.
TEST(Resolution, RefusesSupportsThatHoldMoreThanBefore) {
  const char* fix = R"([[fix]]
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["6 mm", "21 mm", "21 mm"] } }
)";
  try {
    (void)run_timed(thrown_bar(1, 0), changing_scene(change_at("1 ms", "\"finer\""), fix));
    FAIL();
  } catch (const DivergedError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("were free"));
  }
}

}  // namespace
}  // namespace flexel::simulate
