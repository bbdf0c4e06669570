// Several bodies as one.
#pragma once
#include "formats/lattice/body.h"

namespace flexel {

// Appends the parts of `other`, with their surface, to `body`. Part names stay unique ("-2" ... is appended).
// Throws InputError naming the column when the two carry different attributes. Moments are kept where both have all.
void append(Body& body, Body other);

}  // namespace flexel
