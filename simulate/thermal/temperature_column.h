// The temperatures that a scene takes from a body's columns, while the body is compared with coarser ones.
#pragma once
#include "formats/lattice/body.h"
#include "simulate/thermal/thermal_settings.h"

namespace flexel::simulate {

// Takes the columns out of a body, which coarsening needs; they are back when this goes. Keeps references.
class TakenTemperatures {
 public:
  TakenTemperatures(Body& body, const ThermalSettings& settings);
  ~TakenTemperatures();
  TakenTemperatures(const TakenTemperatures&) = delete;
  TakenTemperatures& operator=(const TakenTemperatures&) = delete;

  // Gives the coarse body the same columns, each element and cell that of the nearest of the finer body's.
  void give(Body& coarse) const;
  void take_back(Body& coarse) const;

 private:
  Body& body_;
  Columns elements_, cells_;
};

}  // namespace flexel::simulate
