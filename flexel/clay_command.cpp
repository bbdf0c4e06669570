// flexel clay: a part in the browser that hands pull at.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "base/error.h"
#include "base/files/json.h"
#include "base/nearest_word.h"
#include "base/parallel.h"
#include "base/printable.h"
#include "base/program/standard_output.h"
#include "base/program/termination.h"
#include "base/stop.h"
#include "flexel/clay/served_session.h"
#include "flexel/commands.h"
#include "flexel/job.h"
#include "flexel/picture_command.h"
#include "flexel/view/page.h"
#include "flexel/view/serve.h"
#include "simulate/input/materials.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::commands {
namespace {

constexpr std::size_t kUsualCells = 3000;  // that follow a hand at once
constexpr const char* kUsualMaterial = "PLA";

struct ClayArguments {
  std::string part, scene, material, up = "z";
  JobArguments lattice;
  bool quiet = false;
  int threads = 0;
};

void declare(CommandLine& app, ClayArguments& a) {
  app.add_option("part", a.part, "The part (STEP, STL, OBJ ...)").required().type_name("PART");
  app.add_option("--scene", a.scene, "What acts on it besides hands: a scene at equilibrium")
      .type_name("FILE");
  app.add_option("--material", a.material, "What it is made of (`flexel materials`); default PLA")
      .type_name("NAME");
  declare_lattice(app, a.lattice, "Or: about this many cells (default 3000)");
  declare_up(app, a.up);
  add_threads_option(app, a.threads);
  app.add_flag("--quiet", a.quiet, "Say only warnings and errors");
}

// What is acted on, and by which material; "" where the scene says it.
struct Clay {
  std::shared_ptr<const Body> body;
  std::string material, scene;
};

std::string read_scene_text(const ClayArguments& a) {
  if (a.scene.empty()) return "";
  const Bytes bytes = read_all(a.scene);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string material_of(const ClayArguments& a, const std::string& scene_text) {
  if (!scene_text.empty()) {
    const simulate::Scene scene = simulate::parse_scene(scene_text, a.scene);
    if (!scene.material.empty() && !a.material.empty())
      throw InputError(fmt::format("--material {}: {} says \"{}\"; give one of them", a.material, a.scene,
                                   scene.material));
    if (!scene.material.empty()) return "";
    if (scene.materials.contains(a.material)) return a.material;
  }
  if (a.material.empty()) return kUsualMaterial;
  std::vector<std::string> known;
  for (const simulate::Material& material : simulate::material_library()) known.push_back(material.name);
  if (!simulate::library_material(a.material))
    throw InputError(
        fmt::format("--material: no material \"{}\"{}", a.material, did_you_mean(a.material, known)));
  return a.material;
}

Clay read_clay(const ClayArguments& a, Progress& progress) {
  Clay clay;
  clay.scene = read_scene_text(a);
  clay.material = material_of(a, clay.scene);
  if (!a.scene.empty()) {
    clay::refuse_unkept(clay.scene, a.scene);
    clay::refuse_unled(simulate::parse_scene(clay.scene, a.scene));
  }
  Job job;
  plan_lattice(a.lattice, job);
  if (!job.voxelize.size && !job.voxelize.count) job.voxelize.count = kUsualCells;
  progress.stage("import");
  voxelize::VoxelizeResult result =
      voxelize::voxelize(read_parts({a.part}, job.import, progress), job.voxelize, progress);
  voxelize::report(result, progress);
  clay.body = std::make_shared<const Body>(std::move(result.body));
  if (!a.scene.empty()) clay::refuse_unled(simulate::parse_scene(clay.scene, a.scene), *clay.body);
  progress.finish();
  return clay;
}

std::string controls_of(const Clay& clay, const std::string& stem) {
  nlohmann::ordered_json json = {{"material", clay.material}, {"stem", printable(stem)}};
  json["materials"] = nlohmann::ordered_json::array();
  for (const simulate::Material& material : simulate::material_library())
    json["materials"].push_back(material.name);
  double spacing = 0;
  for (const Part& part : clay.body->parts) spacing = std::max(spacing, part.lattice.spacing.maxCoeff());
  json["spacing"] = spacing;
  return json_text(json);
}

}  // namespace

int clay_command(int argc, char** argv) {
  ClayArguments arguments;
  CommandLine app{"A part in the browser: held, pulled and twisted by hand, and saved bent.", "flexel clay"};
  declare(app, arguments);
  if (!parse_arguments(app, argc, argv)) return kExitDone;
  const ThreadLimit threads(arguments.threads);
  Progress progress("flexel", arguments.quiet ? Progress::Mode::quiet : Progress::Mode::automatic);
  Clay clay;
  {
    const StopEndsProcess nothing_is_left;
    clay = read_clay(arguments, progress);
  }
  const std::filesystem::path part(arguments.part);
  view::PageOptions options;
  options.colour = "none";
  options.up = arguments.up[0];
  options.exaggeration = 1;
  options.clay = controls_of(clay, part.stem().string());
  view::Page page =
      view::make_page({view::make_live_file(*clay.body, part.filename().string())}, options, false);
  clay::ClaySession session(clay.body, clay.material, clay.scene);
  clay::ServedSession served(session);
  const view::PageServer server(std::move(page), &served);
  print_to_stdout(server.url() + "\n");
  progress.say("open this in a browser on this machine; Ctrl-C ends it");
  try {
    while (true) {
      check_stop();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  } catch (...) {
    session.close();  // readers end before the server does
    throw;
  }
}

}  // namespace flexel::commands
