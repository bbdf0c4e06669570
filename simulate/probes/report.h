// What every run measures and says, at equilibrium or in time.
#pragma once
#include "base/program/progress.h"
#include "simulate/effects/effect.h"
#include "simulate/matter/fragments.h"
#include "simulate/matter/stress.h"
#include "simulate/models/cells.h"
#include "simulate/result/result.h"

namespace flexel::simulate {

void name_materials(Body& body, const std::vector<Material>& materials);

// What an infill leaves of a part's material, and what models `springs` and `paper` cannot follow of one.
void report_materials(const Problem& problem, Progress& progress);

// Says what acts where --explain asks for it, beginning with what the run does; and that nothing moves, where nothing drives.
void report_effects(const std::vector<ActiveEffect>& effects, const std::string& run, bool explain,
                    Progress& progress);

// Counts the cells of loose crumbs in the result, and warns of them.
void report_strays(const Fragments& fragments, SimulateResult& result, Progress& progress);

// Largest displacement of the part's matter. `body` is at the state already.
void measure_displacement(const Body& body, const State& state, SimulateResult& result);

// Smallest J at the corners of the cells, with a warning where one is folded or nearly so.
void measure_corners(const SmallestJacobian& smallest, const Body& body, SimulateResult& result,
                     Progress& progress);

// The stresses of the final state: columns of the body, and the largest. Model `paper` has none.
void measure_stress(const Problem& problem, const State& state, Body& body, SimulateResult& result);
// Those that are known already.
void report_stress(const Problem& problem, const Stresses& stresses, Body& body, SimulateResult& result);

// Says what is known of an equilibrium under loads that follow. `alone`: no other branches off there; else nobody found out,
// which is a warning. Flutter needs masses, and no run at equilibrium sees it.
void report_following(bool alone, Progress& progress);

// What is left of loads and reactions, summed.
void sum_up_imbalance(SimulateResult& result);

[[nodiscard]] double mass_of(const Problem& problem);  // kg, of the unbroken matter

// What makes figures of a result worth less than they look, for people: torques that turn what they act on by
// more than 10 degrees.
[[nodiscard]] std::vector<std::string> warnings_of(const SimulateResult& result);

// Throws DivergedError where a figure of the result is NaN or infinite, naming the largest load.
void refuse_not_finite(const SimulateResult& result, const std::string& scene);

// Adds the times that effects took in one stretch of a run to those of the stretches before: an effect that
// was there already goes on.
void add_shares(const std::vector<EffectShare>& shares, std::vector<EffectShare>& all);

// What --explain says after a run of so many seconds: the time of each share, and what is in none of them.
void explain_times(const std::vector<EffectShare>& shares, double seconds, Progress& progress);

// Diagonal of the box around the elements at rest [m].
[[nodiscard]] double body_extent(const Body& body);

}  // namespace flexel::simulate
