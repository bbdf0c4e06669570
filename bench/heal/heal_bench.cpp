// Damages clean parts at random and compares the lattice's volume with that of the clean part:
//   bench_heal [PART...] [--runs 200] [--first 0] [--count 8000] [--verbose]
// Without parts: a torus, a ball with a void and a fork, made here. Ends with 1 when a result was silently
// wrong, by more than 5 % of the volume.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <cstring>

#include "base/error.h"
#include "formats/exchange/import.h"
#include "tests/voxelize/damage.h"
#include "voxelize/heal/heal.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

struct Clean {
  std::string name;
  Mesh mesh;
  double size = 0, volume = 0;
};

Mesh mesh_of(const std::string& file) {
  const Surface surface = import_surface(file, {});
  return {surface.vertices, triangulate(surface).corners};
}

double total(const voxelize::VoxelizeResult& result) {
  return result.parts[0].lattice_volume + result.parts[0].dropped_volume;
}

Clean clean(const std::string& name, const Mesh& mesh, std::size_t count) {
  Clean result{name, mesh, 0, 0};
  Progress progress("bench", Progress::Mode::quiet);
  voxelize::VoxelizeOptions options;
  options.count = count;
  options.align = voxelize::Align::none;
  options.max_memory = 1e12;
  const voxelize::VoxelizeResult voxels = voxelize(surface(mesh), options, progress);
  result.size = voxels.parts[0].spacing.x();
  result.volume = total(voxels);
  return result;
}

struct Row {
  int runs = 0, refused = 0, tenth = 0, one = 0, five = 0, worse = 0;
  double seconds = 0, largest = 0;
};

void judge(const Clean& part, int kind, int run, bool verbose, Row& row) {
  std::mt19937 random(static_cast<unsigned>(run) * 2654435761u);
  // The first rounds are as the acceptance test has it, then ever worse.
  const double degree = run / kDamageCount < 3 ? 0 : std::uniform_real_distribution<double>(0, 1)(random);
  const Mesh damaged = Damager(part.mesh, static_cast<unsigned>(random())).damaged(kind, degree);
  const auto start = std::chrono::steady_clock::now();
  std::string outcome;
  ++row.runs;
  try {
    const voxelize::VoxelizeResult result = shapes::run(damaged, part.size);
    const double difference = total(result) / part.volume - 1, error = std::abs(difference);
    ++(error <= .001 ? row.tenth : error <= .01 ? row.one : error <= .05 ? row.five : row.worse);
    row.largest = std::max(row.largest, error);
    constexpr const char* kBy[] = {"surface", "vote", "flood"};
    outcome =
        fmt::format("{:+.3g} % by {}", 100 * difference, kBy[static_cast<int>(result.parts[0].healing.by)]);
    for (const std::string& line : healing_lines(result.parts[0].healing)) outcome += "; " + line;
  } catch (const InputError& error) {
    ++row.refused;
    outcome = error.what();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  row.seconds += seconds;
  if (verbose)
    fmt::print("{:4} {} {} {:.2f}: {} ({:.1f} s)\n", run, part.name, kDamages[kind], degree, outcome,
               seconds);
  std::fflush(stdout);
}

int bench(int argc, char** argv) {
  std::vector<std::string> files;
  int runs = 200, first = 0;
  std::size_t count = 8000;
  bool verbose = false;
  for (int a = 1; a < argc; ++a) {
    const auto number = [&] { return a + 1 < argc ? std::atoi(argv[++a]) : 0; };
    if (!std::strcmp(argv[a], "--runs"))
      runs = number();
    else if (!std::strcmp(argv[a], "--first"))
      first = number();
    else if (!std::strcmp(argv[a], "--count"))
      count = static_cast<std::size_t>(number());
    else if (!std::strcmp(argv[a], "--verbose"))
      verbose = true;
    else
      files.emplace_back(argv[a]);
  }
  std::vector<Clean> parts;
  for (const std::string& file : files)
    parts.push_back(clean(file.substr(file.rfind('/') + 1), mesh_of(file), count));
  if (files.empty()) {
    parts.push_back(clean("torus", torus(1, .3, 96, 48), count));
    parts.push_back(clean("hollow ball", merged(icosphere(4, 1), inverted(icosphere(3, .6))), count));
    parts.push_back(clean("fork", fork(.1, .1, .2, .3), count));
  }
  std::vector<Row> rows(kDamageCount);
  for (int run = first; run < first + runs; ++run) {
    const int kind = run % kDamageCount;
    judge(parts[static_cast<std::size_t>(run / kDamageCount) % parts.size()], kind, run, verbose, rows[kind]);
  }
  fmt::print(
      "| damage | runs | within 0.1 % | 1 % | 5 % | silently worse | refused | largest error | seconds each "
      "|\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  Row all;
  const auto print = [](const std::string& name, const Row& row) {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} | {:.2g} % | {:.2f} |\n", name, row.runs, row.tenth,
               row.one, row.five, row.worse, row.refused, 100 * row.largest,
               row.seconds / std::max(1, row.runs));
  };
  for (int kind = 0; kind < kDamageCount; ++kind) {
    const Row& row = rows[kind];
    print(kDamages[kind], row);
    all.runs += row.runs, all.refused += row.refused, all.tenth += row.tenth, all.one += row.one;
    all.five += row.five, all.worse += row.worse, all.seconds += row.seconds;
    all.largest = std::max(all.largest, row.largest);
  }
  print("all", all);
  return all.worse > 0 ? 1 : 0;
}

}  // namespace
}  // namespace flexel::voxelize

int main(int argc, char** argv) {
  return flexel::voxelize::bench(argc, argv);
}
