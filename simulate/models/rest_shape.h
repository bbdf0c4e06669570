// Rest shapes: a cell or connection that is free of stress at another shape than the lattice's, because it
// flowed (docs/reference/fracture-plasticity.md) or because its shape was renormalised (docs/reference/events.md; Jansson and
// Vergeest, section 4.1). The body remembers in columns, all 0 where the rest shape is the lattice's:
//     plastic_flow       (cells x 6) Cp^-1 - I, Cp = Fp^T Fp: xx, yy, zz, xy, yz, zx in the lattice's axes
//     rest_volume        (cells) Jp - 1, Jp = det Fp
//     plastic_hourglass  (cells x 12) m, the hourglass displacements of the rest shape, drawn back by F
//     spring_flow        (cells x 28) m, change of the rest length of each spring of model `springs`
//     broken_springs     (cells) bits
//     connection_rest    (elements x 13) m, the same of the connections of model `paper`, at the element that
//                        has the bit in Body::connections
//     free_strain        (cells x 18) of a run with free strain, while it goes on (simulate/thermal/free_strain.h)
//     settled            (elements x 3) m, displacement of the shape that was last renormalised: what a fix
//     or
//                        move of a later run starts from
#pragma once
#include <optional>
#include <span>

#include "simulate/models/cell_model.h"
#include "simulate/models/spring_model.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

inline constexpr int kEntry[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

// What the cells of a body remember. Refers to the body's columns while it lives.
class RestShapes {
 public:
  explicit RestShapes(const Body& body);

  // Whether any cell or connection can have a rest shape of its own.
  [[nodiscard]] bool any() const { return any_; }
  // `kind` for that cell; nothing where its rest shape is the lattice's. `share`: of the free strain.
  [[nodiscard]] std::optional<CellKind> of(const CellKind& kind, const Part& part, std::uint32_t cell,
                                           double share = 1) const;
  [[nodiscard]] std::optional<SpringKind> of(const SpringKind& kind, std::uint32_t cell) const;
  // Change of the rest length of a connection of model `paper` [m]: of bit `bit` of element `element`.
  [[nodiscard]] double of_connection(std::uint32_t element, std::size_t bit) const;

 private:
  const Column *flow_ = nullptr, *volume_ = nullptr, *hourglass_ = nullptr, *springs_ = nullptr,
               *broken_ = nullptr, *connections_ = nullptr, *free_ = nullptr;
  bool any_ = false;
};

// Throws InputError: a column that simulations take has another shape than it needs, a factor in it is not above 0, or it
// has values where nothing takes them, such as a factor of cells at their corners.
void refuse_damaged_columns(const Body& body);

// (elements) m, column "settled"; empty: none.
[[nodiscard]] std::vector<Vec3> settled_displacement(const Body& body);

// (cells) what a cell's stiffness is beside that of its material: the fill, times the factor of edits
// (column stiffness_change, the factor less 1).
[[nodiscard]] std::vector<double> stiffness_shares(const Body& body);
// (cells) likewise of its mass (column density_change).
[[nodiscard]] std::vector<double> mass_shares(const Body& body);
// (elements) the factors of edits at centre placement; empty: none.
[[nodiscard]] std::vector<double> stiffness_factors(const Body& body);
[[nodiscard]] std::vector<double> mass_factors(const Body& body);
// The factors of any such column, of elements and of cells; empty: none. Throws InputError: one is not above 0, or
// the column has another shape.
[[nodiscard]] std::vector<double> element_factors(const Body& body, const char* column);
[[nodiscard]] std::vector<double> cell_factors(const Body& body, const char* column);
// (elements) a column of one number each; empty: none. Throws InputError: it has more.
[[nodiscard]] std::vector<double> element_values(const Body& body, const char* column);
// (elements x 13) a column of the connections of model `paper`, of the body's while it lives; empty: none. Throws
// likewise.
[[nodiscard]] std::span<const double> connection_values(const Body& body, const char* column);

}  // namespace flexel::simulate
