// Second derivatives of the energy of contact (simulate/contact/pairs/pair_law.h), for Newton's method.
//
// With d = x_j - x_i, b = a_i n_i - a_j n_j, L = |b|, n = b / L, s = d . n, t = d - s n, T = t . t / 2 a pair
// has U(s, T, c),
//     U_s = -N,  U_T = -spread,  U_ss = k,  U_sT = narrowing N / weight,
//     U_TT = narrowing^2 / (2 weight^2) U,
// and s and T change by
//     s' = n . d' + t . b' / L,   s'' = 2 d' . P b' / L - (2 (n . b') (t . b') + s |P b'|^2) / L^2,
//     T' = t . d' - s t . b' / L, T'' = |d'|^2 - s'^2 - s s'',   P = I - n n^T.
// c = -n_i . n_j, by which a weight grows as two normals come to face each other, has
//     c' = -n_j . n_i' - n_i . n_j',  c'' = -2 n_i' . n_j'
// beside what n'' adds; left out is the second derivative of the weight by c, which goes with the energy alone.
//
// A normal n ~ F^-T N of a cell with h_a = F^-T g_a (g_a: gradients of the weights) and m_a = (I - n n^T) h_a
// follows its elements by
//     n' = -sum m_a (n . u_a),
// and for q = dU/dn, q_p = q - (q . n) n,
//     q . n'' = 2 sum (q_p . h_a) (u_a . h_b) (u_b . n)
//               - 2 (sum (n . h_a) (u_a . n)) (sum (q_p . h_a) (u_a . n)) - |sum m_a (u_a . n)|^2 (q . n).
// In soft matter under pressure these terms are as large as its own stiffness: without them Newton's method
// gained a factor of 1.1 to 3 an iteration at the edge of a tool.
//
// What pairs do to one point is summed up before it goes to the elements that carry it.
#pragma once
#include "simulate/contact/pairs/pair_states.h"
#include "simulate/linear/block_matrix.h"

namespace flexel::simulate {

// `positive`: k s' s' alone, which is positive semi-definite.
enum class ContactTangent { whole, positive };

// Adds it to `matrix` [N/m], for the elements of parts that deform, of the pairs as evaluated.
void add_contact_stiffness(const ContactSurface& surface, const PairList& list, const PairStates& states,
                           ContactTangent kind, BlockMatrix& matrix);

// Adds block 8 a + b between the elements a and b that carry a point.
void add_blocks(const InterpolationWeights& at, const std::array<Mat3, 64>& blocks, BlockMatrix& matrix);

}  // namespace flexel::simulate
