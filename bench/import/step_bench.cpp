// bench_import_step: reading and tessellating STEP, seconds and memory.
//   bench_import_step [PART.step DEFLECTION_MM]...
// Without arguments: a block with dimples, made here, and real parts of ../shared/parts, at deflections that
// give half a million triangles or more. Every row is read by a process of its own, so that the peak of
// memory is that row's, libraries and file included.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iterator>

#include "bench/import/step_part.h"
#include "formats/exchange/import.h"

namespace flexel {
namespace {

struct Read {
  double triangles = 0, wall = 0, cpu = 0;  // s
  double peak = 0;                          // bytes
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// In the child: reads, and writes the number of triangles and the wall time to `out`.
void read_in_child(const std::string& file, double deflection, int out) {
  Read result;
  ImportOptions options;
  options.deflection = deflection;
  const auto start = std::chrono::steady_clock::now();
  try {
    result.triangles = static_cast<double>(import_surface(file, options).polygon_count());
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_import_step: {}\n", error.what());
  }
  result.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  static_cast<void>(!write(out, &result, sizeof result));
  _exit(result.triangles > 0 ? 0 : 1);
}

// This process has no thread but one: nothing was read in it.
Read read_step(const std::string& file, double deflection) {
  int ends[2];
  if (pipe(ends) != 0) std::abort();
  std::fflush(stdout);  // else the child has it too
  const pid_t child = fork();
  if (child == 0) read_in_child(file, deflection, ends[1]);
  close(ends[1]);
  Read result;
  static_cast<void>(!read(ends[0], &result, sizeof result));
  close(ends[0]);
  rusage usage{};
  wait4(child, nullptr, 0, &usage);
  result.cpu = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  result.peak = 1024. * static_cast<double>(usage.ru_maxrss);
  return result;
}

int bench(int argc, char** argv) {
  const std::string block =
      (std::filesystem::temp_directory_path() / fmt::format("flexel-bench-{}.step", getpid())).string();
  const std::string parts = FLEXEL_PARTS_DIR;
  std::vector<std::pair<std::string, double>> rows;  // file, mm
  for (int a = 1; a + 1 < argc; a += 2) rows.emplace_back(argv[a], std::atof(argv[a + 1]));
  if (rows.empty()) {
    rows.emplace_back(block, .0022);
    const std::pair<const char*, double> real[] = {{"/Moving_Jaw_SO101.step", .0008},
                                                   {"/lower_leg_structure_fork.STEP", .0007},
                                                   {"/base_interface_AP203.STEP", .0017},
                                                   {"/featuretype.STEP", .002}};
    for (const auto& [name, deflection] : real) rows.emplace_back(parts + name, deflection);
    if (const pid_t child = fork(); child == 0) {
      write_dimpled_block(block);
      _exit(0);
    } else {
      waitpid(child, nullptr, 0);
    }
  }
  fmt::print("| part | deflection mm | triangles | wall s | CPU s | peak MB | bytes a triangle |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  int failed = 0;
  for (const auto& [file, deflection] : rows) {
    const std::string name =
        file == block ? "dimpled block" : std::filesystem::path(file).filename().string();
    if (!std::filesystem::exists(file)) {
      fmt::print("| {} | skipped: not there | | | | | |\n", name);
      continue;
    }
    const Read row = read_step(file, deflection * 1e-3);
    failed += !(row.triangles > 0);
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.0f} | {:.0f} |\n", name, deflection, row.triangles,
               row.wall, row.cpu, row.peak / 1e6, row.peak / row.triangles);
    std::fflush(stdout);
  }
  std::filesystem::remove(block);
  return failed > 0 ? 1 : 0;
}

}  // namespace
}  // namespace flexel

int main(int argc, char** argv) {
  return flexel::bench(argc, argv);
}
