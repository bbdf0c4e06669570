// A load that no material like the part's bears.
#pragma once
#include "base/error.h"

namespace flexel::simulate {

// At its first stiffness a load would move the part by many times its size: most likely its unit or that of the part is
// wrong. Whoever searches for a size or a model ends with this and tries no other.
class OverloadError : public DivergedError {
 public:
  using DivergedError::DivergedError;
};

}  // namespace flexel::simulate
