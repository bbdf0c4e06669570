// `shape-functions`: a vertex goes where the displacement field of model `quadratic` takes it
// (formats/lattice/quadratic_field.h).
#pragma once
#include "mapping/methods/method.h"

namespace flexel::mapping {

struct VertexCells final : MethodBinding {
  std::vector<std::uint32_t> cell;  // (vertices) that carries each
  // Throws InputError: the body has no such field.
  [[nodiscard]] std::vector<Vec3> apply(const Binding& binding, const Body& body,
                                        const std::vector<Vec3>& position) const override;
};

}  // namespace flexel::mapping
