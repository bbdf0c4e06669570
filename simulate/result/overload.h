// A load that no material like the part's bears.
#pragma once
#include "base/error.h"

namespace flexel::simulate {

// At its first stiffness a load would move the part by many times its size: its unit or that of the part is wrong. No
// other lattice or model has a better answer.
class OverloadError : public DivergedError {
 public:
  using DivergedError::DivergedError;
};

}  // namespace flexel::simulate
