// The key `rotation` of what is led.
#pragma once
#include "simulate/conditions/motion.h"
#include "simulate/input/scene_table.h"

namespace flexel::simulate {

// Into `motion`, which stays as it is where the table has none. Throws InputError.
void read_rotation(TableReader& reader, Motion& motion);

}  // namespace flexel::simulate
