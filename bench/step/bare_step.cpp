// bare_step BODY STEPS: the hot loop alone, linked without any effect. interop.instructions counts its
// instructions and those of flexel-simulate, which has every effect: a step has to cost the same in both.
#include <fmt/format.h>

#include <cstdlib>

#include "base/parallel.h"
#include "formats/lattice/body_file.h"
#include "simulate/stepping/stepper.h"

int main(int argc, char** argv) {
  using namespace flexel;
  if (argc != 3) {
    fmt::print(stderr, "usage: bare_step BODY STEPS\n");
    return 2;
  }
  const ThreadLimit limit(1);
  const Body body = read_body(argv[1]);
  const simulate::Problem problem{
      body,
      std::vector<simulate::Material>(body.parts.size(), {"gum", 1.2e6, 0.25, 930, "test"}),
      std::vector<std::uint8_t>(body.cell_count(), 0),
      std::vector<simulate::Model>(body.parts.size(), simulate::Model::cells),
      {},
      {}};
  simulate::Stepper stepper(problem, {std::vector<double>(body.parts.size(), 0)}, false);
  simulate::State state;
  state.displacement.assign(body.element_count(), Vec3::Zero());
  state.velocity.assign(body.element_count(), Vec3::Zero());
  for (int n = std::atoi(argv[2]); n > 0; --n) (void)stepper.advance(state, {}, {1e-5, 1e-5, false});
}
