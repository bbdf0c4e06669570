// Poses replace those that nobody has taken up yet, so what waits is what was last said. The spring between hand and tool
// is ten times as stiff as the part where the tool took it, which the first step of a stroke shows: the tool lags a tenth.
// While the hand moves the part follows roughly, and rests between poses: the processor is needed to draw it.
#include "flexel/clay/clay_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "base/error.h"
#include "base/files/json.h"
#include "base/files/temporary_folder.h"
#include "base/printable.h"
#include "base/program/own_program.h"
#include "base/stop.h"
#include "flexel/clay/changed_body.h"
#include "flexel/clay/rigid_fit.h"
#include "flexel/clay/tar.h"
#include "flexel/process/child.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fragments_of_body.h"
#include "formats/lattice/locate.h"
#include "simulate/scene/scene_checks.h"

namespace flexel::clay {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostWaiting = 256, kMostHolds = 64, kMostTools = 16, kMostUndo = 100,
                      kMostChanges = 64, kMostPlaces = 2000;
constexpr std::size_t kMostUndoElements = 5'000'000;  // some 200 bytes each
constexpr double kFollowTolerance = 1e-2, kDragTolerance = 1e-4;
constexpr int kDragIterations = 12, kIterations = 40, kMostHalvings = 6;
constexpr double kSpring = 10;     // times the part's stiffness
constexpr double kBalance = 1e-4;  // of the way of the hand
constexpr double kTellingForce =
    10;  // times what the residual leaves unknown: what a change of force has to be
constexpr double kLeastWay = 1e-3;  // of the part, that a hand has to go for kBalance to be measured by it
constexpr std::chrono::milliseconds kQuiet{100}, kLongQuiet{500};
constexpr std::chrono::seconds kLease{10}, kPatience{60};
constexpr const char* kFormats[] = {"stl", "obj", "3mf", "step", "ply", "off", "glb", "vtu"};

Body bent(const ClayDocument& document) {
  Body body = *document.now.body;
  for (std::size_t e = 0; e < body.element_count(); ++e)
    body.position[e] = body.rest[e] + (*document.displacement)[e];
  return body;
}

std::shared_ptr<const std::vector<Vec3>> displacement_of(const Body& body) {
  auto displacement = std::make_shared<std::vector<Vec3>>(body.element_count());
  for (std::size_t e = 0; e < body.element_count(); ++e) (*displacement)[e] = body.position[e] - body.rest[e];
  return displacement;
}

// What a tool takes, as it is now.
std::vector<MovedPoint> points_of(const simulate::Selected& selected, const ClayDocument& document) {
  const Body& body = *document.now.body;
  std::vector<MovedPoint> points;
  for (const std::uint32_t e : selected.elements)
    points.push_back({body.rest[e], (*document.displacement)[e]});
  for (const std::uint32_t p : selected.polygons)
    for (std::uint32_t k = body.surface.polygon_offsets[p]; k < body.surface.polygon_offsets[p + 1]; ++k) {
      const Vec3& vertex = body.surface.vertices[body.surface.polygon_vertices[k]];
      if (const std::optional<CellPoint> at = locate_on_surface(body, p, vertex))
        points.push_back({vertex, interpolate(*at, body, *document.displacement)});
    }
  return points;
}

Json numbers(const Vec3& a, const Vec3& b) {
  return {a.x(), a.y(), a.z(), b.x(), b.y(), b.z()};
}

Json shape_of(const ClayTool& tool) {
  if (!tool.shape) return nullptr;
  return {{"kind", tool.shape->plate ? "plate" : "ball"},
          {"radius", tool.radius},
          {"normal", {tool.normal.x(), tool.normal.y(), tool.normal.z()}}};
}

// (points x 3) as frames have them.
std::string single_precision(const std::vector<Vec3>& points) {
  std::vector<float> numbers;
  numbers.reserve(3 * points.size());
  for (const Vec3& point : points)
    for (const double x : point) numbers.push_back(static_cast<float>(x));
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
}

std::string file_text(const std::string& path) {
  const Bytes bytes = read_all(path);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string bytes_of(const Body& body) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "body.vtu").string();
  write_body(body, path);
  return file_text(path);
}

// (name, text) in the order in which they are run.
std::vector<std::pair<std::string, std::string>> scenes_of(const ClayDocument& document,
                                                           const std::string& base) {
  std::vector<std::pair<std::string, std::string>> scenes;
  for (std::size_t k = 0; k < document.kept.size(); ++k)
    scenes.emplace_back(fmt::format("scene-{}.toml", k + 1), document.kept[k]);
  scenes.emplace_back("scene.toml", scene_text(document, base, false));
  for (auto& [name, text] : scenes)
    text.insert(0, "# for flexel-simulate, on rest.vtu or on what the scene before this one left\n");
  return scenes;
}

std::string header_of(const Body& body) {
  Json parts = Json::array();
  const std::vector<std::uint32_t> part = element_parts(body);
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const auto begin = std::lower_bound(part.begin(), part.end(), p) - part.begin();
    const auto end = std::upper_bound(part.begin(), part.end(), p) - part.begin();
    parts.push_back({{"name", printable(body.parts[p].name)}, {"begin", begin}, {"end", end}});
  }
  const Json header = {{"flexel-live", 1},
                       {"clay", 4},
                       {"rate", 0},
                       {"state_every", 1},
                       {"elements", body.element_count()},
                       {"parts", parts},
                       {"tools", Json::array()}};
  return json_text(header) + "\n";
}

void refuse_more_tools(const ClayDocument& document) {
  if (document.tools.size() == kMostTools) throw InputError("16 tools are there: let one go first");
}

// A scene leads a tool straight from where it begins to where it is.
void refuse_detour(const ClayDocument& document, const std::string& base) {
  if (std::none_of(document.tools.begin(), document.tools.end(),
                   [](const ClayTool& tool) { return tool.shape.has_value(); }))
    return;
  simulate::Scene scene = simulate::parse_scene(scene_text(document, base, false), "what acts on the part");
  scene.events.clear();  // they have happened to the body
  const std::string name = led_through(*document.now.body, scene, *document.displacement);
  if (!name.empty())
    throw InputError(
        fmt::format("{} was led around the part, and a scene leads it straight, through the part: let it go, "
                    "and put a tool where it is now",
                    name));
}

void refuse_more_changes(const ClayDocument& document) {
  if (document.changes.size() == kMostChanges)
    throw InputError("64 places were carved or glued: hold the part, and keep its shape before the next");
}

void renew_surface(ClayDocument& document, std::uint64_t number) {
  document.surface = std::make_shared<const std::string>(surface_pack(document.now));
  document.surface_number = number;
}

// Why no element is in what a ball sweeps; "": some are.
std::string why_empty(const CarvedWay& way, const Body& body) {
  simulate::Selection swept;
  swept.kind = simulate::Selection::Kind::sphere;
  swept.point = way.path.front();
  swept.radius = way.radius;
  for (std::size_t k = 0; way.path.size() > 1 && k < way.path.size(); ++k)
    swept.members.emplace_back().point = way.path[k];
  try {
    return (void)resolve(swept, body), "";
  } catch (const simulate::EmptySelectionError& error) {
    return error.what();
  }
}

bool takes_more_places(const Act& act) {
  return act.kind == Act::Kind::draw && act.way.size() < kMostPlaces;
}

bool is_motion(const Act& act) {
  return act.kind == Act::Kind::pose || act.kind == Act::Kind::hand;
}

}  // namespace

ClaySession::ClaySession(std::shared_ptr<const Body> body, std::string material, std::string base)
    : base_(std::move(base)), first_(std::move(body)), hub_(header_of(*first_)) {
  ClayDocument document;
  auto numbers = std::make_shared<std::vector<std::uint32_t>>(first_->element_count());
  std::iota(numbers->begin(), numbers->end(), 0U);
  document.start = document.now = {first_, std::move(numbers)};
  document.material = std::move(material);
  document.displacement = displacement_of(*first_);
  take_up(std::move(document));
  shown_ = document_;
  publish();
  thread_ = std::thread([this] { run(); });
}

ClaySession::~ClaySession() {
  close();
  thread_.join();
}

void ClaySession::close() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  hub_.close();
}

Answer ClaySession::act(const std::string& message) {
  ActMessage said;
  try {
    said = parse_acts(message);
  } catch (const InputError& error) {
    return {400, fmt::format("{}{}{}\n", error.where(), error.where().empty() ? "" : ": ", error.what())};
  }
  const std::lock_guard lock(mutex_);
  const Clock::time_point now = Clock::now();
  const bool takes = std::any_of(said.acts.begin(), said.acts.end(),
                                 [](const Act& act) { return act.kind == Act::Kind::take; });
  if (holder_.empty() || takes || now - heard_ > kLease) give_tool(said.client);
  if (holder_ != said.client) return {409, "another page holds the tool\n"};
  heard_ = now;
  if (queue_.size() + said.acts.size() > kMostWaiting) return {429, "too many acts wait\n"};
  for (Act& act : said.acts) {
    if (act.kind == Act::Kind::draw && !act.on && !queue_.empty() && takes_more_places(queue_.back().act)) {
      std::vector<Vec3>& way = queue_.back().act.way;
      way.insert(way.end(), act.way.begin(), act.way.end());
      queue_.back().line = ++line_;
      continue;
    }
    if (is_motion(act) || act.kind == Act::Kind::draw) ++line_;
    if (is_motion(act) && !queue_.empty() && is_motion(queue_.back().act)) queue_.pop_back();
    queue_.push_back({std::move(act), line_});
  }
  changed_.notify_all();
  return {200, fmt::format("{{\"line\":{}}}\n", line_)};
}

void ClaySession::joined(const std::string& client) {
  const std::lock_guard lock(mutex_);
  ++readers_[client];
  if (holder_.empty()) give_tool(client);
}

void ClaySession::left(const std::string& client) {
  const std::lock_guard lock(mutex_);
  if (--readers_[client] > 0) return;  // it has come back before its old connection ended
  readers_.erase(client);
  if (holder_ == client) give_tool("");
}

// Under the mutex. A stroke ends with the hand that made it.
void ClaySession::give_tool(const std::string& client) {
  if (!holder_.empty() && holder_ != client) queue_.push_back({{Act::Kind::stay, "", {}}, line_});
  news_ = news_ || holder_ != client;
  holder_ = client;
  heard_ = Clock::now();
  changed_.notify_all();
}

std::function<void()> ClaySession::stop_asked() {
  return [this] {
    check_stop();
    const std::lock_guard lock(mutex_);
    if (stop_) throw Interrupted();
  };
}

// False at the end. No act: the part is still on its way, or the tool has changed hands.
bool ClaySession::wait(std::optional<Act>& act) {
  const bool rests = !on_its_way();
  std::unique_lock lock(mutex_);
  const auto news = [&] { return stop_ || news_ || !queue_.empty(); };
  if (settled_)
    changed_.wait(lock, news);
  else if (rests)
    changed_.wait_until(lock, quiet_, news);
  act.reset();
  news_ = false;
  if (stop_) return false;
  if (!queue_.empty()) {
    act = std::move(queue_.front().act);
    taken_ = queue_.front().line;
    queue_.pop_front();
    settled_ = false;
  }
  return true;
}

void ClaySession::run() {
  std::optional<Act> act;
  while (wait(act)) {
    const bool leads = act || on_its_way();
    try {
      if (act)
        perform(*act);
      else
        refine();
    } catch (const Interrupted&) {
      return;
    } catch (const std::exception& error) {
      said_ = error.what();
      halt();
      const std::lock_guard lock(mutex_);
      settle(!leads);  // after an act or a way that failed the part comes to rest where it is
    }
    publish();
  }
}

void ClaySession::perform(const Act& act) {
  if (act.kind == Act::Kind::take) return;
  if (act.kind == Act::Kind::draw) return draw(act);
  if (act.kind == Act::Kind::stay) return stay();
  said_.clear();
  if (act.kind == Act::Kind::cancel) return cancel();
  if (!is_motion(act)) {
    const bool travels = act.kind == Act::Kind::undo || act.kind == Act::Kind::redo;
    if (!travels) arrive();
    stroke_ = {};
    if (!travels) rest();
    return change(act);
  }
  if (document_.tools.empty()) throw InputError("no tool is there to be led: pull at a place first");
  if (!stroke_.begun) {
    stroke_ = {};
    rest();
    remember(document_);
  }
  stroke_.begun = true;
  const Clock::time_point now = Clock::now();
  const auto gap = now - moved_;  // between poses of a slow machine it does not rest
  quiet_ = now + (gap < kLongQuiet ? std::clamp<Clock::duration>(3 * gap, kQuiet, kLongQuiet) : kQuiet);
  moved_ = now;
  if (act.kind == Act::Kind::hand) {
    stroke_.hand = act.pose;
  } else {
    stroke_.hand.reset();
    stroke_.target = act.pose;
  }
  lead();
}

// The hand leaves: what it led stays where it is, and says still why it went no further.
void ClaySession::stay() {
  arrive();
  const std::optional<Carving> carving = std::exchange(stroke_, {}).carving;
  if (carving && !carving->changed && !carving->refused) throw InputError(carving->nothing);
}

void ClaySession::cancel() {
  const bool led = stroke_.begun || (stroke_.carving && stroke_.carving->changed);
  stroke_ = {};
  if (led) travel(true);
}

// The stroke goes no further; where the hand leads it next is part of it still.
void ClaySession::halt() {
  if (stroke_.carving) stroke_.carving->refused = true;
  stroke_.hand.reset();
  if (stroke_.begun) stroke_.target = document_.tools.back().pose;
}

void ClaySession::remember(ClayDocument before) {
  undo_.push_back(std::move(before));
  forget_oldest(undo_, kMostUndo, kMostUndoElements);
  redo_.clear();
}

void ClaySession::change(const Act& act) {
  if (act.kind == Act::Kind::undo || act.kind == Act::Kind::redo) return travel(act.kind == Act::Kind::undo);
  ClayDocument next = document_;
  if (act.kind == Act::Kind::hold) {
    const auto found = std::find(next.holds.begin(), next.holds.end(), act.name);
    if ((found != next.holds.end()) == act.on) return;
    if (act.on && std::any_of(next.tools.begin(), next.tools.end(),
                              [&](const ClayTool& tool) { return tool.where == where_of_name(act.name); }))
      throw InputError(fmt::format("a tool has \"{}\": let it spring back before it is held", act.name));
    if (act.on && next.holds.size() == kMostHolds) throw InputError("64 places are held: let one go first");
    act.on ? next.holds.push_back(act.name) : static_cast<void>(next.holds.erase(found));
  } else if (act.kind == Act::Kind::grab) {
    grab(act, next);
    next.grabs = ++grabs_;
  } else if (act.kind == Act::Kind::push) {
    push(act, next);
    next.grabs = ++grabs_;
  } else if (act.kind == Act::Kind::release) {
    if (next.tools.empty()) return;
    next.tools.pop_back();
  } else if (act.kind == Act::Kind::keep) {
    keep(next);
  } else if (act.kind == Act::Kind::carve || act.kind == Act::Kind::glue) {
    alter(act, next);
  } else if (act.kind == Act::Kind::paint) {
    paint(act, next);
  } else if (act.kind == Act::Kind::material) {
    if (next.material.empty()) throw InputError("the scene says what the part is made of");
    next.material = act.name;
    if (!next.changes.empty()) apply_changes(next, base_);  // glue is as stiff as what it holds
  }
  ClayDocument before = document_;
  act.kind == Act::Kind::carve ? take_up_carved(std::move(next)) : take_up(std::move(next));
  remember(std::move(before));
}

void ClaySession::take_up_carved(ClayDocument next) {
  try {
    take_up(std::move(next));
  } catch (const InputError& error) {
    throw InputError(fmt::format("carve: what is left is not held and led as before ({})", error.what()));
  }
}

// Carves along the way of the hand, as one act however often more of it comes. Once it was refused the rest is passed over,
// until the hand leaves.
void ClaySession::draw(const Act& act) {
  if (!stroke_.carving) {
    if (!act.on) throw InputError("nothing is carved along: put the ball down first");
    said_.clear();
    arrive();
    stroke_ = {};
    Carving begun;  // emplace(): clang 14 takes a nested class with defaults for one that cannot be made
    begun.body = document_.now.body;
    stroke_.carving = std::move(begun);
    rest();
    refuse_more_changes(document_);
  }
  Carving& carving = *stroke_.carving;
  if (carving.refused) return;
  const std::size_t count = std::min(act.way.size(), kMostPlaces - carving.places);
  if (act.on && count > 0) {
    carving.ways.push_back({{}, act.radius});
    carving.holds.push_back(0);
  }
  std::vector<Vec3>& path = carving.ways.back().path;
  path.insert(path.end(), act.way.begin(), act.way.begin() + static_cast<std::ptrdiff_t>(count));
  carving.places += count;
  const bool ends = count < act.way.size();
  if (ends || !draws_on()) carve_drawn();
  if (ends) throw InputError("the way has 2,000 places: lift the tool before it goes on");
}

// What goes is what the whole way sweeps, as in the scene, however it came in pieces.
void ClaySession::carve_drawn() {
  Carving& carving = *stroke_.carving;
  std::vector<CarvedWay> ways;
  for (std::size_t k = 0; k < carving.ways.size(); ++k) {
    if (!carving.holds[k]) carving.nothing = why_empty(carving.ways[k], *carving.body);
    carving.holds[k] = carving.holds[k] || carving.nothing.empty();
    if (carving.holds[k]) ways.push_back(carving.ways[k]);
  }
  if (ways.empty()) return;
  ClayDocument next = document_;
  if (carving.changed) next.changes.pop_back();
  next.changes.push_back(change_text(ways));
  try {
    apply_changes(next, base_);
  } catch (const simulate::EmptySelectionError& error) {
    carving.nothing = error.what();
    return;
  }
  if (carving.changed && *next.now.element == *document_.now.element) {
    document_.changes = std::move(next.changes);
    return;
  }
  renew_surface(next, frame_);
  ClayDocument before = document_;
  take_up_carved(std::move(next));
  if (!carving.changed) remember(std::move(before));
  carving.changed = true;
}

void ClaySession::grab(const Act& act, ClayDocument& next) const {
  const std::string face = where_of_name(act.name);
  if (std::find(next.holds.begin(), next.holds.end(), act.name) != next.holds.end())
    throw InputError(fmt::format("\"{}\" is held: free it before it is pulled at", act.name));
  const auto same = std::find_if(next.tools.begin(), next.tools.end(), [&](const ClayTool& tool) {
    if (!act.name.empty()) return tool.where == face;
    return tool.radius > 0 && !tool.shape && (tool.centre - act.at).norm() < tool.radius + act.radius;
  });
  if (same != next.tools.end())  // it is taken up again
    return static_cast<void>(std::rotate(same, same + 1, next.tools.end()));
  refuse_more_tools(next);
  ClayTool tool;
  simulate::Selection where = simulate::select_by_name(act.name, "pull");
  tool.where = face;
  tool.centre = act.at;
  tool.radius = act.radius;
  if (act.name.empty()) {
    where.kind = simulate::Selection::Kind::sphere;
    where.point = act.at;
    where.radius = act.radius;
    tool.where = where_of_ball(act.at, act.radius);
  }
  const std::vector<MovedPoint> points = points_of(resolve(where, *next.now.body), next);
  if (points.empty()) throw InputError("no matter lies there");
  tool.middle = mean_rest(points);
  tool.pose = rigid_fit(points);
  next.tools.push_back(std::move(tool));
}

// A tool that pushes is put down where it touches the part as it is now, and comes from where it is clear of the part as its
// shape was kept: the scene leads it from there.
void ClaySession::push(const Act& act, ClayDocument& next) const {
  const bool plate = act.name == "plate";
  const Vec3 centre = act.at + (plate ? 0 : act.radius) * act.from;
  const auto same = std::find_if(next.tools.begin(), next.tools.end(), [&](const ClayTool& tool) {
    return tool.shape && tool.shape->plate == plate &&
           (tool.middle + tool.pose.displacement - centre).norm() < tool.radius;
  });
  if (same != next.tools.end())  // it is taken up again
    return static_cast<void>(std::rotate(same, same + 1, next.tools.end()));
  refuse_more_tools(next);
  simulate::Scene scene = simulate::parse_scene(scene_text(next, base_, false), "what acts on the part");
  ClayTool tool;
  tool.radius = act.radius;
  tool.shape = {plate, act.radius, plate ? simulate::kPlateRounding * act.radius : act.radius};
  tool.normal = -act.from;
  const auto ways =
      ways_clear(*next.now.body, scene, *tool.shape, {centre, tool.normal}, act.from, *next.displacement);
  if (!ways)
    throw InputError("the part is in the tool's way all along: choose another place or a smaller tool");
  tool.middle = centre + ((*ways)[0] + (*ways)[1]) * act.from;
  tool.pose.displacement = -(*ways)[1] * act.from;
  tool.where = shape_text(*tool.shape, {tool.middle, tool.normal});
  next.tools.push_back(std::move(tool));
}

void ClaySession::paint(const Act& act, ClayDocument& next) const {
  if (!base_.empty() && simulate::parse_scene(base_, "the scene").parts.contains(act.name))
    throw InputError(fmt::format("the scene has a [parts.{}], which says what it is made of", act.name));
  next.painted[act.name] = act.material;
  if (!next.changes.empty()) apply_changes(next, base_);
}

void ClaySession::alter(const Act& act, ClayDocument& next) const {
  refuse_more_changes(next);
  next.changes.push_back(change_text(act));
  apply_changes(next, base_);
  if (act.kind == Act::Kind::carve) renew_surface(next, frame_);
}

void ClaySession::keep(ClayDocument& next) const {
  if (!model_) throw InputError("nothing acts on the part: hold a face before its shape is kept");
  refuse_detour(next, base_);
  const std::vector<ToolPose> poses = model_->poses();
  if (!model_->lead(poses, kRest, kIterations, [] { check_stop(); }))
    throw InputError("the part is not at rest: its shape cannot be kept");
  auto body = std::make_shared<Body>(bent(next));
  for (std::size_t e = 0; e < body->element_count(); ++e)
    body->position[e] = body->rest[e] + model_->displacement()[e];
  model_->renormalise(*body);
  next.kept.push_back(scene_text(next, base_, true));
  next.displacement = displacement_of(*body);
  next.start = next.now = {std::move(body), next.now.element};
  next.changes.clear();
  next.tools.clear();
}

// A new model of what acts now. Nothing has changed where it throws.
void ClaySession::take_up(ClayDocument next) {
  simulate::Scene scene = simulate::parse_scene(scene_text(next, base_, false), "what acts on the part");
  scene.events.clear();  // they have happened to the body
  (void)materials_of_parts(scene, *next.now.body);
  std::unique_ptr<PulledBody> model;
  const bool held = !scene.get<simulate::Supports>().ties.empty() ||
                    !scene.get<simulate::Loads>().loads.empty() || !next.tools.empty();
  if (held) {
    Progress silent("", Progress::Mode::silent);
    check_actions(scene, *next.now.body, silent);
    std::vector<LedTool> tools;
    std::vector<ToolPose> led;
    int most = 1;  // steps from rest
    for (const ClayTool& tool : next.tools) {
      tools.push_back({tool.middle, tool.shape.has_value()});
      led.push_back(tool.pose);
      most = std::max(most, tool.steps(tool.pose));
    }
    const double arm = 0.1 * bounding_box(next.now.body->rest).diagonal();
    const auto found = [&](const std::vector<Vec3>& start, const std::vector<ToolPose>& started, int steps) {
      model = std::make_unique<PulledBody>(*next.now.body, scene, tools, arm, start, started);
      for (int step = 1; step <= steps; ++step) {
        std::vector<ToolPose> poses = led;
        if (step < steps)
          for (ToolPose& pose : poses) pose = pose * (double(step) / steps);
        if (!model->lead(poses, kRest, kIterations, stop_asked())) return false;
      }
      return true;
    };
    if (!found(*next.displacement, led, 1) &&
        !found(*displacement_of(*next.now.body), std::vector<ToolPose>(led.size()), most))
      throw InputError("no equilibrium is found there");
    next.displacement = std::make_shared<const std::vector<Vec3>>(model->whole_displacement());
  } else {
    next.displacement = displacement_of(*next.now.body);
  }
  document_ = std::move(next);
  model_ = std::move(model);
}

void ClaySession::travel(bool back) {
  std::vector<ClayDocument>& from = back ? undo_ : redo_;
  std::vector<ClayDocument>& to = back ? redo_ : undo_;
  if (from.empty()) return;
  ClayDocument before = document_;
  take_up(from.back());
  from.pop_back();
  to.push_back(std::move(before));
}

std::vector<ToolPose> ClaySession::poses_with(const ToolPose& last) const {
  std::vector<ToolPose> poses;
  for (const ClayTool& tool : document_.tools) poses.push_back(tool.pose);
  poses.back() = last;
  return poses;
}

// Where the tool should be: where spring and part balance, as far as their stiffnesses are known.
ToolPose ClaySession::goal() const {
  if (!stroke_.hand) return stroke_.target;
  if (stroke_.spring == 0) return *stroke_.hand;
  const ToolPose& now = document_.tools.back().pose;
  const Vec3 unbalanced =
      stroke_.spring * (stroke_.hand->displacement - now.displacement) + model_->felt().back().force;
  return {now.displacement + unbalanced / (stroke_.spring + stroke_.part), stroke_.hand->turn};
}

void ClaySession::learn_stiffness(const ToolPose& before, const Vec3& force) {
  const Vec3 way = document_.tools.back().pose.displacement - before.displacement;
  const Vec3 more = force - model_->felt().back().force;  // on the part
  const double known = kTellingForce * model_->residual() * force.norm();
  if (!(way.squaredNorm() > 0) || more.norm() < known) return;
  const double stiffness = more.dot(way) / way.squaredNorm();
  if (!(stiffness > 0)) return;
  stroke_.part = stiffness;
  if (stroke_.spring == 0) stroke_.spring = kSpring * stiffness;
}

bool ClaySession::more_waits() {
  const std::lock_guard lock(mutex_);
  return !queue_.empty();
}

bool ClaySession::draws_on() {
  const std::lock_guard lock(mutex_);
  return !queue_.empty() && queue_.front().act.kind == Act::Kind::draw;
}

// One step of the tool towards where it should be; a shorter one where the part does not follow so far at once. `obeys`: it
// stops trying where other acts wait.
void ClaySession::lead(bool obeys) {
  const ToolPose before = document_.tools.back().pose, whole = goal() - before;
  const Vec3 force = model_->felt().back().force;
  double share = 1.0 / document_.tools.back().steps(whole);
  for (int tries = 0; tries < kMostHalvings; ++tries, share /= 2) {
    if (tries > 0 && obeys && more_waits()) return;  // the hand has gone elsewhere
    if (!led_to(share == 1 ? goal() : before + whole * share)) continue;
    document_.tools.back().pose = model_->poses().back();
    document_.displacement = std::make_shared<const std::vector<Vec3>>(model_->whole_displacement());
    learn_stiffness(before, force);
    return;
  }
  halt();
  throw InputError("the part does not follow further: it would fold or buckle");
}

bool ClaySession::led_to(const ToolPose& pose) {
  const std::vector<ToolPose> poses = poses_with(pose);
  return (hand_moves() && model_->follow(poses, kFollowTolerance)) ||
         model_->lead(poses, kDragTolerance, kDragIterations, stop_asked());
}

// What is done to the part next happens with the tool where it was led.
void ClaySession::arrive() {
  while (stroke_.begun && !stroke_.hand && !(document_.tools.back().pose == stroke_.target)) {
    lead(false);
    publish();
  }
}

void ClaySession::refine() {
  {
    const std::lock_guard lock(mutex_);
    if (settled_) return;
  }
  if (on_its_way()) return lead();
  if (hand_moves()) return;
  rest();
  const bool rests = !on_its_way();
  const std::lock_guard lock(mutex_);
  settle(rests && queue_.empty());
}

// What is done to the part next, and what undo leads back to, begins with it in equilibrium.
void ClaySession::rest() {
  if (!model_ || model_->residual() <= kRest) return;
  if (!model_->lead(model_->poses(), kRest, kIterations, stop_asked())) return retreat();
  document_.displacement = std::make_shared<const std::vector<Vec3>>(model_->whole_displacement());
}

// Whether the tool is not where it should be yet.
bool ClaySession::on_its_way() const {
  if (document_.tools.empty() || !stroke_.begun) return false;
  const ToolPose left = goal() - document_.tools.back().pose;
  if (!stroke_.hand) return left.displacement.squaredNorm() + left.turn.squaredNorm() > 0;
  const double arm = 0.1 * bounding_box(document_.now.body->rest).diagonal();
  const double way = std::max(stroke_.hand->displacement.norm(), kLeastWay * arm);
  return std::sqrt(left.dot(left, arm)) > kBalance * way;
}

// The part was led to where nothing holds it in equilibrium: back to where something did.
void ClaySession::retreat() {
  model_->retreat();
  for (std::size_t t = 0; t < document_.tools.size(); ++t) document_.tools[t].pose = model_->poses()[t];
  document_.displacement = std::make_shared<const std::vector<Vec3>>(model_->whole_displacement());
  throw InputError(
      "the part finds no rest there: it folds, buckles or snaps off; back to where it rested last");
}

// Under the mutex: nobody sees the part at rest without what it is at rest.
void ClaySession::settle(bool settled) {
  settled_ = settled;
  if (settled) shown_ = document_;
}

std::string ClaySession::head(std::size_t bytes) const {
  Json felt = Json::array(), place = Json::array(), names = Json::array(), middles = Json::array(),
       shapes = Json::array();
  for (std::size_t t = 0; t < document_.tools.size(); ++t) {
    const ClayTool& tool = document_.tools[t];
    const PulledBody::Felt by_part = model_ ? model_->felt()[t] : PulledBody::Felt{};
    felt.push_back(numbers(by_part.force, by_part.torque));
    place.push_back(numbers(tool.pose.displacement, tool.pose.turn));
    names.push_back(fmt::format("tool {}", t + 1));
    middles.push_back({tool.middle.x(), tool.middle.y(), tool.middle.z()});
    shapes.push_back(shape_of(tool));
  }
  Json painted = Json::object();
  for (const auto& [part, material] : document_.painted) painted[printable(part)] = printable(material);
  Json json = {{"frame", frame_},
               {"time", 0},
               {"late", false},
               {"line", taken_},
               {"residual", model_ ? model_->residual() : 0},
               {"felt", felt},
               {"place", place},
               {"tools", names},
               {"middles", middles},
               {"shapes", shapes},
               {"holds", document_.holds},
               {"undo", !undo_.empty()},
               {"redo", !redo_.empty()},
               {"kept", document_.kept.size()},
               {"material", document_.material},
               {"painted", painted},
               {"grabs", document_.grabs},
               {"surface", document_.surface_number},
               {"settled", settled_},
               {"holder", holder_.substr(0, 8)},
               {"said", printable(said_)}};
  if (stroke_.hand) json["hand"] = numbers(stroke_.hand->displacement, stroke_.hand->turn);
  json["bytes"] = bytes;
  return json_text(json) + "\n";
}

void ClaySession::publish() {
  const std::vector<Vec3>& moved = *document_.displacement;
  std::vector<Vec3> places(first_->element_count(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t e = 0; e < moved.size(); ++e)
    places[(*document_.now.element)[e]] = document_.now.body->rest[e] + moved[e];
  const std::string positions = single_precision(places);
  std::string frame, silent;
  {
    const std::lock_guard lock(mutex_);
    frame = head(positions.size());
    silent = head(0);
    surface_ = {document_.surface_number, document_.surface};
  }
  ++frame_;
  frame += positions;
  hub_.publish(std::move(frame), std::move(silent));
  changed_.notify_all();
}

Answer ClaySession::mapped(const std::string& name, const Body& body) const {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "body.vtu").string(), out = (folder.path() / name).string();
  write_body(body, path);
  ChildOptions options;
  options.log = folder.path() / "log";
  std::vector<std::string> command = {own_program("flexel-map"), path, "-o", out, "--quiet"};
  if (body.notes.contains(kCarvedNote)) command.insert(command.end(), {"--crack", "cap"});
  const ChildRun run = run_child(command, options);
  if (run.exit_code != 0) return {500, file_text(options.log.string())};
  return {200, file_text(out)};
}

// What the page draws with does not wait for the part to come to rest.
std::optional<Answer> ClaySession::drawn(const std::string& name) {
  if (name == "rest.f32") return Answer{200, single_precision(first_->rest)};
  const std::lock_guard lock(mutex_);
  if (!surface_.second || name != fmt::format("surface-{}", surface_.first)) return std::nullopt;
  return Answer{200, *surface_.second};
}

Answer ClaySession::save(const std::string& name) {
  if (std::optional<Answer> now = drawn(name)) return *std::move(now);
  if (name.starts_with("surface-")) return {404, "the part has another surface\n"};
  ClayDocument document;
  {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [&] { return stop_ || (settled_ && queue_.empty()); }) || stop_)
      return {500, "the part does not come to rest\n"};
    document = shown_;
  }
  try {
    if (name == "rest.vtu" || name == "body.vtu")
      return {200, bytes_of(name == "rest.vtu" ? *first_ : bent(document))};
    for (const char* format : kFormats)
      if (name == std::string("part.") + format) return mapped(name, bent(document));
    if (name == "scene.toml" || name == "scene.tar") refuse_detour(document, base_);
    if (name == "scene.tar") {
      std::vector<std::pair<std::string, std::string>> files = scenes_of(document, base_);
      files.emplace(files.begin(), "rest.vtu", bytes_of(*first_));
      return {200, tar_of(files)};
    }
    for (const auto& [own, text] : scenes_of(document, base_))
      if (name == own) return {200, text};
  } catch (const std::exception& error) {
    return {500, fmt::format("{}\n", error.what())};
  }
  return {404, "flexel clay has no such file\n"};
}

}  // namespace flexel::clay
