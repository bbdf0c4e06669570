// Rank 0 leads: it runs flexel::simulate::simulate() as flexel-simulate does, and hands each load step to all ranks. The others
// follow until it ends.
#pragma once
#include <memory>

#include "distributed/shared_run.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/scene/scene.h"

namespace flexel::distributed {

struct RankUse {
  double cells = 0;   // of the largest piece that it had
  double memory = 0;  // bytes, at most
};

// On rank 0. While one lives, the others wait in follow().
class Leader {
 public:
  Leader() = default;
  Leader(const Leader&) = delete;
  Leader& operator=(const Leader&) = delete;

  // Cuts the body of `mechanics` into pieces, one for each rank, and solves on them. The cells are moved there, until `mechanics` ends or
  // moves them back. `mechanics` and this must outlive what is returned.
  // Empty where there are fewer cells than ranks, as on a coarse lattice: rank 0 solves that alone. Throws InputError for effects that
  // ranks do not share.
  [[nodiscard]] simulate::LoadStepSolver make_solver(simulate::Mechanics& mechanics);
  // To all: how many threads each uses; the scene, which is kept a reference to. Before make_solver().
  void give_threads(int threads);
  void give(const simulate::Scene& scene);
  // run_on_pieces() on all ranks. Returned is why it takes the whole body, "" where it was done without.
  [[nodiscard]] std::string run(const SharedRequest& request, const simulate::SimulateOptions& options,
                                Progress& progress, const TellResult& tell);
  // What each rank has taken so far.
  [[nodiscard]] std::vector<RankUse> uses() const;
  // The others end with this exit code, unless they are at work: then Session::abort() is left.
  void end(int code);

 private:
  const simulate::Scene* scene_ = nullptr;
};

// On every other rank: until the leader ends. Returns the exit code.
[[nodiscard]] int follow();

// Whether all ranks are at work together, so that none may leave alone: an exception then ends the others too.
[[nodiscard]] bool together();

}  // namespace flexel::distributed
