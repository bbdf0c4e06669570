// What a run found.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/math/vec.h"
#include "simulate/result/estimate.h"

namespace flexel::simulate {

struct ProbeResult {
  std::string name;
  Vec3 where = Vec3::Zero();         // m, rest position
  Vec3 displacement = Vec3::Zero();  // m
};

struct Reaction {  // of one [[fix]] or [[move]]
  std::string name;
  Vec3 force = Vec3::Zero();   // N, by the support on the body
  Vec3 moment = Vec3::Zero();  // N m, about the world's origin, where the body is now
  Vec3 middle = Vec3::Zero();  // m: the mean place, now, of what is held
  bool is_move = false;        // of a [[move]] or an [[indenter]]
  [[nodiscard]] Vec3 moment_about_middle() const { return moment - middle.cross(force); }
};

struct AppliedLoad {  // of one [[load]], or of gravity
  std::string name;
  Vec3 force = Vec3::Zero();   // N, in total
  Vec3 moment = Vec3::Zero();  // N m, about the world's origin, where the body is now
  // Of a rigid link: how far its point went [m]. Of that or of a couple: the rotation vector that it
  // turned what it acts on by [rad]; of one that follows, whole turns included
  std::optional<Vec3> displacement = {}, rotation = {};
  bool follower = false;  // it turned with what it acts on
};

// Adds a force at a place to a resultant and its moment about the origin.
inline void add_at(const Vec3& force, const Vec3& place, Vec3& sum, Vec3& moment) {
  sum += force;
  moment += place.cross(force);
}

struct BondedParts {  // two parts that touch
  std::array<std::string, 2> parts;
  double area = 0;  // m^2, over which they do
};

struct EffectShare {  // an effect that ran, why, and how long it took
  std::string name, why;
  double seconds = 0;
};

struct StressSummary {     // of the largest von Mises stress
  double value = 0;        // Pa
  Vec3 at = Vec3::Zero();  // m, rest position
  std::string part;
  std::optional<double> yield_share;  // of the part's material; nothing where it has no `yield`
  std::string beside = {};  // why it grows without bound as cells get smaller (singular_beside()); "" if not
  double doubt = 0;         // Pa, of model `quadratic`: between one cell's field and that of the cells around
  double thin_walls = 0;  // share of the matter in walls under two cells, whose bending is not in the stress
  [[nodiscard]] bool lacks_bending() const { return thin_walls > 0.2; }
};

// The largest von Mises stress, looked at on finer cells around it (simulate/quadratic/local_stress.h).
struct LocalStress {
  StressSummary stress;
  std::vector<double>
      values;  // Pa, on the finest cells first, the run's own last; none: it lies where nobody looked closer
  double spacing = 0;  // m, of the finest
  std::string beside;  // a singularity that the finer cells show; "" if not
  std::optional<Bar> bar;
  std::size_t places = 0, cells = 0;  // that were looked at; of all finer lattices together
  double seconds = 0;
};

struct SettleSummary {  // of equilibrium with contact (simulate/time/dynamic_relaxation.h)
  std::uint64_t steps = 0;
  double residual = 0;   // forces left over, relative to loads and reactions
  double kinetic = 0;    // J, left over
  double tolerance = 0;  // of both; that of the kinetic energy relative to its largest
};

struct LiveSummary {        // of a run with poses from stdin or --live (docs/guide/live.md)
  std::uint64_t poses = 0;  // that came in
  bool poses_ended = false;
  double rate = 0;  // 1/s, of frames; 0: none were written, and real time was not kept
  std::uint64_t frames = 0, late = 0, missed = 0;
  double behind = 0;                       // s, of real time that late frames let go
  double jitter_squared = 0;               // s^2, sum over frames, of the time between two
  double worst_jitter = 0;                 // s
  std::uint64_t readers = 0, dropped = 0;  // that came; frames that one of them was too slow for
};

struct TimedSummary {  // of a run in time
  double time = 0;     // s, reached
  std::uint64_t steps = 0;
  double step = 0;                                    // s, the last one
  std::string isa;                                    // instruction set of the kernel
  std::vector<std::pair<std::string, double>> books;  // J, by name; with a history only
  std::optional<LiveSummary> live = {};
};

struct Mode {              // a natural vibration, or a shape of buckling
  double frequency = 0;    // Hz; of vibrations
  double load_factor = 0;  // of buckling: times the loads of the scene
  double error = 0;        // of the frequency or the factor, relative: what the iteration left over
  Vec3 effective_mass =
      Vec3::Zero();          // kg, by axis of the world: what moves along with it when the ground does
  std::vector<Vec3> probes;  // m, of the scene's probes, in the shape as it is written
};

struct ModesSummary {       // of a run with [run] modes or buckling
  std::vector<Mode> modes;  // lowest first, those of rigid motions left out
  std::size_t rigid = 0;    // motions at 0 Hz
  double shape = 0;         // m, that the shapes go at most where they are written
  int iterations = 0;
  bool buckling = false;
  bool prestressed = false;  // by loads of the scene
};

struct SolverCounts {
  int load_steps = 0, newton_iterations = 0, cg_iterations = 0;
  int start_newton_iterations = 0;  // the most on a coarser lattice that the run started from
  std::size_t unknowns = 0;         // displacements of nodes along an axis that nothing prescribes
  double relative_residual = 0;
  double seconds = 0;
};

struct SimulateResult : SolverCounts {
  ErrorBars error_bars;  // at equilibrium
  std::vector<ProbeResult> probes;
  std::vector<Reaction> reactions;
  std::vector<AppliedLoad> loads;
  std::vector<BondedParts> bonds;
  Vec3 imbalance = Vec3::Zero();         // N, sum of loads and reactions; 0 but for the tolerance
  Vec3 moment_imbalance = Vec3::Zero();  // N m, likewise
  std::vector<EffectShare> shares;
  std::size_t stray_cells = 0;      // in loose crumbs that were carried along, not simulated
  double largest_displacement = 0;  // m, of the matter (formats/lattice/fields.h)
  Vec3 largest_displacement_at = Vec3::Zero();
  double elastic_energy = 0;     // J
  double mass = 0;               // kg
  std::string strain_warning;    // of model `quadratic`: that strains are not small; "" where they are
  double smallest_jacobian = 1;  // of all cells' mean gradients, and those around elements at centres
  // of the trilinear map at the cells' corners; <= 0: folded there; nothing without cells
  std::optional<double> smallest_corner_jacobian;
  Vec3 smallest_corner_at = Vec3::Zero();  // m, rest position of that corner
  std::optional<StressSummary> stress;     // nothing where no part has stresses, or they were not asked for
  std::optional<TimedSummary> timed;
  std::optional<SettleSummary> settled;
  std::optional<ModesSummary> modes;
  std::optional<LocalStress> local_stress;
  std::string no_local_stress;  // why it was not looked closer; "" where it was, or nobody asked
};

}  // namespace flexel::simulate
