// flexel doctor: what is installed, what this machine has, and whether a run gives an answer that is known.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "base/error.h"
#include "base/files/json.h"
#include "base/files/memory_file.h"
#include "base/files/output_file.h"
#include "base/human.h"
#include "base/instruction_set.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/own_program.h"
#include "base/program/progress.h"
#include "base/resources.h"
#include "base/units.h"
#include "base/version.h"
#include "flexel/commands.h"
#include "formats/exchange/import.h"
#include "simulate/scene/scene.h"
#include "simulate/simulate.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

#ifdef FLEXEL_STEP
constexpr bool kReadsCad = true;
#else
constexpr bool kReadsCad = false;  // this build has no flexel-cad
#endif

struct Tool {
  std::string name, what;
  bool own = false;     // of Flexel
  bool needed = false;  // without it the installation is damaged
  bool found = false;
};

bool on_path(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && access((folder + "/" + name).c_str(), X_OK) == 0) return true;
  return false;
}

std::vector<Tool> tools() {
  std::vector<Tool> all = {{"flexel-voxelize", "parts to lattices", true, true},
                           {"flexel-simulate", "lattices deformed", true, true},
                           {"flexel-map", "deformed parts", true, true},
                           {"flexel-meshes", "FBX, Collada and other scenes", true, true},
                           {"flexel-distances.so", "repairs of open surfaces", true, true},
                           {"flexel-serve.so", "flexel view without --html, flexel clay", true, true},
                           {"flexel-cad", "STEP, IGES and BREP", true, kReadsCad},
                           {"gnuplot", "plots of flexel study"},
                           {"gmsh", "flexel export --mesh tet, flexel study --against calculix"},
                           {"ccx", "flexel study --against calculix"}};
  for (Tool& tool : all) try {
      tool.found = tool.own ? !own_program(tool.name).empty() : on_path(tool.name);
    } catch (const InputError&) {
      tool.found = false;
    }
  return all;
}

const char* instruction_set() {
  return runs(InstructionSet::avx512) ? "avx512" : runs(InstructionSet::avx2) ? "avx2" : "portable";
}

struct SelfTest {
  double known = 0, found = 0;  // J
  double seconds = 0;
  [[nodiscard]] double error() const { return std::abs(found - known) / known; }
  [[nodiscard]] bool passed() const { return error() < 1e-5; }
};

// A bar of 40 x 10 x 10 mm is pulled: without lateral contraction it stores F^2 l / (2 E A), but for a share of its
// strain, 5e-7 here. (Its end goes 1e-4 further than F l / (E A): the support yields, as penalties do.)
SelfTest self_test() {
  constexpr const char* kBar =
      "v 0 0 0\nv 40 0 0\nv 40 10 0\nv 0 10 0\nv 0 0 10\nv 40 0 10\nv 40 10 10\nv 0 10 10\n"
      "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  constexpr const char* kScene =
      "material = \"bar\"\n[materials.bar]\nyoung = \"200 GPa\"\npoisson = 0\ndensity = \"7800 kg/m3\"\n"
      "[[fix]]\nwhere = \"xmin\"\n[[load]]\nwhere = \"xmax\"\nforce = [\"10 N\", \"0 N\", \"0 N\"]\n";
  const auto began = std::chrono::steady_clock::now();
  Progress silent("flexel", Progress::Mode::silent);
  const auto* begin = reinterpret_cast<const std::byte*>(kBar);
  const MemoryFile file(Bytes(begin, begin + std::char_traits<char>::length(kBar)));
  ImportOptions import;
  import.format = "obj";
  voxelize::VoxelizeOptions lattice;
  lattice.size = 1.25e-3;
  voxelize::VoxelizeResult voxels = voxelize::voxelize(import_surface(file.path(), import), lattice, silent);
  simulate::SimulateOptions options;
  options.estimate = false;
  const simulate::SimulateResult result =
      simulate::simulate(voxels.body, simulate::parse_scene(kScene, "self-test"), options, silent);
  SelfTest test;
  test.known = 10 * 10 * 0.04 / (2 * 200e9 * 1e-4);
  test.found = result.elastic_energy;
  test.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return test;
}

std::string as_text(const std::vector<Tool>& found, const SelfTest& test) {
  std::string text =
      fmt::format("version     {}\ncores       {}\nmemory      {} free\nkernels     {}\n", version(),
                  default_thread_count(), human_bytes(available_memory()), instruction_set());
  for (const Tool& tool : found)
    text += fmt::format("{:<8}    {:<20} {}\n",
                        tool.found    ? "there"
                        : tool.needed ? "MISSING"
                        : tool.own    ? "left out"
                                      : "missing",
                        tool.name, tool.what);
  text += fmt::format("self-test   {}: a pulled bar stores {:.6g} nJ, {:.6g} are known; {}\n",
                      test.passed() ? "passed" : "FAILED", 1e9 * test.found, 1e9 * test.known,
                      human_seconds(test.seconds));
  return text;
}

std::string as_json(const std::vector<Tool>& found, const SelfTest& test) {
  nlohmann::ordered_json json = {{"version", version()},
                                 {"cores", default_thread_count()},
                                 {"available_memory", available_memory()},
                                 {"isa", instruction_set()}};
  json["tools"] = nlohmann::ordered_json::array();
  for (const Tool& tool : found)
    json["tools"].push_back(
        {{"name", tool.name}, {"own", tool.own}, {"needed", tool.needed}, {"found", tool.found}});
  json["self_test"] = {
      {"passed", test.passed()}, {"found", test.found}, {"known", test.known}, {"seconds", test.seconds}};
  return json_text(json, 2) + "\n";
}

}  // namespace

int doctor_command(int argc, char** argv) {
  bool json = false;
  CommandLine app{"What is installed, what this machine has, and a short run whose answer is known.",
                  "flexel doctor"};
  app.add_flag("--json", json, "As JSON, in SI units (docs/reference/json.md)");
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const std::vector<Tool> found = tools();
  const SelfTest test = self_test();
  OutputFile out("-", false);
  out.write(json ? as_json(found, test) : as_text(found, test));
  out.commit();
  if (!test.passed()) throw InputError("the self-test failed: this machine or this build computes wrongly");
  std::vector<std::string> missing;
  for (const Tool& tool : found)
    if (tool.needed && !tool.found) missing.push_back(tool.name);
  if (!missing.empty())
    throw InputError(fmt::format("{} {} missing: install Flexel again", fmt::join(missing, ", "),
                                 missing.size() == 1 ? "is" : "are"));
  return kExitDone;
}

}  // namespace flexel::commands
