// Initial overlap of parts: contact would throw them apart, or not see them where the penetration exceeds its
// reach. It is refused, or released as far as that reaches (simulate/contact/pairs/overlap_release.h).
//
// A point of one part's surface penetrates another part where, moved inwards by a little, it lies in a whole
// cell of that part; cut cells are left alone. Its depth is the distance, as contact measures it, from the
// nearest surface of the other part that faces it. No near surface faces a point that stands across, as on the
// sides of a block whose end penetrates: it is released with the surface of the other part beside it, and its
// depth is the larger of that surface's and its own behind that surface. The overlap of two parts is the
// deepest of their points.
#pragma once
#include "simulate/contact/pairs/settings.h"
#include "simulate/contact/points/contact_surface.h"

namespace flexel::simulate {

// Looks at pairs of parts of which one is not among the first `known`, in `state`. Throws InputError: parts
// that overlap, or a part inside a plane, deeper than contact bears or, with a release time, can release.
void refuse_initial_overlap(const ContactSettings& settings, const ContactSurface& surface, std::size_t known,
                            const State& state);

}  // namespace flexel::simulate
