// A material of each elastic law but neo-Hooke's, as soft as the gums of the other tests.
#pragma once
#include <Eigen/Geometry>

#include "simulate/input/materials.h"

namespace flexel::simulate::testing {

inline Material mooney_rivlin_material() {
  Material material;
  material.name = "elastomer";
  material.law = LawName::mooney_rivlin;
  material.c10 = 0.15e6;
  material.c01 = 0.05e6;
  material.bulk = 1.6e6;
  material.density = 1000;
  set_isotropic_constants(material);
  return material;
}

// Its chains end at the stretch of 2.
inline Material arruda_boyce_material() {
  Material material;
  material.name = "chains";
  material.law = LawName::arruda_boyce;
  material.chain_mu = 0.3e6;
  material.lambda_m = 2;
  material.bulk = 1.6e6;
  material.density = 1000;
  set_isotropic_constants(material);
  return material;
}

// Of a soft wood's ratios, its axes turned in space.
inline Material orthotropic_material() {
  Material material;
  material.name = "grain";
  material.law = LawName::orthotropic;
  material.youngs = Vec3(2e6, 0.4e6, 0.2e6);
  material.poissons = Vec3(0.37, 0.42, 0.47);
  material.shears = Vec3(0.3e6, 0.28e6, 0.1e6);
  material.density = 500;
  material.axes = Eigen::AngleAxisd(0.6, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  set_isotropic_constants(material);
  return material;
}

}  // namespace flexel::simulate::testing
