// How materials harden as they flow: Voce's law by what a tensile test tells (docs/reference/fracture-plasticity.md).
#pragma once
#include <optional>

#include "simulate/input/materials.h"

namespace flexel::simulate {

// The yield stress rises with the equivalent plastic strain a by saturation (1 - exp(-rate a)).
struct VoceHardening {
  double saturation = 0;  // Pa
  double rate = 0;
};

// The one law of Voce's with which a bar that begins to flow at `yield` [Pa] bears its largest load at the engineering
// strain `uniform_elongation`, and bears `strength` [Pa] of its first section then (Considere's condition, elastic strains
// included). Nothing: there is none, for the strength is too near to the yield stress or below it.
[[nodiscard]] std::optional<VoceHardening> voce_hardening(double yield, double strength,
                                                          double uniform_elongation, double young);
// With the material's own yield stress. Nothing: it has no uniform elongation, or there is no such law.
[[nodiscard]] std::optional<VoceHardening> voce_hardening(const Material& material);

// The true stress [Pa] at the largest load of a bar of the material.
[[nodiscard]] double strength_of_flowing(const Material& material);

}  // namespace flexel::simulate
