// Free strain: what matter would be strained by if nothing held it. Stress is that of the rest of the strain.
//
//     e(x) = alpha (T(x) - T0) I            [thermal]: uniform, linear, or a column of the body
//          + f(z) (along n n^T + across (I - n n^T))   [shrinkage]: z the middle of the layer that x lies in, along n
#pragma once
#include "formats/lattice/body.h"
#include "simulate/thermal/thermal_settings.h"

namespace flexel::simulate {

class FreeStrain {
 public:
  FreeStrain() = default;
  FreeStrain(FreeStrain&&) = default;
  FreeStrain& operator=(FreeStrain&&) = default;
  FreeStrain(const FreeStrain&) = delete;
  FreeStrain& operator=(const FreeStrain&) = delete;
  // Keeps a reference to the body. `materials`: (parts). Throws InputError: a part that is not there, a material without
  // expansion, a column that is missing or not finite, a strain that is no small one.
  FreeStrain(const Body& body, const ThermalSettings& settings, const std::vector<Material>& materials);

  [[nodiscard]] bool any() const { return !parts_.empty(); }
  // At cell coordinates of a cell (of the body) of that part; world frame at rest.
  [[nodiscard]] Mat3 at(std::uint32_t part, std::uint32_t cell, const Vec3& at) const;

 private:
  struct PartStrain {
    const TemperatureChange* change = nullptr;
    double expansion = 0;             // 1/K
    const Column* element = nullptr;  // K
    const Column* cell = nullptr;     // K
    double reference = 0;             // K
    const Shrinkage* shrinkage = nullptr;
    double bottom = 0, layers = 1;  // m, along the axis of the layers
  };
  void add_change(const TemperatureChange& change, const ThermalSettings& settings,
                  const std::vector<Material>& materials, std::size_t part);
  void find_column(const TemperatureChange& change, bool conducts, PartStrain& part) const;
  void check(std::uint32_t part) const;
  [[nodiscard]] double warmer_by(const PartStrain& part, std::uint32_t cell, const Vec3& at,
                                 const Vec3& place) const;

  const Body* body_ = nullptr;
  std::vector<TemperatureChange> changes_;
  std::vector<Shrinkage> shrinkages_;
  std::vector<PartStrain> parts_;  // (parts)
};

// (cells x 18) of model `cells`, where the rest shape of a cell is that which free strain gives it: G - I with
// G = (I + e)^-1 (xx, yy, zz, xy, yz, zx), e its mean, and the hourglass displacements [m] of a linear e; both in the lattice's
// axes. A body has it only while it is solved.
constexpr const char* kFreeStrainColumn = "free_strain";
[[nodiscard]] Column free_strain_column(const Body& body, const FreeStrain& strain);

}  // namespace flexel::simulate
