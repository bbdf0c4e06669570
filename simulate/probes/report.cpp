// Measured once a run has ended.
#include "simulate/probes/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/error.h"
#include "base/parallel.h"
#include "base/units.h"
#include "formats/lattice/column_names.h"
#include "formats/lattice/fields.h"
#include "formats/pieces/other_pieces.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/input/infill.h"
#include "simulate/models/connections.h"
#include "simulate/models/rest_shape.h"
#include "simulate/scene/strength.h"

namespace flexel::simulate {

void name_materials(Body& body, const std::vector<Material>& materials) {
  for (std::size_t p = 0; p < body.parts.size(); ++p) body.parts[p].material = materials[p].name;
}

void report_materials(const Problem& problem, Progress& progress) {
  for (std::size_t p = 0; p < problem.materials.size(); ++p)
    if (const std::string line = infill_line(problem.body.parts[p].name, problem.materials[p]); !line.empty())
      progress.say(line);
  for (std::size_t p = 0; p < problem.models.size(); ++p) {
    const Material& material = problem.materials[p];
    const std::string& part = problem.body.parts[p].name;
    if (problem.models[p] == Model::springs && std::abs(material.poisson - 0.25) > 0.005)
      progress.warn(
          fmt::format("part \"{}\": model \"springs\" has Poisson's ratio 0.25, not the {:.3g} of {}", part,
                      material.poisson, material.name));
    if (problem.models[p] == Model::paper && problem.hooke[p] == HookeConstant::isotropic) {
      if (std::abs(material.poisson - 0.25) > 0.005)
        progress.warn(
            fmt::format("part \"{}\": model \"paper\" has Poisson's ratio 0.25, not the {:.3g} of {}", part,
                        material.poisson, material.name));
    } else if (problem.models[p] == Model::paper) {
      progress.warn(fmt::format(
          "part \"{}\": model \"paper\" is stiffer than {} inside (Young's modulus {:.3g} times along the "
          "lattice's axes) and softer at its surface; it is meant for comparison with the paper, not for "
          "sizes; hooke = \"isotropic\" of [parts.\"{}\"] has the modulus of the material",
          part, material.name, axial_stiffness(problem.hooke[p]), part));
    }
  }
}

void report_effects(const std::vector<ActiveEffect>& effects, const std::string& run, bool explain,
                    Progress& progress) {
  if (std::none_of(effects.begin(), effects.end(), [](const ActiveEffect& each) { return each->drives(); }))
    progress.warn("the scene has no [[load]], [[move]] or [gravity]: nothing will move");
  if (!explain) return;
  progress.say("plan: " + run);
  for (const ActiveEffect& effect : effects)
    progress.say(fmt::format("plan: {} ({})", effect.name, effect.why));
}

void report_strays(const Fragments& fragments, SimulateResult& result, Progress& progress) {
  double volume = 0;
  std::size_t crumbs = 0;
  const Fragment* largest = nullptr;
  for (const Fragment& fragment : fragments.list)
    if (fragment.stray) {
      ++crumbs;
      if (!largest || fragment.volume > largest->volume) largest = &fragment;
      result.stray_cells += fragment.size;
      volume += fragment.volume;
    }
  if (crumbs > 0)
    progress.warn(fmt::format(
        "{} loose crumb(s) of {} voxels in all ({}) hang on nothing, the largest near ({}, {}, {}); they are "
        "carried along with the matter nearest to them, and bear nothing; where they are of the part, let "
        "them "
        "overlap with it in its file, else take them out there",
        crumbs, human_count(result.stray_cells), human_volume(volume), human_length(largest->centre.x()),
        human_length(largest->centre.y()), human_length(largest->centre.z())));
}

void report_following(bool alone, Progress& progress) {
  const std::string flutter = "[run] time shows flutter (not method = \"implicit\", which damps it away)";
  if (alone)
    progress.say(
        "no other equilibrium branches off from this one under loads that follow it, but it may flutter, "
        "which "
        "no run at equilibrium sees: " +
        flutter);
  else
    progress.warn(
        "whether this equilibrium is stable under loads that follow it was not found out: the part may "
        "buckle "
        "or flutter; a small load to the side may show buckling, " +
        flutter);
}

void measure_displacement(const Body& body, const State& state, SimulateResult& result) {
  std::optional<SurfacePiece> piece;
  if (other_pieces())
    piece.emplace(SurfacePiece{other_pieces()->polygons_with_cells(), other_pieces()->own_vertices()});
  const LargestDisplacement largest =
      largest_displacement(body, state.displacement, piece ? &*piece : nullptr);
  std::array<double, 4> told{largest.value(), largest.at.x(), largest.at.y(), largest.at.z()};
  if (other_pieces()) (void)other_pieces()->take_of_largest(told[0], told);
  result.largest_displacement = told[0];
  result.largest_displacement_at = Vec3(told[1], told[2], told[3]);
}

// A couple is spread by forces that keep their direction: turned about its axis by an angle, the angle's
// cosine of it is left.
std::vector<std::string> warnings_of(const SimulateResult& result) {
  constexpr double kLargestTurn = 10 * std::numbers::pi / 180;
  std::vector<std::string> warnings;
  for (const AppliedLoad& load : result.loads) {
    if (!load.rotation || load.displacement || load.follower) continue;  // nothing, or no dead couple
    if (const double turn = load.rotation->norm(); turn > kLargestTurn)
      warnings.push_back(fmt::format(
          "load \"{}\" turned what it acts on by {:.0f} degrees, and its forces keep the "
          "direction that they have at rest: about {:.0f} % of its torque is left, and the "
          "result is that of so much; follower = true in its [[load]] (\"..., follower\" in --torque) turns "
          "it with what it acts on",
          load.name, 180 / std::numbers::pi * turn, std::max(0.0, 100 * std::cos(turn))));
  }
  return warnings;
}

void refuse_not_finite(const SimulateResult& result, const std::string& scene) {
  double sum = result.elastic_energy + result.mass + result.largest_displacement + result.imbalance.norm() +
               result.moment_imbalance.norm() + (result.stress ? result.stress->value : 0);
  for (const ProbeResult& probe : result.probes) sum += probe.displacement.norm();
  for (const Reaction& reaction : result.reactions) sum += reaction.force.norm() + reaction.moment.norm();
  std::string largest = "a move, gravity or a part's motion";
  double most = 0;
  for (const AppliedLoad& load : result.loads) {
    sum += load.force.norm() + load.moment.norm();
    if (const double force = load.force.norm(); !(force <= most)) {
      most = force;
      largest = fmt::format("load \"{}\" ({:.3g} N)", load.name, force);
    }
  }
  if (std::isfinite(sum)) return;
  throw DivergedError(
      fmt::format("{}: the result is not finite: {} is beyond what can be computed with; check its "
                  "unit and that of the part",
                  scene, largest));
}

// A cell resists by its mean deformation gradient; a corner of it may fold unnoticed, and with it the surface
// that is mapped through it.
void measure_corners(const SmallestJacobian& smallest, const Body& body, SimulateResult& result,
                     Progress& progress) {
  constexpr double kNearlyFolded = 0.2;
  if (smallest.cell >= whole_cell_count(body)) return;
  result.smallest_corner_jacobian = smallest.value;
  result.smallest_corner_at = other_pieces() ? other_pieces()->rest_of_corner(smallest.cell, smallest.corner)
                                             : body.rest[body.cell_elements[smallest.cell][smallest.corner]];
  if (smallest.value > kNearlyFolded) return;
  const Vec3& at = result.smallest_corner_at;
  progress.warn(
      fmt::format("a corner of a cell near ({}, {}, {}) {} (J = {:.2g}): the result is coarse there; "
                  "use a smaller spacing, or spread the load or the fix over a larger area",
                  human_length(at.x()), human_length(at.y()), human_length(at.z()),
                  smallest.value > 0 ? "is nearly folded" : "is folded", smallest.value));
}

void measure_stress(const Problem& problem, const State& state, Body& body, SimulateResult& result) {
  if (body.cell_count() == 0) return;
  Stresses found = stresses(problem, state);
  if (other_pieces()) {
    other_pieces()->take_from_owners(std::span(found.element.data()->data(), 6 * found.element.size()), 6);
    other_pieces()->take_from_owners(std::span(found.element_at.data()->data(), 3 * found.element_at.size()),
                                     3);
  }
  report_stress(problem, found, body, result);
  if (result.stress) result.stress->thin_walls = share_of_thin_walls(body, 2);
}

namespace {

// (parts) Pa; 0: none, or edits changed it, or model `paper`, which has no stresses, or an orthotropic law, whose
// strengths along and across the grain no von Mises stress compares with.
std::vector<double> yields_of_parts(const Body& body, const std::vector<Material>& materials) {
  std::vector<double> yields;
  for (std::size_t p = 0; p < body.parts.size(); ++p) {
    const bool none = body.parts[p].placement == Placement::centre ||
                      materials[p].law == LawName::orthotropic || has_edited_limits(body, body.parts[p]);
    yields.push_back(none ? 0 : materials[p].yield);
  }
  return yields;
}

// Of the surface's vertices, where a part has a yield stress.
void write_yield_shares(const std::vector<double>& yields, const std::vector<SymmetricStress>& vertex,
                        Surface& surface) {
  if (std::none_of(yields.begin(), yields.end(), [](double each) { return each > 0; })) return;
  Column share{1, std::vector<double>(vertex.size(), -1)};
  for (std::size_t p = 0; p < surface.polygon_count(); ++p)
    if (const double yield = yields[surface.polygon_part(p)]; yield > 0)
      for (const std::uint32_t v : surface.polygon(p)) share.values[v] = von_mises(vertex[v]) / yield;
  surface.vertex_columns[kYieldColumn] = std::move(share);
}

}  // namespace

void report_stress(const Problem& problem, const Stresses& stresses, Body& body, SimulateResult& result) {
  std::optional<LargestStress> largest = largest_stress(body, stresses);
  if (!largest) return;
  if (other_pieces()) {
    std::array<double, 4> told{largest->value, largest->at.x(), largest->at.y(), largest->at.z()};
    (void)other_pieces()->take_of_largest(told[0], told);
    largest->value = told[0];
    largest->at = Vec3(told[1], told[2], told[3]);
  }
  const std::vector<double> yields = yields_of_parts(body, problem.materials);
  result.stress = StressSummary{largest->value, largest->at, body.parts[largest->part].name, {}};
  result.stress->doubt = largest->doubt;
  if (const double yield = yields[largest->part]; yield > 0)
    result.stress->yield_share = largest->value / yield;
  write_stress_columns(stresses, body);
  if (!stresses.vertex.empty()) write_yield_shares(yields, stresses.vertex, body.surface);
}

void sum_up_imbalance(SimulateResult& result) {
  for (const AppliedLoad& load : result.loads) {
    result.imbalance += load.force;
    result.moment_imbalance += load.moment;
  }
  for (const Reaction& reaction : result.reactions) {
    result.imbalance += reaction.force;
    result.moment_imbalance += reaction.moment;
  }
}

double mass_of(const Problem& problem) {
  const std::vector<std::uint32_t> part = cell_parts(problem.body);
  const std::vector<double> share = mass_shares(problem.body), factor = mass_factors(problem.body);
  double mass = parallel_sum<double>(problem.body.cell_count(), [&](std::size_t c) {
    if (!counts_cell(static_cast<std::uint32_t>(c))) return 0.0;
    return share[c] * problem.materials[part[c]].density * problem.body.parts[part[c]].lattice.spacing.prod();
  });
  for (std::size_t p = 0; p < problem.body.parts.size(); ++p) {
    const Part& each = problem.body.parts[p];
    if (each.placement != Placement::centre) continue;
    const double whole = problem.materials[p].density * each.lattice.spacing.prod();
    mass += factor.empty() ? (each.element_end - each.element_begin) * whole
                           : whole * std::accumulate(factor.begin() + each.element_begin,
                                                     factor.begin() + each.element_end, 0.0);
  }
  return over_pieces(mass);
}

void add_shares(const std::vector<EffectShare>& shares, std::vector<EffectShare>& all) {
  std::vector<bool> free(all.size(), true);  // two of one name are two
  for (const EffectShare& share : shares) {
    std::size_t i = 0;
    while (i < free.size() && !(free[i] && all[i].name == share.name)) ++i;
    if (i == free.size()) {
      all.push_back(share);
      continue;
    }
    free[i] = false;
    all[i].why = share.why;
    all[i].seconds += share.seconds;
  }
}

void explain_times(const std::vector<EffectShare>& shares, double seconds, Progress& progress) {
  double rest = seconds;
  const auto line = [&](const std::string& name, double taken) {
    progress.say(
        fmt::format("time: {:<14} {:8.3f} s {:5.1f} %", name, taken, 100 * taken / std::max(seconds, 1e-9)));
  };
  for (const EffectShare& share : shares) {
    line(share.name, share.seconds);
    rest -= share.seconds;
  }
  line("the rest", std::max(rest, 0.0));
}

double body_extent(const Body& body) {
  Vec3 low = body.rest[0], high = low;
  for (const Vec3& at : body.rest) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  return (high - low).norm();
}

}  // namespace flexel::simulate
