// What a timed run says of matter that turned inside out or ran away.
#pragma once
#include <string>

#include "simulate/scene/scene.h"
#include "simulate/state/state.h"

namespace flexel::simulate {

// "`what` near (...) turned inside out", `at` [m] at rest, and what to do about it.
[[nodiscard]] std::string folds_at(const char* what, const Vec3& at, TimeMethod method);

// "the motion ran away near (...)", `at` [m] at rest, and what to do about it.
[[nodiscard]] std::string runs_away_at(const Vec3& at, TimeMethod method);

// That of the cell with the least volume.
[[nodiscard]] std::string where_it_folds(const Problem& problem, const State& state, TimeMethod method);

// "(...)": where the element rests that moves fastest.
[[nodiscard]] std::string fastest_near(const Body& body, const State& state);

// ", squeezed most near (...), to J = 0.02", of the same cell, or of an element where there are none.
[[nodiscard]] std::string squeezed_most(const Problem& problem, const State& state);

// Damping that would need more than so many stages a step.
[[nodiscard]] std::string damping_too_long(int stages);

}  // namespace flexel::simulate
