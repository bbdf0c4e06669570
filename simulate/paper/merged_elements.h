// Every 2 x 2 x 2 elements of model `paper` as one: Jansson and Vergeest, section 3.1.
//
// What acts on all of a group alike moves its centre of mass as it would one particle with their properties added: mass
// m = sum m_i, momentum m v = sum m_i v_i. Displacements are those that its elements, led on by their gradients, have in the
// middle of the whole group (means by mass): an affine motion stays that motion where groups lack elements (not
// across what is one element thick). On a lattice of twice the spacing k = E l is the k of the connections side by
// side (4) and one behind the other (2) inside a body, where nothing has to be said; a group that has n of its 8
// elements has the factor n / 8 on m and, through the mean of both ends, on k, besides the factors that edits gave
// the elements. So: density_change and stiffness_change are sums over 8, damping_change (the time b / k) the mean by
// k, those of t, mu, r, yield, stick and plastic strain means.
//
// A connection is there where any between the two groups is. Of those of its direction with both ends in the two groups, the
// ones between them count whole and those within a group half: of factors on k the harmonic mean, of the length at rest
// twice the mean change, of t the least, else the mean.
#pragma once
#include "formats/lattice/body.h"

namespace flexel::simulate {

// With the surface of `body`, its materials and what it knows of its state. Throws InputError: a part has cells; a column or
// a note that says nothing of one element in place of eight; pieces of a part within one group, which one element
// would join.
[[nodiscard]] Body merged_elements(const Body& body);

}  // namespace flexel::simulate
