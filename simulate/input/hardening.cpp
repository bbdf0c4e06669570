// With t the Kirchhoff stress, e the logarithmic strain and a = e - t / E, the load over the first section is t exp(-e), and
// largest where dt/de = t: dt/da = t / (1 - t / E). Two equations for saturation and rate, of which the first gives the
// saturation and the second one is solved for the rate by bisection.
#include "simulate/input/hardening.h"

#include <cmath>

namespace flexel::simulate {

std::optional<VoceHardening> voce_hardening(double yield, double strength, double uniform_elongation,
                                            double young) {
  const double stress = strength * (1 + uniform_elongation);
  const double strain = std::log1p(uniform_elongation) - stress / young, rise = stress - yield;
  const double slope = stress / (1 - stress / young);
  // The slope dt/de is t at the largest load, and no material's is above E.
  if (!(stress < young) || !(strain > 0) || !(rise > slope * strain)) return std::nullopt;
  // rise = saturation (1 - exp(-x)), slope = saturation rate exp(-x), x = rate strain
  const auto is_too_steep = [&](double x) { return rise * x > slope * strain * std::expm1(x); };
  double low = 0, high = 1;
  while (is_too_steep(high)) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (is_too_steep(middle) ? low : high) = middle;
  }
  return VoceHardening{rise / -std::expm1(-high), high / strain};
}

std::optional<VoceHardening> voce_hardening(const Material& material) {
  if (!(material.uniform_elongation > 0)) return std::nullopt;
  return voce_hardening(material.yield, material.strength, material.uniform_elongation, material.young);
}

double strength_of_flowing(const Material& material) {
  return material.strength * (1 + material.uniform_elongation);
}

}  // namespace flexel::simulate
