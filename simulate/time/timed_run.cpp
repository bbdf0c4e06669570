// The loop over steps. Every kCheck steps, in a fast motion every kFastCheck, the bound on the step is taken anew and the
// state kept as the last good one; frames, books, events and what happens when a run fails are seen to here.
#include "simulate/time/timed_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "base/error.h"
#include "base/files/files.h"
#include "base/files/output_file.h"
#include "base/program/termination.h"
#include "base/stop.h"
#include "base/units.h"
#include "formats/lattice/body_file.h"
#include "formats/lattice/fused_points.h"
#include "simulate/contact/pairs/stuck_places.h"
#include "simulate/effects/bonds.h"
#include "simulate/effects/contact.h"
#include "simulate/effects/supports.h"
#include "simulate/events/adaptive_resolution.h"
#include "simulate/events/edit.h"
#include "simulate/events/joined_bonds.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/events/repeated_events.h"
#include "simulate/events/resolution.h"
#include "simulate/live/live_link.h"
#include "simulate/matter/joined_parts.h"
#include "simulate/models/damping_factors.h"
#include "simulate/models/rest_shape.h"
#include "simulate/models/set_rest_shape.h"
#include "simulate/probes/report.h"
#include "simulate/scene/coming_parts.h"
#include "simulate/time/carried_motion.h"
#include "simulate/time/checkpoint.h"
#include "simulate/time/dynamic_relaxation.h"
#include "simulate/time/last_sound.h"
#include "simulate/time/rehearsal.h"
#include "simulate/time/series.h"
#include "simulate/time/time_segment.h"

namespace flexel::simulate {
namespace {

constexpr int kCheck = 100;  // steps between checks; implicit ones are checked one by one
constexpr int kFastCheck = 25;
// Steps between looks at what resolution parts want; with contact in a fast motion
constexpr int kLook = 25, kTouchLook = 5;
constexpr std::size_t kRows = 1000;  // of the history, unless the scene says otherwise
constexpr std::size_t kFrames = 50;  // likewise
constexpr double kSameTime = 1e-12;  // share of a time

// (parts) 1: a [[fix]] or a [[move]] has some of it, or of a part that it is bonded to, through others too.
std::vector<std::uint8_t> held_parts(const Scene& scene, const Problem& problem) {
  const Body& body = problem.body;
  std::vector<std::uint8_t> held(body.parts.size());
  const std::vector<std::uint32_t> part = element_parts(body);
  const EffectParameters present = without_coming_parts(scene, body);
  for (const Tie& tie : present.get<Supports>().ties) {
    const Selected selected = resolve(tie.where, body);
    for (const std::uint32_t e : selected.elements) held[part[e]] = 1;
    for (const std::uint32_t p : selected.polygons) held[body.surface.polygon_part(p)] = 1;
  }
  const std::optional<Bonds> bonds = Bonds::make(present.get<Bonds>(), problem);
  for (bool spreads = bonds.has_value(); spreads;) {
    spreads = false;
    for (std::uint32_t p = 0; p < held.size(); ++p)
      for (std::uint32_t other = 0; other < held.size() && held[p] == 0; ++other)
        if (held[other] != 0 && bonds->holds(p, other, body)) {
          held[p] = 1;
          spreads = true;
        }
  }
  return held;
}

class TimedRun {
 public:
  TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
           std::optional<DynamicRelaxation> relaxation = {});
  SimulateResult operator()();

 private:
  void begin();
  void resume(const Checkpoint& from);
  void listen(const std::string& note);
  void keep();
  [[nodiscard]] bool save_checkpoint();
  bool attempt(const std::string& what, const std::function<void()>& write);
  [[nodiscard]] bool over() const {
    return (live_ && live_->ended()) || (relaxation_ && relaxation_->done());
  }
  void play();
  void play_until(double end, bool resumed);
  void enter_half_step();
  void look_beyond_end();
  [[nodiscard]] bool is_due() const;
  [[nodiscard]] bool looks() const;
  [[nodiscard]] bool wants_change();
  EnergyBalance end_act();
  void apply(std::span<const Event> happening);
  void happen(std::span<const Event> happening);
  void bond_joined(std::size_t first, const State& state);
  void keep_motion(const CarriedMotion& carried, const Event& event, const std::vector<PartTouch>& touches,
                   const std::vector<Part>& before);
  [[nodiscard]] std::vector<std::string> warnings_of_effects() const;
  void warn_of_effects(const std::vector<std::string>& told = {});  // but for what is told
  void check();
  void step();
  void advance(bool row);
  [[nodiscard]] bool has_frames() const { return series_ || options_.on_frame; }
  void write_frame();
  [[nodiscard]] double now() const;
  [[nodiscard]] std::string save(const std::optional<State>& state);
  [[nodiscard]] std::string stop();
  SimulateResult report();
  SimulateResult ended();

  Body& body_;
  Scene scene_;
  const SimulateOptions& options_;
  Progress& progress_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  double duration_;
  Clock clock_;
  SegmentStart start_;  // of the act
  std::optional<TimeSegment> segment_;
  std::unique_ptr<EnergyHistory> history_;       // of the act; null: none asked for
  std::optional<DynamicRelaxation> relaxation_;  // nothing: a run in time
  std::unique_ptr<LiveLink> live_;               // null: neither poses nor frames
  std::optional<Series> series_;
  LastSound sound_;
  SimulateResult result_;           // what acts that are over added to it
  std::optional<Checkpoint> kept_;  // with --checkpoint: where the run can go on from
  Bytes act_body_;                  // likewise: the body as the present act began, to be made with it
  std::chrono::steady_clock::time_point saved_ = began_;
  std::size_t events_ = 0;  // that have happened
  RepeatedEvents repeated_;
  std::optional<AdaptiveResolution> adaptive_;
  bool at_whole_step_ = false;  // velocities are of the time of the state, after an event
  struct {
    double row = 0, frame = 0;  // s, the next ones
    std::size_t frames = 0;     // so far
  } due_;
  std::optional<LiveSummary> live_summary_;
};

TimedRun::TimedRun(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress,
                   std::optional<DynamicRelaxation> relaxation)
    : body_(body),
      scene_(scene),
      options_(options),
      progress_(progress),
      duration_(*scene.run.time),
      relaxation_(std::move(relaxation)) {
  for (const Event& event : scene_.events)
    if (event.prepare)
      for (std::string& name : event.prepare()) scene_.coming_parts.push_back(std::move(name));
  if (const Contact::Parameters& contact = scene_.get<Contact>(); contact.on && contact.parting > duration_)
    progress_.warn(
        fmt::format("[contact] \"overlap_time\" is {:.4g} s, the run {:.4g} s: what begins inside "
                    "something else is not out at its end",
                    contact.parting, duration_));
  if (!options.resume) rehearse_resolution(body, scene_, LiveLink::wanted(scene_, options));
  if (scene.run.adaptive) adaptive_.emplace(*scene.run.adaptive, body, duration_);
  start_.settled = settled_displacement(body);
  start_.fused = fused_points(body);
  if (!options.series.empty()) series_.emplace(options.series, options.compress);
  if (!options.checkpoint.empty()) {
    kept_.emplace();
    kept_->input = options.resume ? options.resume->input : body_fingerprint(body);
    act_body_ = body_bytes(body);
  }
  if (LiveLink::wanted(scene_, options)) {
    live_ = std::make_unique<LiveLink>(scene_, body, options, progress, check_stop);
    live_->await(0);
  }
  if (options.resume)
    resume(*options.resume);
  else
    begin();
  if (!options.history.empty())
    history_ = segment_->make_history(options.resume ? options.resume->balance : EnergyBalance{});
  segment_->set_hear([this](const std::string& note) { listen(note); });
  if (relaxation_) refuse_timed(segment_->effects(), ActsIn::relaxation_and_time, scene_.name);
}

// With what stuck at the end of an earlier run.
void TimedRun::begin() {
  const std::vector<StuckPlaces> stuck = stuck_places(body_);
  if (!stuck.empty()) start_.transferred_states = {{Contact::name, transfer_of(stuck)}};
  segment_.emplace(body_, scene_, options_, progress_, start_, state_of(body_));
  start_.transferred_states.clear();
  warn_of_effects();
  const bool sticks = scene_.get<Contact>().sticks() || body_.element_columns.contains("stick_change");
  if (!stuck.empty() && !sticks) {
    progress_.warn(
        fmt::format("{}: {} places of surfaces stuck together at the end of an earlier run; nothing of this "
                    "scene has stick, "
                    "and they come off: stick in its [contact] keeps them",
                    scene_.name, stuck.size()));
    return;
  }
  std::size_t found = 0;
  for (const auto& [name, transferred] : segment_->transferred_states())
    if (name == Contact::name) found = stuck_in(transferred).size();
  if (found < stuck.size())
    progress_.warn(
        fmt::format("{} of the {} places that stuck at the end of an earlier run are not there in "
                    "this scene's contact, and stick no more",
                    stuck.size() - found, stuck.size()));
}

std::vector<std::string> TimedRun::warnings_of_effects() const {
  std::vector<std::string> lines;
  for (const ActiveEffect& effect : segment_->effects())
    for (std::string& line : effect->warnings(segment_->state())) lines.push_back(std::move(line));
  return lines;
}

void TimedRun::warn_of_effects(const std::vector<std::string>& told) {
  for (const std::string& line : warnings_of_effects())
    if (std::find(told.begin(), told.end(), line) == told.end()) progress_.warn(line);
}

void TimedRun::resume(const Checkpoint& from) {
  clock_ = from.clock;
  start_ = {false, from.settled, from.fused};
  events_ = std::min<std::size_t>(from.events, scene_.events.size());
  segment_.emplace(body_, scene_, options_, progress_, start_, from.state);
  segment_->restore(from.memory);
  if (adaptive_) adaptive_->restore(from.adaptive);
  if (series_) series_->resume(from.frames);
  due_.row = from.next_row;
  due_.frame = from.next_frame;
  due_.frames = from.frames.times.size();
  warn_of_effects();
}

// Within an implicit step: what was reached before it stays.
void TimedRun::listen(const std::string& note) {
  check_stop();
  const double time = *segment_->state().time;
  progress_.update(time / duration_, fmt::format("{:.4g} s, step {}, {}", time, clock_.steps, note));
}

// Where the run can go on from, to the bit.
void TimedRun::keep() {
  const StopWaits whole;
  kept_->state = segment_->state();
  kept_->clock = clock_;
  kept_->memory = segment_->memory();
  kept_->events = events_;
  kept_->settled = start_.settled;
  kept_->fused = start_.fused;
  if (adaptive_) kept_->adaptive = adaptive_->memory();
  if (history_) kept_->balance = history_->balance();
  if (series_) kept_->frames = series_->place();
  kept_->next_row = due_.row;
  kept_->next_frame = due_.frame;
}

bool TimedRun::save_checkpoint() {
  saved_ = std::chrono::steady_clock::now();
  if (!kept_ || !kept_->state.time) return false;
  kept_->scene_name = scene_.name;
  kept_->scene = scene_.text;
  kept_->output = options_.output;
  kept_->history = options_.history;
  kept_->compress = options_.compress;
  return attempt("checkpoint", [&] { write_checkpoint(*kept_, act_body_, options_.checkpoint); });
}

// A full disk is no reason to lose the run, nor what goes elsewhere.
bool TimedRun::attempt(const std::string& what, const std::function<void()>& write) {
  try {
    write();
    return true;
  } catch (const InputError& error) {
    progress_.warn(fmt::format("no {}: {}: {}", what, error.where(), error.what()));
    return false;
  }
}

void TimedRun::check() {
  if (kept_ && segment_->renews(clock_)) keep();
  check_stop();
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - saved_;
  if (kept_ && since.count() > options_.checkpoint_every) (void)save_checkpoint();
  segment_->refuse_unsound();
  sound_.keep(segment_->state());
  segment_->adapt_step(clock_);
  const double time = *segment_->state().time;
  if (relaxation_)
    progress_.update(time / duration_,
                     fmt::format("step {}, residual {:.2g}", clock_.steps, relaxation_->summary().residual));
  else
    progress_.update(time / duration_, fmt::format("{:.4g} s, step {}", time, clock_.steps));
}

// Explicit steps end before the run is stopped.
void TimedRun::advance(bool row) {
  std::optional<StopWaits> whole;
  if (!segment_->is_implicit()) whole.emplace();
  segment_->step(clock_, history_.get(), row);
}

void TimedRun::step() {
  const bool due = history_ && *segment_->state().time >= due_.row;
  const bool row = due || (history_ && history_->balance().changed);
  if (due) due_.row += scene_.run.history_every.value_or(duration_ / kRows);
  if (live_) live_->await(clock_.epoch + static_cast<double>(clock_.in_epoch + 1) * clock_.step);
  if (relaxation_) relaxation_->before(segment_->state());
  advance(row);
  if (row) history_->refuse_broken_books(segment_->state());
  if (relaxation_)
    segment_->slow(relaxation_->after(segment_->state(), segment_->stepper().mass(),
                                      [&](SimulateResult& told) { segment_->tell_forces(told); }));
  if (live_) live_->keep_pace(segment_->state());
}

void TimedRun::write_frame() {
  if (!has_frames()) return;
  segment_->store(segment_->state());
  if (series_) try {
      series_->add(body_, *segment_->state().time);
    } catch (const InputError& error) {
      throw InputError(error.where(), error.what() + (clock_.steps > 0 ? stop() : ""));
    }
  if (options_.on_frame) options_.on_frame(body_, *segment_->state().time);
  segment_->unload();
  due_.frame = duration_ * static_cast<double>(++due_.frames) / scene_.run.frames.value_or(kFrames);
}

// Without an act an event is happening.
double TimedRun::now() const {
  return segment_ ? *segment_->state().time : sound_.time();
}

// Leaves the body at `state` (nothing: none was sound), and in the file for runs that end early; says where
// that is.
std::string TimedRun::save(const std::optional<State>& state) {
  if (history_) attempt("history", [&] { write_text(history_->balance().csv(), options_.history, true); });
  if (!state) return "";
  if (segment_)
    segment_->store(*state);
  else  // an event failed, and the body is what it was before that
    set_fused_points(body_, start_.fused);
  forget_edits(body_);
  if (options_.failed_output.empty() || !attempt("state", [&] { write_body(body_, options_.failed_output); }))
    return "";
  return fmt::format("; the state at {:.6g} s is in {}", *state->time, options_.failed_output);
}

SimulateResult TimedRun::report() {
  SimulateResult& result = result_;
  segment_->report(clock_, options_.stress, result);
  result.timed->live = live_summary_;
  segment_->add_effort(result, options_.explain);
  if (history_) result.timed->books = history_->balance().sums();
  if (relaxation_) relaxation_->report(result);
  refuse_not_finite(result, scene_.name);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  if (options_.explain) explain_times(result.shares, result.seconds, progress_);
  return result;
}

// An event is met with velocities of its own time, for the forces after it act from then on and with steps of
// their own: back by half of such a step.
void TimedRun::enter_half_step() {
  at_whole_step_ = false;
  clock_.previous = segment_->kicks() ? clock_.step : 0;
  if (segment_->kicks()) segment_->kick(-0.5 * clock_.step);
}

// These two of state and clock alone: a run that is resumed checks and looks at the same steps.
bool TimedRun::is_due() const {
  return segment_->is_implicit() || clock_.steps % kCheck == 0 ||
         (clock_.steps % kFastCheck == 0 && segment_->is_fast(clock_, kCheck));
}

bool TimedRun::looks() const {
  if (!adaptive_) return false;
  return segment_->is_implicit() || clock_.steps % kLook == 0 ||
         (clock_.steps % kTouchLook == 0 && scene_.get<Contact>().on && segment_->is_fast(clock_, kLook));
}

// Surfaces that may touch before the next look count.
bool TimedRun::wants_change() {
  const int steps = segment_->is_implicit() ? 1 : segment_->is_fast(clock_, kLook) ? kTouchLook : kLook;
  const std::vector<PartTouch> touches = segment_->touches(steps * clock_.step);
  if (!adaptive_->look(segment_->problem(), segment_->state(), touches, progress_)) return false;
  segment_->refuse_unsound();
  return true;
}

// From the beginning of an act to its end, or from where a checkpoint has it to there; or to where a part
// changes its resolution.
void TimedRun::play_until(double end, bool resumed) {
  const auto goes_on = [&] { return *segment_->state().time < end * (1 - kSameTime) && !over(); };
  const bool first = clock_.steps == 0 && goes_on() && !resumed;
  clock_.until = end;
  if (goes_on() && !resumed) segment_->choose_step(clock_);
  if (clock_.steps == 0 && goes_on() && !resumed && looks() && wants_change()) return;
  if (goes_on() && at_whole_step_) enter_half_step();
  if ((first || resumed) && options_.explain) {
    segment_->explain(clock_);
    if (adaptive_) progress_.say("plan: " + adaptive_->plan());
  }
  if (first) write_frame();
  if (live_ && (first || resumed)) live_->start(segment_->state());
  if (kept_) keep();
  sound_.keep(segment_->state());
  if (!history_ && !relaxation_) segment_->spare_mass();
  segment_->unload();
  while (goes_on()) {
    if (is_due() || segment_->needs_step_recheck() || stop_is_due()) check();
    if (looks() && wants_change()) return;
    segment_->renew_damping(clock_);
    step();
    if (has_frames() && *segment_->state().time >= due_.frame * (1 - 1e-9)) write_frame();
  }
  segment_
      ->refuse_unsound();  // a step looks at the state that it begins with: nothing has looked at the last
}

// No step follows the last event: forces and books of the end are those of one that is taken back.
void TimedRun::look_beyond_end() {
  const bool whole_step = at_whole_step_;
  const std::vector<Vec3> velocity = segment_->state().velocity;
  clock_.until = 2 * duration_;
  segment_->choose_step(clock_);
  if (whole_step) enter_half_step();
  segment_->tell_forces_ahead(clock_, history_.get(), result_);
  if (whole_step) segment_->change_velocities([&](State& state) { state.velocity = velocity; });
}

// Saves what a run that is stopped leaves; says where it is.
std::string TimedRun::stop() {
  const StopWaits saving;
  std::string saved = save(segment_ ? segment_->state() : sound_.state());
  if (save_checkpoint()) saved += fmt::format("; go on with --resume {}", options_.checkpoint);
  return saved;
}

// Parts from number `first` on have come.
void TimedRun::bond_joined(std::size_t first, const State& state) {
  if (first == body_.parts.size()) return;
  note_joined_parts(body_, first);
  const std::vector<FusedPoint> bonds =
      joined_bonds(timed_problem(body_, scene_, start_), state, static_cast<std::uint32_t>(first),
                   without_coming_parts(scene_, body_).get<Bonds>(), start_.fused, progress_);
  start_.fused.insert(start_.fused.end(), bonds.begin(), bonds.end());
  if (!bonds.empty())
    progress_.say(fmt::format("what came is bonded where it touches, in {} points", bonds.size()));
}

// The lattices of some parts are others since `event`; what touched them before, and what they were.
void TimedRun::keep_motion(const CarriedMotion& carried, const Event& event,
                           const std::vector<PartTouch>& touches, const std::vector<Part>& before) {
  constexpr double kOff = 0.01;  // of the smallest spacing
  constexpr double kPressed =
      0.2;  // spacings; surfaces that are a little deeper do not feel each other any more
  double spacing = std::numeric_limits<double>::infinity();
  for (const Part& part : body_.parts) spacing = std::min(spacing, part.lattice.spacing.minCoeff());
  // A box that ends between elements may hold others now, which were free and have moved. A face that lay
  // between elements was held by springs, which give way a little, and may go through elements now.
  if (const double off = segment_->farthest_off_path(); off > kOff * spacing)
    throw InputError(
        event.origin,
        fmt::format("resolution: on the new lattice a [[fix]] or [[move]] holds elements that were free "
                    "and are {} off: let it name a face, or a box that ends at elements of both lattices",
                    human_length(off)));
  // A run that adapts has looked at this state, with velocities of half a step before.
  for (std::size_t p = 0; !adaptive_ && p < touches.size(); ++p) {
    const Vec3& now = body_.parts[p].lattice.spacing;
    if (now == before[p].lattice.spacing) continue;
    if (touches[p].stored > kMostStored * carried.energy() || touches[p].gap < -kPressed * now.minCoeff())
      throw InputError(
          event.origin,
          fmt::format("resolution: part \"{}\" is pressed, and another lattice would press it otherwise: "
                      "change it before it touches, or after",
                      before[p].name));
  }
  segment_->put_on_path();
  const Problem problem = timed_problem(body_, scene_, start_);
  segment_->change_velocities(
      [&](State& state) { carried.give_back(problem, segment_->constraints().mask, state); });
  const double stored = touches.empty() ? 0 : segment_->stored();
  const std::string what = carried.change_of_energy(
      problem, segment_->state(), stored, adaptive_ ? adaptive_->energy_borne() : kLargestEnergyChange,
      event.origin, progress_);
  carried.warn_of_spin(problem, segment_->state(), held_parts(scene_, problem), event.origin, progress_);
  if (!what.empty()) progress_.say(fmt::format("at {:.4g} s {}", event.at, what));
}

// Books, velocities and the body are those of the time at which the act ends.
EnergyBalance TimedRun::end_act() {
  EnergyBalance balance;
  if (history_) {
    if (clock_.steps > 0) segment_->close_books(clock_, *history_);
    balance = history_->take_balance();
    balance.changed = !balance.rows.empty();
    history_.reset();
  }
  const bool was_whole = std::exchange(at_whole_step_, clock_.steps > 0 && segment_->kicks());
  if (at_whole_step_ && !was_whole) segment_->kick(0.5 * clock_.previous);
  segment_->store(segment_->state());
  sound_.keep(segment_->state());
  segment_->add_effort(result_, options_.explain);
  start_.transferred_states = segment_->transferred_states();
  start_.fused = segment_->fused();
  start_.fresh = false;
  return balance;
}

// These events happen now, and another act begins. Where one of them, or what acts after them, is impossible,
// the body stays as it was before them.
void TimedRun::apply(std::span<const Event> happening) {
  const StopWaits whole;  // between two acts there is no state to save
  EnergyBalance balance = end_act();
  const Body before = body_;
  const std::vector<FusedPoint> fused = start_.fused;
  const auto undo = [&] {
    segment_.reset();
    body_ = before;
    start_.fused = fused;
    if (options_.history.empty()) return;
    attempt("history", [&] { write_text(balance.csv(), options_.history, true); });
  };
  try {
    happen(happening);
  } catch (const DivergedError&) {
    undo();
    throw;
  } catch (const InputError& error) {
    if (clock_.steps == 0) throw;
    undo();
    throw DivergedError(error.where().empty() ? error.what()
                                              : fmt::format("{}: {}", error.where(), error.what()));
  }
  sound_.keep(segment_->state());  // of the elements that there are now
  segment_->set_hear([this](const std::string& note) { listen(note); });
  if (!options_.history.empty()) history_ = segment_->make_history(std::move(balance));
}

void TimedRun::happen(std::span<const Event> happening) {
  State state = segment_->state();
  const Event* resolution = nullptr;  // that changes in these events
  for (const Event& event : happening)
    if (event.name == ResolutionEvent::name) resolution = &event;
  std::optional<CarriedMotion> carried;
  // Before the first look at contacts nothing has been refused that overlaps.
  const bool looked = resolution && (clock_.steps > 0 || adaptive_);
  const std::vector<PartTouch> touches = looked ? segment_->touches(0) : std::vector<PartTouch>();
  if (resolution) carried.emplace(segment_->problem(), state, looked ? segment_->stored() : 0);
  const std::vector<std::string> told = warnings_of_effects();
  segment_.reset();
  const bool was_edited = edits_damping(body_);
  const std::vector<Part> parts = body_.parts;
  body_.notes.erase(kFusedNote);  // events change start_.fused and the numbers of elements
  body_.notes.erase(kStuckNote);  // in the transferred states
  for (const Event& event : happening) {
    const Problem problem = timed_problem(body_, scene_, start_);
    EventContext context{body_,   state,     start_.fused, start_.settled,
                         problem, progress_, event.turn,   event.turns};
    const std::string what = repeated_.apply(event, context);
    if (!what.empty()) progress_.say(fmt::format("at {:.4g} s {}: {}", event.at, event.name, what));
  }
  bond_joined(parts.size(), state);
  for (auto& [name, transferred] : start_.transferred_states)
    if (name == Contact::name)
      for (const StuckPlaces& came : stuck_places(body_))  // with bodies that were added
        transferred.insert(transferred.end(), came.begin(), came.end());
  if (kept_) {
    kept_->state.time.reset();  // until the act has begun, what was kept is of another body
    act_body_ = body_bytes(body_);
  }
  segment_.emplace(body_, scene_, options_, progress_, start_, std::move(state));
  if (carried) keep_motion(*carried, *resolution, touches, parts);
  segment_->look();  // an act that cannot begin is found out here
  if (body_.parts.size() > parts.size()) warn_of_effects(told);
  if (!was_edited && edits_damping(body_) && !segment_->damps())
    progress_.warn("edit: the scene has no [damping] that \"damping\" could change");
}

void TimedRun::play() {
  bool resumed = options_.resume != nullptr;
  while (events_ < scene_.events.size() && !over()) {
    const double at = scene_.events[events_].at;
    std::size_t end = events_ + 1;
    // times that rounding alone tells apart, as 3 x 0.1 s and 0.3 s, are one: no step lies between them
    while (end < scene_.events.size() && at >= scene_.events[end].at * (1 - kSameTime)) ++end;
    play_until(at, std::exchange(resumed, false));
    if (over()) break;
    apply(std::span(scene_.events).subspan(events_, end - events_));
    events_ = end;
  }
  const std::uint64_t before = clock_.steps;
  play_until(duration_, resumed);
  while (adaptive_) {
    const std::vector<Event> changes = adaptive_->take_due();
    if (changes.empty()) break;
    apply(changes);
    play_until(duration_, false);
  }
  const bool steps = clock_.steps > before || over();
  if (relaxation_ && !relaxation_->done())
    throw DivergedError(relaxation_->failure(body_, segment_->state()));
  if (live_) live_summary_ = live_->finish(segment_->state());
  if (!steps) return look_beyond_end();
  if (history_) segment_->close_books(clock_, *history_);
  segment_->tell_forces(result_);
}

// The body at the last state, the books written, and what is told of the run.
SimulateResult TimedRun::ended() {
  segment_->store(segment_->state());
  forget_edits(body_);
  if (history_) write_text(history_->balance().csv(), options_.history);
  SimulateResult result = report();
  if (scene_.run.renormalise)
    renormalise_all(body_, timed_problem(body_, scene_, start_), segment_->state().displacement);
  return result;
}

SimulateResult TimedRun::operator()() {
  const TerminationWaits waits;
  try {
    play();
    return ended();
  } catch (const DivergedError& error) {
    const std::string where = fmt::format("step {} at {:.6g} s", clock_.steps, now());
    throw DivergedError(fmt::format("{}: {}{}", where, error.what(),
                                    save(sound_.empty() ? std::nullopt : std::optional(sound_.state()))));
  } catch (const TimeoutError& error) {
    throw TimeoutError(fmt::format("{} after {} steps at {:.4g} s of {:.4g} s{}", error.what(), clock_.steps,
                                   now(), duration_, stop()));
  } catch (const Interrupted&) {
    if (const std::string saved = stop(); !saved.empty())
      progress_.say(fmt::format("stopped at step {}{}", clock_.steps, saved));
    throw;
  }
}

}  // namespace

SimulateResult run_in_time(Body& body, const Scene& scene, const SimulateOptions& options,
                           Progress& progress) {
  return TimedRun(body, scene, options, progress)();
}

SimulateResult settle(Body& body, const Scene& scene, const SimulateOptions& options, Progress& progress) {
  Scene made = scene;
  DynamicRelaxation relaxation(made, body);
  SimulateResult result = TimedRun(body, made, options, progress, std::move(relaxation))();
  body.element_columns.erase("velocity");
  return result;
}

}  // namespace flexel::simulate
