// The deformation as a map of all space, phi(x), twice continuously differentiable: what fitting curves and surfaces
// needs, whose parameters run on where the part has ended.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "formats/lattice/body.h"
#include "mapping/methods/space_map.h"
#include "mapping/types/options.h"

namespace flexel::mapping {

class SpaceField {
 public:
  // The state body.position, displacements times `scale`. `method`: kBlended (mapping/methods/space_map.h) or
  // kShapeFunctions: there the polynomials of the cells are blended across their faces over a quarter of a cell on
  // either side, for they are once continuous only. `body` must outlive this. Throws InputError: another method, a part
  // without elements, kShapeFunctions of a body that another model deformed.
  SpaceField(const Body& body, MapMethod method, double scale);
  ~SpaceField();
  SpaceField(const SpaceField&) = delete;
  SpaceField& operator=(const SpaceField&) = delete;

  // One for each thread; it must not outlive the field.
  class Probe {
   public:
    explicit Probe(const SpaceField& field);
    // phi(x) [m]; `x` (m, world frame, at rest), `part` and `polygon` as those of SpaceMap::Probe::at(). Beyond the
    // reach of the elements it goes over into a blend of ever larger groups of them.
    [[nodiscard]] Vec3 at(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon = {});

   private:
    // A displacement [m], and how far it counts: 0 where nothing is near.
    struct Near {
      Vec3 displacement = Vec3::Zero();
      double weight = 0;
    };
    [[nodiscard]] Near blended(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon);
    [[nodiscard]] Near of_cells(const Vec3& x, std::uint32_t part, std::optional<std::size_t> polygon);
    [[nodiscard]] Vec3 far(const Vec3& x, std::uint32_t part) const;
    const SpaceField& field_;
    SpaceMap::Probe probe_;
    std::vector<std::uint32_t> cells_;  // around the last one
    std::optional<std::uint32_t> home_;
  };

 private:
  struct Cells;   // the polynomials of the cells
  struct Groups;  // elements in cubes of 2, 4, 8 ... spacings
  const Body& body_;
  double scale_;
  SpaceMap map_;
  std::unique_ptr<Cells> polynomials_;
  std::vector<Groups> groups_;  // (parts)
};

}  // namespace flexel::mapping
