// The work is done by simulate/models/rest_shape.h.
#include "simulate/events/renormalise.h"

#include <fmt/format.h>

#include "simulate/models/set_rest_shape.h"

namespace flexel::simulate {

Renormalise Renormalise::parse(TableReader& reader) {
  Renormalise made;
  made.region_ = parse_region(reader);
  return made;
}

std::string Renormalise::apply(EventContext& context) const {
  const Chosen chosen = choose(region_, context.body, context.state);
  renormalise(context.body, context.problem, context.state.displacement, chosen.cells, chosen.elements);
  return fmt::format("{} took its present shape as its rest shape", describe(region_));
}

}  // namespace flexel::simulate
