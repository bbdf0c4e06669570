// A run of which every rank does its own part: reads its pieces, places on them what acts, and writes their result.
#pragma once
#include <functional>
#include <string>

#include "distributed/shared_body.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/result/options.h"
#include "simulate/result/result.h"
#include "simulate/scene/scene.h"

namespace flexel::distributed {

struct SharedRequest {
  PieceFiles files;
  std::string output,
      failed;           // lists; `failed`: of the last state in equilibrium where there is none further
  std::string summary;  // file that TellResult writes, or ""
  bool stress = true, estimate = true, compress = false;
  int threads = 1;  // of each rank
};

// What rank 0 tells: `body` has parts, a box and the largest stress of the whole, but one cell.
using TellResult = std::function<void(const simulate::SimulateResult& result, const Body& body)>;

// What is done with whole bodies amid such a run: those on the coarser lattices that error bars come from, which rank 0 has.
struct WholeBodies {
  std::function<simulate::LoadStepSolver(simulate::Mechanics&)> make_solver;  // on rank 0
  LetFirst let_first;
};

// On every rank. `options`: rank 0's; `tell`: on rank 0, before files appear. Returns how many cells this rank had. Throws
// WholeBodyNeeded on all ranks, before anything was solved; InputError and others.
std::size_t run_on_pieces(const SharedRequest& request, const simulate::Scene& scene,
                          const simulate::SimulateOptions& options, const WholeBodies& whole,
                          Progress& progress, const TellResult& tell);

}  // namespace flexel::distributed
