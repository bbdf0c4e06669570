// Steady heat conduction on the body's cells: - div(k grad T) = 0 with faces of given temperature, heat flux or
// convection. Trilinear cells, integrated over the part's matter by the cells' moments where the body has them, else
// scaled by their fill; given temperatures by Nitsche's method (1971), in which the exact solution has no error. Parts do not
// pass heat to each other.
#pragma once
#include "base/program/progress.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Writes the elements' column "temperature" [K], and says its range and the heat through each face. Throws InputError: a
// material without conductivity, a model that does not conduct, bonded parts, a face under which no matter lies, matter
// whose temperature nothing gives, a temperature below absolute zero; DivergedError: not converged, or heats that do
// not sum to nothing.
void conduct(Body& body, const Scene& scene, Progress& progress);

}  // namespace flexel::simulate
