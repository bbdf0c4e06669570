// Decides by the state, what touches parts and what it remembers of them; the events do the rest.
#include "simulate/events/adaptive_resolution.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/resources.h"
#include "base/units.h"
#include "simulate/events/lattice_resolution.h"
#include "simulate/events/resolution.h"
#include "simulate/input/part_names.h"
#include "simulate/matter/strain_jump.h"
#include "simulate/result/memory_limit.h"

namespace flexel::simulate {
namespace {

constexpr double kLeastShare = 0.05;      // of the run, the least time unless the scene gives one
constexpr double kNear = 0.25, kFar = 1;  // spacings: a gap that makes finer, and one that keeps fine
constexpr double kMostPressed = 0.1;      // spacings, of a part that changes
constexpr std::size_t kPerPart = 7;       // values of memory(); 6 in checkpoints without the last

// Whether a coarser lattice of the part would have another energy than this one, by more than that share.
bool would_change_energy(const Problem& problem, const State& state, std::uint32_t part, double internal,
                         double kinetic, double share) {
  constexpr double kRounding = 1e-12;  // of all kinetic energy
  if (!(internal > kRounding * kinetic)) return false;
  std::vector<std::uint8_t> changed(problem.body.parts.size(), 0);
  changed[part] = 1;
  std::vector<std::vector<Vec3>> fields{state.displacement, state.velocity};
  const Body coarse = at_resolution(problem.body, changed, ResolutionChange::coarser, fields);
  State then;
  then.displacement = std::move(fields[0]);
  then.velocity = std::move(fields[1]);
  const Problem of_coarse{coarse, problem.materials, {}, problem.models, problem.hooke};
  return !(std::abs(internal_and_kinetic(of_coarse, then)[0] - internal) <= share * internal);
}

}  // namespace

std::vector<std::uint32_t> AdaptiveResolution::parts_of(const AdaptiveSettings& settings, const Body& body) {
  std::vector<std::uint32_t> parts;
  if (!settings.parts)
    for (std::uint32_t p = 0; p < body.parts.size(); ++p) parts.push_back(p);
  else
    for (const std::string& name : *settings.parts)
      for (const std::uint32_t p : require_parts(body, name, settings.origin)) parts.push_back(p);
  std::sort(parts.begin(), parts.end());
  parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
  return parts;
}

AdaptiveResolution::AdaptiveResolution(const AdaptiveSettings& settings, const Body& body, double duration)
    : settings_(settings), least_time_(settings.least_time.value_or(kLeastShare * duration)) {
  for (const std::uint32_t p : parts_of(settings, body)) {
    parts_.emplace_back().part = p;
    parts_.back().changed = -std::numeric_limits<double>::infinity();
  }
}

std::string AdaptiveResolution::wants_finer(const PartLevel& of, double jump, double gap, double now) const {
  if (of.level >= settings_.finest || (of.coarsened && now < of.changed + least_time_)) return "";
  if (gap < kNear) return "something touches it, or is about to";
  if (jump > settings_.strain_jump)
    return fmt::format("its strain differs by {:.2g} from cell to cell", jump);
  return "";
}

// It has been calm for as long as it needs to.
bool AdaptiveResolution::wants_coarser(PartLevel& of, double jump, double gap, double now) const {
  of.largest = std::max(of.largest, jump);
  if (jump > settings_.calm * settings_.strain_jump || gap < kFar) {
    of.calm_since = now;
    of.largest = 0;
  }
  return of.level > -settings_.coarsest && now >= of.calm_since + least_time_ &&
         now >= of.changed + least_time_;
}

// Of the energy that the body has, 1 % of what it would have if the strain of the part differed by as much as
// it may while it is calm.
double AdaptiveResolution::bearable_change(const PartLevel& of) const {
  const double times = settings_.calm * settings_.strain_jump / of.largest;
  return kLargestEnergyChange * times * times;
}

std::string AdaptiveResolution::beyond_limits(const AdaptiveSettings& settings, double elements, double now) {
  constexpr double kUnsure = 1.25;  // contact and what else the estimate of memory leaves out
  const double most = settings.most_elements.value_or(std::numeric_limits<double>::infinity());
  const double bytes =
      kUnsure * (moving_memory(elements) - (std::isfinite(memory_limit()) ? 0 : moving_memory(now)));
  const auto count = [](double of) { return human_count(static_cast<std::size_t>(of)); };
  if (elements > most)
    return fmt::format("{} elements, and \"max_elements\" allows {}", count(elements), count(most));
  if (elements > element_limit())
    return fmt::format("{} elements, and --max-elements allows {}", count(elements), count(element_limit()));
  if (bytes > memory_to_use())
    return fmt::format("{} elements in about {}, and {} may be used", count(elements), human_bytes(bytes),
                       human_bytes(memory_to_use()));
  return "";
}

bool AdaptiveResolution::has_room(const Body& body, PartLevel& of, double& elements, Progress& progress) {
  if (elements >= of.no_room) return false;
  const Part& part = body.parts[of.part];
  const double now = elements - static_cast<double>(part.element_end - part.element_begin);
  const double then = now + static_cast<double>(finer_element_count(body, part));
  const std::string why = beyond_limits(settings_, then, static_cast<double>(body.element_count()));
  if (why.empty()) {
    elements = then;
    return true;
  }
  of.no_room = elements;
  if (!std::exchange(told_limit_, true))
    progress.warn(fmt::format("{}: part \"{}\" stays as coarse as it is, finer the body would have {}",
                              settings_.origin, part.name, why));
  return false;
}

bool AdaptiveResolution::look(const Problem& problem, const State& state,
                              const std::vector<PartTouch>& touches, Progress& progress) {
  const double now = *state.time;
  if (now == looked_ && now > 0) return false;
  looked_ = now;
  const Body& body = problem.body;
  const std::vector<double> jumps = strain_jumps(body, state);
  auto elements = static_cast<double>(body.element_count());
  std::optional<std::array<double, 2>> energy;
  for (PartLevel& of : parts_) {
    const PartTouch& touch = touches[of.part];
    const double spacing = body.parts[of.part].lattice.spacing.mean();
    const double gap = settings_.contact ? touch.soon / spacing : std::numeric_limits<double>::infinity();
    std::string why = wants_finer(of, jumps[of.part], gap, now);
    const bool calm = wants_coarser(of, jumps[of.part], gap, now);
    const bool finer = !why.empty();
    if (!finer && !calm) continue;
    // Finer contacts bear less depth.
    if (!energy) energy = internal_and_kinetic(problem, state);
    const auto [internal, kinetic] = *energy;
    const double narrowest = body.parts[of.part].lattice.spacing.minCoeff();  // as the event has it
    if (touch.stored > kMostStored * (internal + kinetic) || touch.gap < -kMostPressed * narrowest) continue;
    if (calm && would_change_energy(problem, state, of.part, internal, kinetic, bearable_change(of))) {
      of.calm_since = now;  // it is not
      of.largest = 0;
      continue;
    }
    if (finer && !has_room(body, of, elements, progress)) continue;
    if (calm) why = fmt::format("it has been calm for {:.3g} s", now - of.calm_since);
    energy_borne_ =
        std::max(due_.empty() ? 0 : energy_borne_, finer ? kLargestEnergyChange : bearable_change(of));
    of.level += finer ? 1 : -1;
    of.changed = now;
    of.coarsened = calm;
    due_.push_back(make_event(ResolutionEvent(finer ? ResolutionChange::finer : ResolutionChange::coarser,
                                              of.part, why, settings_.origin),
                              now, settings_.origin));
  }
  return !due_.empty();
}

std::string AdaptiveResolution::plan() const {
  return fmt::format(
      "{} part(s) adapt their resolution, to {} halvings and {} doublings of the spacing, once calm for "
      "{:.3g} s ({})",
      parts_.size(), settings_.finest, settings_.coarsest, least_time_, settings_.origin);
}

std::vector<double> AdaptiveResolution::memory() const {
  std::vector<double> memory{looked_};
  for (const PartLevel& of : parts_)
    memory.insert(memory.end(), {static_cast<double>(of.part), static_cast<double>(of.level), of.changed,
                                 of.coarsened ? 1.0 : 0.0, of.calm_since, of.largest, of.no_room});
  return memory;
}

void AdaptiveResolution::restore(const std::vector<double>& memory) {
  const std::size_t each = memory.size() == 1 + (kPerPart - 1) * parts_.size() ? kPerPart - 1 : kPerPart;
  if (memory.size() != 1 + each * parts_.size())
    throw InputError(
        "the checkpoint's memory of [adaptive] is not that of its scene and body: it is damaged");
  looked_ = memory[0];
  const double* from = memory.data() + 1;
  for (PartLevel& of : parts_) {
    if (from[0] != of.part)
      throw InputError("the checkpoint's parts of [adaptive] are not those of its scene");
    of.level = static_cast<int>(from[1]);
    of.changed = from[2];
    of.coarsened = from[3] != 0;
    of.calm_since = from[4];
    of.largest = from[5];
    if (each == kPerPart) of.no_room = from[6];
    from += each;
  }
}

}  // namespace flexel::simulate
