// What a scene asks of a body that would do nothing, or something else than it says.
#pragma once
#include "base/program/progress.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// Before a run. Throws InputError: a load or move has a course where there is no time; a load acts only on
// what a [[fix]] or [[move]] holds along its direction, a move of a surface whose elements a [[fix]] holds.
// Warns: a tenth of a load's area or more does so, with the share; a pressure on a side acts along normals
// that are off the side's axis by more than 10 degrees on average, with the angle; a material of the scene is
// used by no part.
void check_actions(const Scene& scene, const Body& body, Progress& progress);

// Warns of each of the scene's own materials that no part is made of.
void warn_of_unused_materials(const Scene& scene, const Body& body, Progress& progress);

}  // namespace flexel::simulate
