// The stages and commands, as the programs run them but for files.
#include <cmath>

#include "base/files/outputs.h"
#include "base/parallel.h"
#include "base/program/arguments.h"
#include "base/program/brief_output.h"
#include "flexel/commands.h"
#include "flexel/deform.h"
#include "flexel/job.h"
#include "flexel/measure/materials_table.h"
#include "flexel/picture/canvas/png_file.h"
#include "flexel/picture_command.h"
#include "flexel/view/page.h"
#include "formats/common/file_format.h"
#include "mapping/cad_output.h"
#include "mapping/options.h"
#include "mapping/output.h"
#include "mapping/report/report.h"
#include "python/module.h"
#include "python/module_objects.h"
#include "python/module_run_scope.h"
#include "simulate/answer.h"
#include "simulate/input/scene_words.h"
#include "simulate/matter/stress.h"
#include "simulate/scene/strength.h"
#include "simulate/simulate.h"
#include "simulate/summary.h"
#include "voxelize/report.h"
#include "voxelize/voxelize.h"

namespace flexel::python {
namespace {

// A mapped surface, at rest, and where its vertices go.
struct MappedObject {
  Surface surface;
  mapping::MapResult result;
  std::string report;  // JSON
};

struct RunObject {
  std::shared_ptr<BodyObject> body;
  std::shared_ptr<MappedObject> mapped;  // of deform
  std::string summary;                   // JSON
  std::vector<std::string> answer;
};

// One state of a run in time. The body is the run's own, and can be copied while the callback has it.
struct FrameObject {
  double time = 0;
  const Body* body = nullptr;
};

// Words as a command takes them, parsed by `app`.
void parse(CommandLine& app, const std::string& name, std::vector<std::string> words) {
  words.insert(words.begin(), name);
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  if (!parse_arguments(app, static_cast<int>(words.size()), pointers.data()))
    throw InputError("help is no result: leave --help out");
}

voxelize::Align align_of(const std::string& word) {
  if (word == "snap") return voxelize::Align::snap;
  if (word == "box") return voxelize::Align::box;
  if (word == "none") return voxelize::Align::none;
  throw InputError("align: unknown word \"" + word + "\" (one of snap, box, none)");
}

int threads_of(const py::dict& given) {
  const int threads = taken<int>(given, "threads");
  if (threads < 0) throw InputError("threads: must not be below zero (0 is every core)");
  return threads;
}

py::tuple voxelize_part(const PartObject& part, const py::dict& given, const py::object& listener) {
  voxelize::VoxelizeOptions options;
  if (!given["size"].is_none()) options.size = taken<double>(given, "size");
  if (!given["count"].is_none()) {
    const auto count = taken<long long>(given, "count");
    if (count <= 0) throw InputError("count: must be above zero");
    options.count = static_cast<std::size_t>(count);
  }
  if (options.size && options.count) throw InputError("give size or count, not both");
  if (options.size && !(*options.size > 0)) throw InputError("size: must be above zero");
  options.placement = voxelize::placement_choice(taken<std::string>(given, "placement"));
  options.align = align_of(taken<std::string>(given, "align"));
  options.heal = voxelize::heal_choice(taken<std::string>(given, "heal"));
  options.material = taken<std::string>(given, "material");
  options.moments = taken<bool>(given, "moments");
  const int threads = threads_of(given);
  std::shared_ptr<BodyObject> body;
  std::string summary;
  Said said = run_work(listener, [&] {
    const ThreadLimit limit(threads);
    Progress progress("flexel");
    voxelize::VoxelizeResult result = voxelize::voxelize(part.surface, options, progress);
    report(result, progress);
    summary = summary_json(result);
    body = body_object(std::move(result.body));
  });
  return py::make_tuple(body, summary, std::move(said));
}

// `words`: options of a scene, as of `flexel deform`, for `app`, with which their --timeout ends. `scene_text`: in place of
// --scene, where it has a name.
simulate::Scene scene_of(CommandLine& app, std::vector<std::string> words, const std::string& scene_text,
                         const std::string& scene_name, const Body& body) {
  commands::JobArguments arguments;
  commands::declare_scene(app, arguments);
  parse(app, "simulate", std::move(words));
  commands::Job job;
  if (!scene_name.empty()) {
    job.scene = simulate::parse_scene(scene_text, scene_name);
  } else if (!arguments.scene.empty()) {
    job.scene = simulate::read_scene(arguments.scene);
  } else {
    job.scene.name = simulate::kCommandLine;
    refuse_idle(arguments);
  }
  add_options(arguments, job);
  if (job.scene.name == simulate::kCommandLine) check_parts(job, body.surface);
  add_actions(job, body);
  return job.scene;
}

simulate::SimulateOptions simulate_options(const py::dict& given) {
  simulate::SimulateOptions options;
  options.threads = threads_of(given);
  options.estimate = taken<bool>(given, "estimate");
  options.stress = taken<bool>(given, "stress");
  options.history = taken<std::string>(given, "history");
  options.failed_output = taken<std::string>(given, "failed");
  options.isa = taken<std::string>(given, "isa");
  // Shared: options are copied where a run has no GIL, and references of Python are not counted without it.
  if (const auto callback = std::make_shared<const py::object>(given["on_frame"]); !callback->is_none())
    options.on_frame = [callback](const Body& body, double time) {
      call_back([&] {
        auto frame = std::make_shared<FrameObject>(FrameObject{time, &body});
        struct Closes {  // however the call ends
          FrameObject& frame;
          ~Closes() { frame.body = nullptr; }
        } const closes{*frame};
        (*callback)(frame);
      });
    };
  return options;
}

py::tuple simulate_body(const BodyObject& body, const std::vector<std::string>& words,
                        const std::string& scene_text, const std::string& scene_name, const py::dict& given,
                        const py::object& listener) {
  const simulate::SimulateOptions options = simulate_options(given);
  auto run = std::make_shared<RunObject>();
  Said said = run_work(listener, [&] {
    Body moved = body.body;
    simulate::erase_stress_columns(moved);
    CommandLine app{"A scene.", "flexel simulate"};
    const simulate::Scene scene = scene_of(app, words, scene_text, scene_name, moved);
    Progress progress("flexel");
    const KeptWarnings warnings;
    const simulate::SimulateResult result = simulate::simulate(moved, scene, options, progress);
    const std::vector<simulate::Material> materials = known_materials(scene, moved);
    run->summary = summary_json(result, moved, materials, warnings.lines());
    run->answer = answer_lines(result, moved, materials);
    progress.finish();
    run->body = body_object(std::move(moved));
  });
  return py::make_tuple(run, std::move(said));
}

std::shared_ptr<MappedObject> mapped_object(mapping::MappedPart mapped, const Body& body,
                                            std::string report) {
  auto object = std::make_shared<MappedObject>();
  object->surface = mapped.surface(body);
  object->result = std::move(mapped.result);
  object->report = std::move(report);
  return object;
}

// As flexel-map; `path`: "" to write nothing; `inputs`: what is not replaced without --force.
py::tuple map_body(const BodyObject& given, const std::vector<std::string>& words, const std::string& path,
                   const std::vector<std::string>& inputs, const py::object& listener) {
  std::shared_ptr<MappedObject> object;
  Said said = run_work(listener, [&] {
    CommandLine app{"A mapping.", "flexel map"};
    mapping::MapArguments arguments;
    mapping::declare_map_options(app, arguments);
    bool force = false;
    app.add_flag("--force", force, "Let results replace files that are read");
    parse(app, "map", words);
    check_outputs({{path}, {arguments.report}}, inputs, force);
    if (!force && !path.empty()) mapping::keep_source(given.body, path);
    mapping::MapOptions options = map_options(arguments);
    const mapping::CrackOptions crack = crack_options(arguments);
    mapping::RefineOptions refine = refine_options(arguments, app, crack);
    std::optional<mapping::MapOutput> output;
    std::vector<SurfaceFormat> formats;
    if (!path.empty()) {
      output = mapping::map_output(arguments.format, path, arguments.ascii, 0, arguments.scale,
                                   arguments.attributes);
      if (output->format) formats.push_back(*output->format);
      if (is_cad(*output)) refine.mode = mapping::RefineOptions::Mode::off;
    }
    check_cad_output(arguments, crack, output && is_cad(*output));
    Progress progress("flexel");
    progress.stage("map");
    Body body = given.body;
    use_field(body, arguments, options);
    mapping::MappedPart mapped = map_refined(body, options, crack, refine, nullptr, formats, progress);
    if (!mapped.split_line.empty()) progress.say(mapped.split_line);
    if (output && is_cad(*output)) mapped.report.chord.reset();
    say_report(mapped.report, arguments, options, progress);
    write_report(mapped.report, arguments, options, arguments.report);
    if (output && is_cad(*output))
      for (const mapping::CadAnswer& answer :
           write_cad(body, mapped.report, arguments, options, {*output}, progress))
        progress.say(answer.line);
    else if (output)
      write_mapped(mapped.surface(body), body, mapped.result, *output);
    const std::string report = report_json(mapped.report, options);
    object = mapped_object(std::move(mapped), body, report);
  });
  return py::make_tuple(object, std::move(said));
}

py::tuple deform_part(const std::vector<std::string>& words, const std::shared_ptr<PartObject>& part,
                      const py::object& listener) {
  auto run = std::make_shared<RunObject>();
  Said said = run_work(listener, [&] {
    commands::Deformed result =
        commands::deform(words, part ? &part->surface : nullptr, Progress::Mode::automatic);
    run->summary = std::move(result.summary);
    run->answer = std::move(result.lines);
    Body& body = result.run.voxels.body;
    run->mapped = mapped_object(std::move(result.mapped), body, "");
    run->body = body_object(std::move(body));
  });
  return py::make_tuple(run, std::move(said));
}

// A command by its words, the first its name; what it prints goes to its files.
py::tuple run_command(const std::string& name, std::vector<std::string> words, const py::object& listener) {
  int code = 0;
  Said said = run_work(listener, [&] {
    words.insert(words.begin(), name);
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const int count = static_cast<int>(words.size());
    if (name != "study") throw InputError("no command \"" + name + "\" for programs");
    code = commands::study_command(count, pointers.data());
  });
  return py::make_tuple(code, std::move(said));
}

using Subjects = std::vector<std::pair<std::string, py::object>>;

// Of `flexel picture` or of `flexel view`.
template <class Subject>
std::vector<Subject> subjects_of(const Subjects& given) {
  std::vector<Subject> subjects(given.size());
  for (std::size_t s = 0; s < given.size(); ++s) {
    subjects[s].label = subjects[s].where = given[s].first;
    if (py::isinstance<BodyObject>(given[s].second))
      subjects[s].body = given[s].second.cast<const BodyObject&>().body;
    else
      subjects[s].surface = given[s].second.cast<const PartObject&>().surface;
  }
  return subjects;
}

py::tuple picture(const Subjects& given, const std::vector<std::string>& words, const py::object& listener) {
  const auto subjects = subjects_of<picture::PictureSubject>(given);
  Bytes png;
  Said said = run_work(listener, [&] {
    Progress progress("flexel");
    const picture::PictureResult drawn = commands::draw_subjects(words, subjects, progress);
    for (const std::string& note : drawn.notes) progress.say(note);
    png = encode_png(drawn.image);
  });
  return py::make_tuple(py::bytes(reinterpret_cast<const char*>(png.data()), png.size()), std::move(said));
}

// The page of flexel view, whole.
py::tuple page(const Subjects& given, const view::RunWords& words, const py::object& listener) {
  const auto subjects = subjects_of<view::ViewSubject>(given);
  std::string html;
  Said said = run_work(listener, [&] {
    Progress progress("flexel");
    std::vector<view::ViewFile> files;
    for (const view::ViewSubject& subject : subjects) files.push_back(make_view_file(subject, {}, progress));
    view::PageOptions options;
    options.words = words;
    html = make_page(files, options, true).html;
  });
  return py::make_tuple(html, std::move(said));
}

// Before `outputs` are written: throws InputError where one is an input, unless `force`.
void check_paths(const std::vector<std::string>& outputs, const std::vector<std::string>& inputs,
                 bool force) {
  std::vector<OutputName> names;
  for (const std::string& path : outputs) names.push_back({path});
  check_outputs(names, inputs, force);
}

void add_results(py::module_& module) {
  py::class_<Said>(module, "Said")
      .def_readonly("lines", &Said::lines)
      .def_readonly("warnings", &Said::warnings);
  py::class_<FrameObject, std::shared_ptr<FrameObject>>(module, "Frame")
      .def_readonly("time", &FrameObject::time)
      .def("body", [](const FrameObject& frame) {
        if (frame.body == nullptr) throw InputError("the frame is over: call body() within the callback");
        return body_object(*frame.body);
      });
  py::class_<MappedObject, std::shared_ptr<MappedObject>>(module, "Mapped")
      .def_readonly("report", &MappedObject::report)
      .def_property_readonly(
          "part",
          [](const MappedObject& mapped) { return std::make_shared<PartObject>(PartObject{mapped.surface}); })
      .def_property_readonly(
          "rest",
          [](const py::object& self) { return view_of(self.cast<MappedObject&>().surface.vertices, self); })
      .def_property_readonly("displacement",
                             [](const py::object& self) {
                               return view_of(self.cast<MappedObject&>().result.displacement, self);
                             })
      .def_property_readonly("flags", [](const py::object& self) {
        return view_of(self.cast<MappedObject&>().result.flags, self);
      });
  py::class_<RunObject, std::shared_ptr<RunObject>>(module, "Run")
      .def_readonly("body", &RunObject::body)
      .def_readonly("mapped", &RunObject::mapped)
      .def_readonly("summary", &RunObject::summary)
      .def_readonly("answer", &RunObject::answer);
}

}  // namespace

void add_runs(py::module_& module) {
  add_results(module);
  module.def("voxelize", &voxelize_part);
  module.def("simulate", &simulate_body);
  module.def("map", &map_body);
  module.def("deform", &deform_part);
  module.def("run_command", &run_command);
  module.def("check_outputs", &check_paths);
  module.def("picture", &picture);
  module.def("page", [](const Subjects& subjects, const std::vector<std::string>& warnings,
                        const std::vector<std::string>& lines, const std::string& summary,
                        const py::object& listener) {
    return page(subjects, {warnings, lines, summary}, listener);
  });
  module.def("materials", &commands::materials_json);
}

}  // namespace flexel::python
