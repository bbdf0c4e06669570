// The work is done by simulate/rest_shape.h.
#include "simulate/events/renormalise.h"

#include <fmt/format.h>

#include "simulate/rest_shape.h"

namespace flexel {

Renormalise Renormalise::parse(TableReader& reader) {
  Renormalise made;
  made.region_ = parse_region(reader);
  return made;
}

std::string Renormalise::happen(Stage& stage) const {
  const Chosen chosen = choose(region_, stage.body, stage.state);
  renormalise(stage.body, stage.setting, stage.state.displacement, chosen.cells, chosen.elements);
  return fmt::format("{} took its present shape as its rest shape", describe(region_));
}

}  // namespace flexel
