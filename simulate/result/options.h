// How a run is to be done, but for its scene.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace flexel {
struct Body;  // formats/lattice/body.h
}

namespace flexel::simulate {

struct LatticeBox;     // simulate/matter/voxel_pieces.h
struct Checkpoint;     // simulate/time/checkpoint.h
struct LoadStepHooks;  // simulate/equilibrium/equilibrium.h

// The matter of the run's part in a box of a lattice, with the part's whole surface and exact moments (voxelize/voxelize_box.h). Throws
// InputError.
using CutBox = std::function<Body(const LatticeBox& box)>;

struct SimulateOptions {
  int threads = 0;            // 0: every core
  std::string failed_output;  // where the last good state goes when the run fails; "" for nowhere
  // Timed runs: where the books go (CSV), and the frames (.pvd); "" for nowhere. docs/reference/motion.md
  std::string history, series;
  bool compress = false;  // the frames
  // Timed runs: where checkpoints go ("" for nowhere), how many seconds of work lie between two, what the
  // output is called, for them; and the one that the run goes on from, whose scene and body simulate() is
  // given.
  std::string checkpoint;
  double checkpoint_every = 600;
  std::string output;
  std::shared_ptr<const Checkpoint> resume;
  // Timed runs: where frames go at `live_rate` a second in real time, every `live_state`-th with the
  // positions (0: none); "" for nowhere. docs/guide/live.md
  std::string live;
  double live_rate = 100;
  int live_state = 1;
  std::string isa;       // "portable", "avx2", "avx512"; "" for the best that the machine has
  bool stress = true;    // compute it, and give the body its columns
  bool estimate = true;  // equilibrium: error bars, by two runs on coarser lattices
  bool explain = false;  // say which effects run and why, and afterwards the share of time of each
  // Timed runs: called with each frame's body and time [s], on the thread of the run; the body is the run's own, and
  // another after the call.
  std::function<void(const Body& body, double time)> on_frame = {};
  // Model `quadratic`: what the largest stress is looked at closer with (docs/theory/local-stress.md); null: it is not.
  CutBox cut_box = {};
  // Equilibrium without contact: who solves in place of newton(), and who hears of load steps; null: nobody.
  std::shared_ptr<const LoadStepHooks> hooks = {};
};

}  // namespace flexel::simulate
