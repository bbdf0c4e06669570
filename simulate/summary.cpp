// The result of a run as JSON and as lines for people.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/error.h"
#include "base/files/json.h"
#include "base/human.h"
#include "base/units.h"
#include "base/version.h"
#include "formats/lattice/column_names.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/probes/report.h"
#include "simulate/quadratic/local_stress.h"
#include "simulate/result/result.h"
#include "simulate/scene/strength.h"
#include "simulate/summary.h"

namespace flexel::simulate {
namespace {

using Json = nlohmann::ordered_json;

Json vector(const Vec3& value) {
  return Json::array({value.x(), value.y(), value.z()});
}

// Components that are only rounding beside the largest are shown as 0.
Vec3 without_rounding(Vec3 value) {
  for (double& each : value)
    if (std::abs(each) < 1e-6 * value.cwiseAbs().maxCoeff()) each = 0;
  return value;
}

std::string lengths(const Vec3& exact) {
  const Vec3 value = without_rounding(exact);
  return fmt::format("({}, {}, {})", human_length(value.x()), human_length(value.y()),
                     human_length(value.z()));
}

std::string forces(const Vec3& exact) {
  const Vec3 value = without_rounding(exact);
  return fmt::format("({}, {}, {})", human_force(value.x()), human_force(value.y()), human_force(value.z()));
}

// The force, or the moment of a couple.
std::string resultant(const Vec3& force, const Vec3& moment) {
  constexpr double kCouple = 1e-6;  // 1/m, force over moment: a lever no part has
  if (moment.norm() == 0 || force.norm() > kCouple * moment.norm()) return forces(force);
  const Vec3 shown = without_rounding(moment);
  return fmt::format("({:.3g}, {:.3g}, {:.3g}) N m", shown.x(), shown.y(), shown.z());
}

// "; its point moves by (...) and turns by (...) deg" of a rigid link, or nothing.
std::string link_motion(const AppliedLoad& load) {
  if (!load.rotation || !(load.displacement || load.follower)) return "";
  const Vec3 shown = 180 / M_PI * without_rounding(*load.rotation);
  if (!load.displacement)
    return fmt::format("; it turned by ({:.3g}, {:.3g}, {:.3g}) deg", shown.x(), shown.y(), shown.z());
  return fmt::format("; its point moves by {} and turns by ({:.3g}, {:.3g}, {:.3g}) deg",
                     lengths(*load.displacement), shown.x(), shown.y(), shown.z());
}

// " +- 12 um", or nothing.
std::string bar_of(const SimulateResult& result, ErrorBar::Of of, std::size_t probe = 0) {
  for (const ErrorBar& each : result.error_bars.bars)
    if (each.of == of && each.probe == probe)
      return of == ErrorBar::Of::elastic_energy ? fmt::format(" +- {:.2g} J", each.bar.half_width)
                                                : " +- " + human_length(each.bar.half_width);
  return "";
}

// Likewise of the largest stress, or that it has none.
std::string stress_bar_of(const SimulateResult& result) {
  const std::optional<StressBar>& found = result.error_bars.von_mises;
  if (!found) return "";
  if (found->bar) return " +- " + human_pressure(found->bar->half_width);
  const std::string& beside = result.stress->beside;
  return fmt::format(", which {} ({}, {}, {} as the cells get smaller),",
                     beside.empty() ? "does not converge" : "has no limit beside " + beside,
                     human_pressure(found->value[2]), human_pressure(found->value[1]),
                     human_pressure(found->value[0]));
}

// Of the share of yield, which is in proportion to the largest stress; nothing where either has none.
std::optional<double> yield_share_bar(const SimulateResult& result) {
  const std::optional<StressBar>& bar = result.error_bars.von_mises;
  if (!bar || !bar->bar || !result.stress->yield_share || !(result.stress->value > 0)) return std::nullopt;
  return *result.stress->yield_share * bar->bar->half_width / result.stress->value;
}

// "looked at closer at 1 place, 1,204 cells in 1.3 s: 25.5 MPa, 27.1 MPa, 27.3 MPa down to cells of 0.6 mm"
std::string local_stress_line(const SimulateResult& result) {
  if (!result.no_local_stress.empty())
    return "the largest stress was not looked at closer: " + result.no_local_stress;
  if (!result.local_stress) return "";
  const LocalStress& local = *result.local_stress;
  std::string line = fmt::format("looked at closer at {} place(s), {} cells in {:.1f} s", local.places,
                                 human_count(local.cells), local.seconds);
  std::vector<std::string> values;
  for (auto each = local.values.rbegin(); each != local.values.rend(); ++each)
    values.push_back(human_pressure(*each));
  line += fmt::format(": {} down to cells of {}", fmt::join(values, ", "), human_length(local.spacing));
  if (result.stress->beside.empty() || !local.stress.beside.empty()) return line;
  return line +
         fmt::format(
             "; this is the largest some {} and more from supports, bonds and sharp edges, {}{}, at {}",
             human_length(clear_of_singular(local)), human_pressure(local.stress.value),
             local.bar ? " +- " + human_pressure(local.bar->half_width) : "", lengths(local.stress.at));
}

Json local_stress_json(const LocalStress& local) {
  return {{"value", local.stress.value},   {"bar", local.bar ? Json(local.bar->half_width) : Json()},
          {"at", vector(local.stress.at)}, {"clear_of_singular", clear_of_singular(local)},
          {"values", local.values},        {"spacing", local.spacing},
          {"places", local.places},        {"cells", local.cells},
          {"seconds", local.seconds}};
}

Json error_bars_json(const ErrorBars& errors) {
  Json json;
  json["cells"] = errors.cells;
  json["note"] = errors.note;
  json["seconds"] = errors.seconds;
  json["bars"] = Json::array();
  for (const ErrorBar& each : errors.bars) {
    Json bar = {{"of", each.name()},
                {"value", each.value},
                {"bar", each.bar.half_width},
                {"extrapolated", each.bar.extrapolated}};
    bar["order"] = each.bar.order ? Json(*each.bar.order) : Json(nullptr);
    json["bars"].push_back(bar);
  }
  if (errors.von_mises) {
    const std::optional<Bar>& bar = errors.von_mises->bar;
    const bool ordered = bar && bar->order;
    json["largest_von_mises"] = {{"values", errors.von_mises->value},
                                 {"bar", bar ? Json(bar->half_width) : Json(nullptr)},
                                 {"extrapolated", bar ? Json(bar->extrapolated) : Json(nullptr)},
                                 {"order", ordered ? Json(*bar->order) : Json(nullptr)}};
  }
  return json;
}

// "error bars from 2,048, 256 and 32 cells in 0.01 s, observed order 1.9
// to 2.1"
std::string error_bars_line(const ErrorBars& errors) {
  if (errors.bars.empty()) return "no error bars: " + errors.note;
  std::vector<std::string> cells;
  for (const std::size_t each : errors.cells) cells.push_back(human_count(each));
  std::string line =
      fmt::format("error bars from {} cells in {:.2f} s", fmt::join(cells, ", "), errors.seconds);
  double least = 1e300, most = -1e300;
  for (const ErrorBar& each : errors.bars)
    if (each.bar.order) {
      least = std::min(least, *each.bar.order);
      most = std::max(most, *each.bar.order);
    }
  if (least <= most) line += fmt::format(", observed order {:.1f} to {:.1f}", least, most);
  const auto wide = std::count_if(errors.bars.begin(), errors.bars.end(),
                                  [](const ErrorBar& each) { return !each.bar.order; });
  if (wide > 0 && errors.note.empty())
    line += fmt::format(
        "; {} of {} quantities do not approach a limit evenly: "
        "their bars are three times the largest "
        "difference",
        wide, errors.bars.size());
  if (!errors.note.empty()) line += "; " + errors.note;
  return line;
}

double rms_jitter(const LiveSummary& live) {
  return live.frames > 1 ? std::sqrt(live.jitter_squared / static_cast<double>(live.frames - 1)) : 0;
}

Json live_json(const LiveSummary& live) {
  Json json = {{"poses", live.poses}, {"poses_ended", live.poses_ended}, {"rate", live.rate}};
  if (live.rate == 0) return json;
  json["frames"] = live.frames;
  json["late"] = live.late;
  json["missed"] = live.missed;
  json["behind"] = live.behind;
  json["jitter"] = rms_jitter(live);
  json["worst_jitter"] = live.worst_jitter;
  json["readers"] = live.readers;
  json["dropped"] = live.dropped;
  return json;
}

// A line each for a few; of more their sum and the least, where an assembly gives way first.
void add_bonds(const std::vector<BondedParts>& bonds, std::vector<std::string>& lines) {
  constexpr std::size_t kFew = 3;
  if (bonds.size() <= kFew) {
    for (const BondedParts& bond : bonds)
      lines.push_back(fmt::format("\"{}\" and \"{}\" are bonded over {:.4g} mm2", bond.parts[0],
                                  bond.parts[1], bond.area * 1e6));
    return;
  }
  const auto less = [](const BondedParts& a, const BondedParts& b) { return a.area < b.area; };
  const BondedParts& least = *std::min_element(bonds.begin(), bonds.end(), less);
  double sum = 0;
  for (const BondedParts& bond : bonds) sum += bond.area;
  lines.push_back(fmt::format(
      "{} pairs of parts are bonded, over {:.4g} mm2 in all, \"{}\" and \"{}\" over the least, {:.4g} "
      "mm2",
      bonds.size(), sum * 1e6, least.parts[0], least.parts[1], least.area * 1e6));
}

std::string live_line(const LiveSummary& live) {
  const std::string poses = fmt::format("live: {} pose(s)", human_count(live.poses));
  if (live.rate == 0) return poses;
  return fmt::format(
      "{}, {} frame(s) at {:.6g} a second, {} late, {} missed, {:.3g} s behind real time; jitter {:.3g} ms, "
      "at "
      "most {:.3g} ms; {} reader(s), {} frame(s) dropped",
      poses, human_count(live.frames), live.rate, human_count(live.late), human_count(live.missed),
      live.behind, 1e3 * rms_jitter(live), 1e3 * live.worst_jitter, live.readers, human_count(live.dropped));
}

Json modes_json(const ModesSummary& summary) {
  Json json = {{"rigid", summary.rigid},
               {"prestressed", summary.prestressed},
               {"iterations", summary.iterations},
               {"largest_displacement", summary.shape}};
  json[summary.buckling ? "buckling" : "modes"] = Json::array();
  for (const Mode& mode : summary.modes) {
    Json each;
    if (summary.buckling)
      each["load_factor"] = mode.load_factor;
    else
      each = {{"frequency", mode.frequency}, {"effective_mass", vector(mode.effective_mass)}};
    each["error"] = mode.error;
    each["probes"] = Json::array();
    for (const Vec3& probe : mode.probes) each["probes"].push_back(vector(probe));
    json[summary.buckling ? "buckling" : "modes"].push_back(each);
  }
  return json;
}

Json run_json(const SimulateResult& result) {
  Json json;
  if (result.timed) {
    json["timed"] = {{"time", result.timed->time},
                     {"steps", result.timed->steps},
                     {"step", result.timed->step},
                     {"isa", result.timed->isa}};
    for (const auto& [name, joules] : result.timed->books) json["timed"]["books"][name] = joules;
    if (result.timed->live) json["timed"]["live"] = live_json(*result.timed->live);
  } else if (result.settled) {
    json["settled"] = {{"steps", result.settled->steps},
                       {"relative_residual", result.settled->residual},
                       {"kinetic_energy", result.settled->kinetic},
                       {"tolerance", result.settled->tolerance}};
  } else {
    json["unknowns"] = result.unknowns;
    json["load_steps"] = result.load_steps;
    json["newton_iterations"] = result.newton_iterations;
    json["cg_iterations"] = result.cg_iterations;
    json["relative_residual"] = result.relative_residual;
  }
  return json;
}

Json loads_json(const std::vector<AppliedLoad>& loads) {
  Json json = Json::array();
  for (const AppliedLoad& load : loads) {
    json.push_back({{"name", load.name}, {"force", vector(load.force)}, {"moment", vector(load.moment)}});
    if (load.displacement) json.back()["displacement"] = vector(*load.displacement);
    if (load.rotation) json.back()["rotation"] = vector(*load.rotation);
    if (load.follower) json.back()["follower"] = true;
  }
  return json;
}

// How the run went, the last line.
std::string run_line(const SimulateResult& result) {
  const std::string corner = result.smallest_corner_jacobian
                                 ? fmt::format(" (at a corner {:.4g})", *result.smallest_corner_jacobian)
                                 : "";
  if (result.timed)
    return fmt::format(
        "{} steps of {:.4g} s to {:.6g} s in {:.2f} s (kernel {}), elastic energy {:.4g} J, smallest J "
        "{:.4g}{}",
        result.timed->steps, result.timed->step, result.timed->time, result.seconds, result.timed->isa,
        result.elastic_energy, result.smallest_jacobian, corner);
  if (result.settled)
    return fmt::format(
        "at rest after {} steps in {:.2f} s: residual {:.1e}, kinetic energy {:.2g} J; elastic "
        "energy {:.4g} J, smallest J {:.4g}{}",
        human_count(result.settled->steps), result.seconds, result.settled->residual, result.settled->kinetic,
        result.elastic_energy, result.smallest_jacobian, corner);
  return fmt::format(
      "elastic energy {:.4g} J{}, smallest J {:.4g}{}, {} unknowns, {} load step(s), {} Newton and {} CG "
      "iterations, residual {:.1e}, {:.2f} s",
      result.elastic_energy, bar_of(result, ErrorBar::Of::elastic_energy), result.smallest_jacobian, corner,
      human_count(result.unknowns), result.load_steps, result.newton_iterations, result.cg_iterations,
      result.relative_residual, result.seconds);
}

// What was told has the scene's name before it.
std::vector<std::string> all_warnings(const SimulateResult& result, const std::vector<std::string>& told) {
  std::vector<std::string> all = told;
  for (const std::string& warning : warnings_of(result))
    if (std::none_of(told.begin(), told.end(),
                     [&](const std::string& line) { return line.ends_with(warning); }))
      all.push_back(warning);
  return all;
}

// Of several materials the largest stress may be far from its limit, and a smaller one beyond its own.
Json strength_json(const SimulateResult& result, const Body& body, const std::vector<Material>& materials) {
  Json json = Json::object();
  std::vector<std::string> unknown;
  const std::optional<StrengthSummary> found = nearest_to_strength(body, materials, unknown);
  if (found && found->nearest_share() <= 1 && result.stress->lacks_bending()) {
    json["none"] = "walls under two cells thick do not show the stress of their bending";
  } else if (found) {
    json["share"] = found->share;
    json["stress"] = found->stress;
    json["limit"] = found->limit;
    json["limit_is"] = found->yields ? "yield" : "strength";
    json["at"] = vector(found->stress == result.stress->value ? result.stress->at : found->at);
    json["part"] = found->part;
    json["material"] = found->material;
    if (found->layer_share) json["layer_share"] = *found->layer_share;
    json["too_weak"] = found->too_weak;
  }
  json["unknown"] = unknown;
  return json;
}

void add_stress(const SimulateResult& result, const Body& body, const std::vector<Material>& materials,
                Json& json) {
  json["largest_von_mises"] = result.stress->value;
  json["largest_von_mises_at"] = vector(result.stress->at);
  json["largest_von_mises_part"] = result.stress->part;
  if (!result.stress->beside.empty()) json["largest_von_mises_beside"] = result.stress->beside;
  if (result.stress->thin_walls > 0) json["largest_von_mises_thin_walls"] = result.stress->thin_walls;
  if (result.stress->yield_share) json["largest_von_mises_yield_share"] = *result.stress->yield_share;
  if (const std::optional<double> bar = yield_share_bar(result))
    json["largest_von_mises_yield_share_bar"] = *bar;
  if (result.local_stress) json["largest_von_mises_local"] = local_stress_json(*result.local_stress);
  if (!result.no_local_stress.empty()) json["largest_von_mises_local_none"] = result.no_local_stress;
  json["strength"] = strength_json(result, body, materials);
}

}  // namespace

std::string summary_json(const SimulateResult& result, const Body& body,
                         const std::vector<Material>& materials, const std::vector<std::string>& told) {
  Json json;
  json["program"] = "flexel-simulate";
  json["version"] = version();
  json["elements"] = whole_element_count(body);
  json["cells"] = whole_cell_count(body);
  json["stray_cells"] = result.stray_cells;
  json["parts"] = Json::array();
  for (const Part& part : body.parts)
    json["parts"].push_back(
        {{"name", part.name}, {"material", part.material}, {"spacing", vector(part.lattice.spacing)}});
  json["mass"] = result.mass;
  json["largest_displacement"] = result.largest_displacement;
  json["largest_displacement_at"] = vector(result.largest_displacement_at);
  json["warnings"] = all_warnings(result, told);
  json["probes"] = Json::array();
  for (const ProbeResult& probe : result.probes)
    json["probes"].push_back(
        {{"name", probe.name}, {"at", vector(probe.where)}, {"displacement", vector(probe.displacement)}});
  json["loads"] = loads_json(result.loads);
  json["reactions"] = Json::array();
  for (const Reaction& reaction : result.reactions)
    json["reactions"].push_back({{"name", reaction.name},
                                 {"force", vector(reaction.force)},
                                 {"moment", vector(reaction.moment)},
                                 {"middle", vector(reaction.middle)}});
  json["bonds"] = Json::array();
  for (const BondedParts& bond : result.bonds)
    json["bonds"].push_back({{"parts", bond.parts}, {"area", bond.area}});
  json["imbalance"] = vector(result.imbalance);
  json["moment_imbalance"] = vector(result.moment_imbalance);
  json["elastic_energy"] = result.elastic_energy;
  if (!result.error_bars.bars.empty() || !result.error_bars.note.empty())
    json["error_bars"] = error_bars_json(result.error_bars);
  if (const std::vector<std::string> lines = unresolved(body); !lines.empty()) json["unresolved"] = lines;
  json["smallest_jacobian"] = result.smallest_jacobian;
  if (result.smallest_corner_jacobian) {
    json["smallest_corner_jacobian"] = *result.smallest_corner_jacobian;
    json["smallest_corner_at"] = vector(result.smallest_corner_at);
  }
  if (result.stress) add_stress(result, body, materials, json);
  if (result.modes) json["shapes"] = modes_json(*result.modes);
  json.update(run_json(result));
  json["seconds"] = result.seconds;
  json["time"] = Json::array();
  for (const EffectShare& effect : result.shares)
    json["time"].push_back({{"name", effect.name}, {"why", effect.why}, {"seconds", effect.seconds}});
  return json_text(json, 2) + "\n";
}

std::vector<std::string> unresolved(const Body& body) {
  std::vector<std::string> lines;
  const std::string only = body.parts.size() == 1 ? fmt::format(" of \"{}\"", body.parts[0].name) : "";
  for (const bool walls : {true, false}) {
    const auto note = body.notes.find(walls ? kLostWallsNote : kJoinedPiecesNote);
    if (note == body.notes.end() || (walls && QuadraticField::is_in(body))) continue;
    std::istringstream text(note->second);
    for (std::string line; std::getline(text, line);) {
      if (const std::size_t at = line.find(only); at != std::string::npos) line.erase(at, only.size());
      lines.push_back(line);
    }
  }
  return lines;
}

std::vector<std::string> summary_lines(const SimulateResult& result) {
  if (result.modes) return {};  // answer_lines() has them
  std::vector<std::string> lines;
  lines.push_back(fmt::format("largest displacement {}{} at {}", human_length(result.largest_displacement),
                              bar_of(result, ErrorBar::Of::largest_displacement),
                              lengths(result.largest_displacement_at)));
  for (std::size_t p = 0; p < result.probes.size(); ++p) {
    const ProbeResult& probe = result.probes[p];
    lines.push_back(fmt::format("probe \"{}\" moved {}{}: {}", probe.name,
                                human_length(probe.displacement.norm()),
                                bar_of(result, ErrorBar::Of::probe, p), lengths(probe.displacement)));
  }
  if (result.stress) {
    std::string share = result.stress->yield_share
                            ? fmt::format(", {} of yield", human_share(*result.stress->yield_share))
                            : "";
    if (result.stress->lacks_bending()) share += ", without the bending of walls under two cells thick";
    lines.push_back(fmt::format("largest von Mises stress {}{} in \"{}\" at {}{}",
                                human_pressure(result.stress->value), stress_bar_of(result),
                                result.stress->part, lengths(result.stress->at), share));
  }
  if (const std::string line = local_stress_line(result); !line.empty()) lines.push_back(line);
  for (const AppliedLoad& load : result.loads)
    lines.push_back(
        fmt::format("load \"{}\": {}{}", load.name, resultant(load.force, load.moment), link_motion(load)));
  for (const Reaction& reaction : result.reactions)
    lines.push_back(
        fmt::format("reaction of \"{}\": {}", reaction.name, resultant(reaction.force, reaction.moment)));
  add_bonds(result.bonds, lines);
  lines.push_back(run_line(result));
  if (result.timed) {
    std::string books;
    for (const auto& [name, joules] : result.timed->books)
      books += fmt::format("{}{} {:.4g} J", books.empty() ? "" : ", ", name, joules);
    if (!books.empty()) lines.push_back("books: " + books);
    if (result.timed->live) lines.push_back(live_line(*result.timed->live));
  } else if (!result.settled && (!result.error_bars.bars.empty() || !result.error_bars.note.empty())) {
    lines.push_back(error_bars_line(result.error_bars));
  }
  return lines;
}

}  // namespace flexel::simulate
