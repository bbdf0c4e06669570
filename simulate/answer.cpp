// Words follow the error bar: a value whose bar is half of it is a guess, and is called that.
#include "simulate/answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/human.h"
#include "base/units.h"
#include "simulate/estimate/error_bars.h"
#include "simulate/mode_lines.h"
#include "simulate/quadratic/local_stress.h"
#include "simulate/scene/strength.h"
#include "simulate/summary.h"

namespace flexel::simulate {
namespace {

constexpr double kGuess = 0.5;  // a bar over this share of the value: hardly more than its size is known
// A bar of that much bounds nothing: where a neck is narrower than a cell, each halving of the cells may double what moves.
constexpr double kBoundless = 1;
constexpr const char* kAxisNames[] = {"x", "y", "z"};
constexpr std::size_t kNamed = 2;  // probes, supports: so many are named, the others counted

const ErrorBar* find_bar(const SimulateResult& result, ErrorBar::Of of, std::size_t probe = 0) {
  for (const ErrorBar& each : result.error_bars.bars)
    if (each.of == of && each.probe == probe) return &each;
  return nullptr;
}

// The bar as a share of the value; nothing where there is no bar, or nothing that it is a share of.
std::optional<double> share_of(const ErrorBar* bar) {
  if (bar == nullptr || !(std::abs(bar->value) > 0)) return std::nullopt;
  return bar->bar.half_width / std::abs(bar->value);
}

// "(80, 20, 6) mm", in one unit; components that are only rounding beside the largest are 0.
std::string place_in_one_unit(const Vec3& at) {
  const double largest = at.cwiseAbs().maxCoeff();
  const bool metres = largest >= 10, microns = largest > 0 && largest < 1e-4;
  const double unit = metres ? 1 : microns ? 1e-6 : 1e-3;
  const auto number = [&](double value) {
    return std::abs(value) < 1e-6 * largest ? "0" : human_number(value / unit);
  };
  return fmt::format("({}, {}, {}) {}", number(at.x()), number(at.y()), number(at.z()),
                     metres    ? "m"
                     : microns ? "um"
                               : "mm");
}

// Why a bar is wide, or missing, of the note of simulate/estimate/error_bars.cpp.
std::string reason(const SimulateResult& result) {
  const std::string& note = result.error_bars.note;
  if (const std::size_t end = note.rfind(", under two cells)"); end != std::string::npos)
    return ": " + note.substr(0, note.rfind(" (", end));
  if (note.find("wall") != std::string::npos || note.find("one cell thick") != std::string::npos)
    return ": its walls are only a few cells thick";
  return "";
}

// "5.28 mm +- 0.54 mm (10 %)", or what a guess is worth. Walls of a cell or two may bend several times as
// far.
std::string moved(double length, const ErrorBar* bar, const SimulateResult& result) {
  const std::optional<double> share = share_of(bar);
  const bool unknown = result.error_bars.bars.empty() && !reason(result).empty();
  if (!share) return (unknown ? "no more than a first guess: " : "") + human_length(length);
  const double width = *share * length;
  if (*share >= kBoundless)
    return fmt::format("no more than a first guess: {}, could be several times as much",
                       human_length(length));
  if (*share > kGuess)
    return fmt::format("no more than a first guess: {}, could be {}", human_length(length),
                       length_range(length - width, length + width));
  return fmt::format("{} ({})", length_with_bar(length, width), human_share(*share));
}

// A force along an axis by that axis.
std::string directed(const Vec3& force) {
  const double size = force.norm();
  for (int axis = 0; axis < 3; ++axis)
    if (size > 0 && std::abs(force[axis]) > (1 - 1e-4) * size)
      return fmt::format("{} along {}{}", human_force(size), force[axis] < 0 ? "-" : "+", kAxisNames[axis]);
  const double largest = force.cwiseAbs().maxCoeff();
  const double unit = largest >= 999.5 ? 1e3 : largest > 0 && largest < 0.9995 ? 1e-3 : 1;
  const auto number = [&](double value) {
    return std::abs(value) < 1e-3 * largest ? "0" : human_number(value / unit);
  };
  return fmt::format("({}, {}, {}) {}", number(force.x()), number(force.y()), number(force.z()),
                     unit == 1e3    ? "kN"
                     : unit == 1e-3 ? "mN"
                                    : "N");
}

// "0.42 N m about +x"
std::string turning(const Vec3& moment) {
  const double size = moment.norm();
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(moment[axis]) > (1 - 1e-4) * size)
      return fmt::format("{} N m about {}{}", human_number(size), moment[axis] < 0 ? "-" : "+",
                         kAxisNames[axis]);
  const auto number = [&](double value) {
    return std::abs(value) < 1e-3 * moment.cwiseAbs().maxCoeff() ? "0" : human_number(value);
  };
  return fmt::format("({}, {}, {}) N m", number(moment.x()), number(moment.y()), number(moment.z()));
}

// The force of a support; its moment about its own middle where that is more than the force has over `size`, m, of the body.
std::string borne(const Reaction& reaction, double size) {
  constexpr double kRounding = 1e-3,
                   kNothing = 1e-15;  // N: what is free to expand bears nothing, but for rounding
  const Vec3 moment = reaction.moment_about_middle();
  const double lever = size * reaction.force.norm();
  if (std::max(lever, moment.norm()) < kNothing * size) return "no force";
  if (!(moment.norm() > lever)) return directed(reaction.force);
  return turning(moment) + (lever > kRounding * moment.norm() ? " and " + directed(reaction.force) : "");
}

std::string more(std::size_t all) {
  return all > kNamed ? fmt::format(", and {} more (--verbose)", all - kNamed) : "";
}

std::string how_far(const SimulateResult& result) {
  if (!(result.largest_displacement > 0)) return "nothing moves";
  const std::string when =
      result.timed ? fmt::format(" at the end, {}", human_seconds(result.timed->time)) : "";
  return fmt::format(
      "{}, at {}{}",
      moved(result.largest_displacement, find_bar(result, ErrorBar::Of::largest_displacement), result),
      place_in_one_unit(result.largest_displacement_at), when);
}

std::string probes(const SimulateResult& result) {
  std::string text;
  for (std::size_t p = 0; p < std::min(kNamed, result.probes.size()); ++p)
    text += fmt::format(
        "{}\"{}\" {}", text.empty() ? "" : "; ", result.probes[p].name,
        moved(result.probes[p].displacement.norm(), find_bar(result, ErrorBar::Of::probe, p), result));
  return text + more(result.probes.size());
}

// The worst bar of the displacements; where moves give the largest displacement, that of the energy too.
std::optional<double> worst_share(const SimulateResult& result) {
  const bool moved = std::any_of(result.reactions.begin(), result.reactions.end(),
                                 [](const Reaction& each) { return each.is_move; });
  constexpr double kGiven = 1e-3;  // a bar that small is of a displacement that a move gives
  const std::optional<double> largest = share_of(find_bar(result, ErrorBar::Of::largest_displacement));
  const bool by_moves = moved && (result.loads.empty() || (largest && *largest < kGiven));
  std::optional<double> worst;
  for (const ErrorBar& each : result.error_bars.bars) {
    if (each.of == ErrorBar::Of::elastic_energy && !by_moves) continue;
    if (each.of == ErrorBar::Of::probe && std::abs(each.value) < 1e-3 * result.largest_displacement) continue;
    if (const std::optional<double> share = share_of(&each)) worst = std::max(worst.value_or(0), *share);
  }
  return worst;
}

// "within 3 %", "under 0.01 %"
std::string within(double share) {
  const std::string text = human_share(share);
  return text.starts_with("under") ? text : "within " + text;
}

// "; not counted: walls thinner than a cell (1.3 % of the places measured)"
std::string not_counted(const std::vector<std::string>& unresolved) {
  std::string text;
  for (std::size_t n = 0; n < std::min(kNamed, unresolved.size()); ++n)
    text += (n == 0 ? "; not counted: " : ", ") + unresolved[n];
  return text + (unresolved.size() > kNamed ? fmt::format(", and {} more", unresolved.size() - kNamed) : "");
}

std::string how_sure(const SimulateResult& result, const Body& body) {
  if (result.timed) return "not known: runs in time have no error bars; compare with half the size";
  if (result.settled) return "not known: runs with contact have no error bars; compare with half the size";
  const std::optional<double> worst = worst_share(result);
  if (!worst) {
    const std::string& note = result.error_bars.note;
    const std::size_t why = note.find("solved: ");  // by a coarser lattice
    return "not known: " + (note.empty()               ? "no error bars (--no-estimate)"
                            : why == std::string::npos ? note
                                                       : note.substr(why + 8));
  }
  const std::string cells = fmt::format(
                        "{} cells beside coarser ones",
                        human_count(result.error_bars.cells.empty() ? body.cell_count()
                                                                    : result.error_bars.cells[0])),
                    left_out = not_counted(unresolved(body));
  constexpr double kRounding = 1 + 1e-12;  // of bars that are 20 % of the value and no more
  if (*worst <= 0.05) return fmt::format("well, {}: {}{}", within(*worst), cells, left_out);
  if (*worst <= 0.2 * kRounding) return fmt::format("fairly, {}: {}{}", within(*worst), cells, left_out);
  if (*worst <= kGuess) return fmt::format("roughly, {}{}{}", within(*worst), reason(result), left_out);
  if (*worst < kBoundless)
    return fmt::format("hardly, off by up to {}{}{}", human_share(*worst), reason(result), left_out);
  return fmt::format("hardly, its error bar is larger than the value{}{}", reason(result), left_out);
}

const std::string& material_of(const Body& body, const std::string& part) {
  static const std::string kNoMaterial;
  for (const Part& each : body.parts)
    if (each.name == part) return each.material;
  return kNoMaterial;
}

// Whether the largest stress has a value that smaller cells would confirm.
bool stress_settles(const SimulateResult& result) {
  return result.error_bars.von_mises && result.error_bars.von_mises->bar;
}

// What is said of a stress where smaller cells would not confirm it, or were asked for in vain. Of another one than the
// largest nobody looked at what lies beside it.
std::string unsure(const SimulateResult& result, double stress) {
  const std::string not_closer =
      result.no_local_stress.empty() ? "" : "; not looked at closer: " + result.no_local_stress;
  const bool is_largest = stress == result.stress->value;
  if (is_largest && stress_settles(result)) return not_closer;
  const std::string& beside = result.stress->beside;
  if (!is_largest || beside.empty()) return "; smaller cells may show more" + not_closer;
  std::string text = fmt::format("; smaller cells show more beside {}", beside);
  if (result.local_stress && result.local_stress->stress.beside.empty()) {
    const LocalStress& local = *result.local_stress;
    text += fmt::format(", and some {} and more away from such places the largest is {} at {}",
                        human_length(clear_of_singular(local)),
                        local.bar ? pressure_with_bar(local.stress.value, local.bar->half_width)
                                  : "about " + human_pressure(local.stress.value),
                        place_in_one_unit(local.stress.at));
  }
  return text + not_closer;
}

std::string peak_stress(const SimulateResult& result, double stress) {
  if (!stress_settles(result) || stress != result.stress->value) return "about " + human_pressure(stress);
  return pressure_with_bar(stress, result.error_bars.von_mises->bar->half_width);
}

// How many times the load could be what it is.
std::string factor(double share) {
  constexpr double kMost = 1000;  // beyond it nobody asks
  if (share * kMost < 1) return "over 1,000";
  return share > kMost ? "under 0.001" : human_number(1 / share, 2);
}

std::string strength(const SimulateResult& result, const Body& body, const std::vector<Material>& materials) {
  if (!result.stress && body.cell_count() == 0)
    return "not known: model \"paper\" has no stresses, its connections pull from element to element";
  if (!result.stress) return "not known: no stresses of this model, or --no-stress";
  if (!(result.stress->value > 0)) return "nothing is stressed";
  std::vector<std::string> unknown;
  const std::optional<StrengthSummary> found = nearest_to_strength(body, materials, unknown);
  if (!found)
    return fmt::format("unknown of {}: its stress is {} at {}{}", material_of(body, result.stress->part),
                       peak_stress(result, result.stress->value), place_in_one_unit(result.stress->at),
                       unsure(result, result.stress->value));
  if (!(found->share > 0)) return "nothing is stressed";
  if (found->nearest_share() <= 1 && result.stress->lacks_bending())
    return fmt::format(
        "not known: walls under two cells thick do not show the stress of their bending ({} without it)",
        human_pressure(found->stress));
  const std::string layers =
      found->layer_share ? fmt::format(" ({} across printed layers)", factor(*found->layer_share)) : "";
  std::string text =
      fmt::format("{}safety factor {}{}: {} of {} at which {} {}, at {}{}",
                  found->share > 1                     ? "TOO WEAK, "
                  : found->layer_share.value_or(0) > 1 ? "TOO WEAK across its layers, "
                                                       : "",
                  factor(found->share), layers, peak_stress(result, found->stress),
                  human_pressure(found->limit), found->material, found->yields ? "yields" : "breaks",
                  place_in_one_unit(found->stress == result.stress->value ? result.stress->at : found->at),
                  unsure(result, found->stress));
  std::vector<std::string> others;
  for (const std::string& part : found->too_weak)
    if (part != found->part) others.push_back(fmt::format("\"{}\"", part));
  if (!others.empty())
    text += fmt::format("; TOO WEAK too: {}{}",
                        fmt::join(others.begin(), others.begin() + std::min(kNamed, others.size()), ", "),
                        more(others.size()));
  if (!unknown.empty()) text += fmt::format("; unknown of {}", fmt::join(unknown, ", "));
  return text;
}

// N, on the body in its `box` at rest: what planes bear is no reaction, but at rest all that loads and reactions lack. Zero:
// no more than the tolerance leaves over, whose scale does not depend on how far the body is from the world's origin.
Vec3 borne_by_planes(const SimulateResult& result, const Box& box) {
  if (!result.settled) return Vec3::Zero();
  const Vec3 middle = 0.5 * (box.min + box.max);
  double scale = 0;
  const auto count = [&](const Vec3& force, const Vec3& moment) {
    scale += force.norm() + (moment - middle.cross(force)).norm() / box.diagonal();
  };
  for (const AppliedLoad& load : result.loads) count(load.force, load.moment);
  for (const Reaction& reaction : result.reactions) count(reaction.force, reaction.moment);
  if (!(result.imbalance.norm() > 10 * result.settled->tolerance * scale)) return Vec3::Zero();
  return -result.imbalance;
}

std::string held_by(const SimulateResult& result, const Body& body) {
  const Box box = bounding_box(body.rest);
  const Vec3 planes = borne_by_planes(result, box);
  const std::string by_planes = planes.isZero(0) ? "" : "planes with " + directed(planes);
  if (result.reactions.empty()) return by_planes.empty() ? "nothing" : by_planes;
  std::string text;
  for (std::size_t r = 0; r < std::min(kNamed, result.reactions.size()); ++r)
    text += fmt::format("{}\"{}\" with {}", text.empty() ? "" : ", ", result.reactions[r].name,
                        borne(result.reactions[r], box.diagonal()));
  text += more(result.reactions.size());
  return by_planes.empty() ? text : text + ", " + by_planes;
}

// Three digits, as an option takes them.
std::string size_digits(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 2);
  return fmt::format("{:.9g}", std::round(value / unit) * unit);
}

std::string usual_next(const SimulateResult& result, const Body& body, const std::string& size_option) {
  const std::optional<double> worst = worst_share(result);
  if (result.timed || (worst && *worst <= 0.05) || body.parts.empty())
    return "--verbose says all that was found, --summary FILE as JSON";
  const double spacing = std::cbrt(body.parts.front().lattice.spacing.prod());
  const bool walls = !worst && !reason(result).empty();
  const double finer = walls ? result.error_bars.refinement : 2;  // else there might be no bar again
  return fmt::format("{} {}mm{}", size_option, size_digits(1e3 * spacing / finer),
                     worst            ? " makes this surer"
                     : result.settled ? ": compare with it"
                                      : " shows how sure this is");
}

}  // namespace

std::vector<std::string> answer_lines(const SimulateResult& result, const Body& body,
                                      const std::vector<Material>& materials, const std::string& next,
                                      const std::string& size_option) {
  if (result.modes) return mode_lines(*result.modes, result.mass);
  std::vector<std::string> lines{"how far    " + how_far(result)};
  if (!result.probes.empty()) lines.push_back("probes     " + probes(result));
  lines.push_back("how sure   " + how_sure(result, body));
  lines.push_back("strength   " + strength(result, body, materials));
  lines.push_back("held by    " + held_by(result, body));
  lines.push_back("next       " + (next.empty() ? usual_next(result, body, size_option) : next));
  return lines;
}

}  // namespace flexel::simulate
