// Events of a scene without a time (docs/reference/events.md#at-equilibrium).
#pragma once
#include "base/program/progress.h"
#include "simulate/scene/scene.h"

namespace flexel::simulate {

// They change the body as it comes, one after the other, before anything acts on it. Throws InputError: of an event;
// DivergedError: what is to be renormalised is turned inside out.
void happen_before_equilibrium(Body& body, Scene scene, Progress& progress);

}  // namespace flexel::simulate
