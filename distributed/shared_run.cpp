// Files appear once every rank has written its own.
#include "distributed/shared_run.h"

#include "base/files/output_file.h"
#include "distributed/refusals.h"
#include "distributed/result_in_pieces.h"
#include "distributed/shared_solver.h"
#include "simulate/equilibrium/equilibrium.h"
#include "simulate/estimate/coarsen.h"
#include "simulate/simulate.h"

namespace flexel::distributed {
namespace {

using simulate::LoadStepHooks;
using simulate::Mechanics;
using simulate::Scene;
using simulate::SimulateOptions;
using simulate::SimulateResult;

// The hash of all ranks' parts of a result.
std::uint64_t run_of(const SharedRequest& request, const Body& body) {
  const std::uint64_t own = hash_of(body);
  std::vector<std::uint64_t> all(static_cast<std::size_t>(ranks()));
  ok(MPI_Allgather(&own, 1, MPI_UINT64_T, all.data(), 1, MPI_UINT64_T, PETSC_COMM_WORLD));
  all.insert(all.begin(), request.files.run);
  return run_number(all);
}

std::vector<std::string> own_files(const SharedBody& body, const std::string& list) {
  std::vector<std::string> files;
  for (std::uint32_t p = body.first_piece(); p < body.end_piece(); ++p) files.push_back(piece_path(list, p));
  return files;
}

// Of all ranks together.
void write_result(const SharedRequest& request, SharedBody& shared, const std::string& list) {
  const std::uint64_t run = run_of(request, shared.body());
  all_or_none([&] {
    const PieceRange own{shared.first_piece(), shared.end_piece(), run};
    write_pieces(shared.body(), request.files, own, list, request.compress);
  });
}

// What is said of a result of which this rank has the figures, but not the body.
Body body_to_tell_of(const SharedBody& shared, const Body& own, const SimulateResult& result) {
  Body told;
  told.parts = own.parts;
  told.notes = own.notes;
  Part& part = told.parts.front();
  part.element_begin = part.cell_begin = 0;
  part.element_end = 3;
  part.cell_end = 1;
  const Vec3 at = result.stress ? result.stress->at : shared.box().min;
  told.rest = told.position = {shared.box().min, shared.box().max, at};
  told.cell_elements.resize(1);
  told.fill = {1};
  told.broken = {0};
  if (result.stress) told.element_columns["von_mises"] = {1, {0, 0, result.stress->value}};
  return told;
}

}  // namespace

std::size_t run_on_pieces(const SharedRequest& request, const Scene& scene, const SimulateOptions& options,
                          const WholeBodies& whole, Progress& progress, const TellResult& tell) {
  SharedBody shared(request.files, whole.let_first);
  const WithOtherPieces others(shared);
  Body& body = shared.body();
  refuse_unsupported(scene, body);
  if (request.stress) (void)simulate::share_of_thin_walls(body, 2);  // else too late where it cannot tell
  SimulateOptions own = options;
  LoadStepHooks hooks;
  hooks.make_solver = [&](Mechanics& mechanics) {
    return other_pieces() ? make_shared_solver(mechanics, shared, scene) : whole.make_solver(mechanics);
  };
  hooks.save = [&](Body&, const std::string& list) { write_result(request, shared, list); };
  own.hooks = std::make_shared<const LoadStepHooks>(std::move(hooks));
  own.stress = request.stress;
  own.threads = request.threads;
  own.estimate = request.estimate;
  own.failed_output = request.failed;
  const SimulateResult result = simulate::simulate(body, scene, own, progress);
  own.hooks.reset();
  progress.stage("write");
  std::vector<std::string> names = own_files(shared, request.output);
  if (rank() == 0) {
    names.push_back(request.output);
    names.push_back(request.summary);
    names.push_back(shared_surface_path(request.output));
  }
  OutputsTogether files(names);
  write_result(request, shared, request.output);
  if (rank() == 0) tell(result, body_to_tell_of(shared, body, result));
  all_or_none([&] { files.appear(); });
  return static_cast<std::size_t>(shared.own_cells());
}

}  // namespace flexel::distributed
