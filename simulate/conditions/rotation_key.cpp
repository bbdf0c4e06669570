// { axis, through, angle }, and of a [[move]] where its arc begins.
#include "simulate/conditions/rotation_key.h"

namespace flexel::simulate {

void read_rotation(TableReader& reader, Motion& motion) {
  const SceneValue* value = reader.find("rotation");
  if (!value) return;
  TableReader rotation(*value, reader.file(), "rotation of " + reader.title());
  (void)rotation.require("axis", "[0, 0, 1]");
  motion.axis = *rotation.direction("axis");
  motion.through = rotation.to_vector(rotation.require("through", "[\"0 mm\", \"0 mm\", \"0 mm\"]"),
                                      Dimension::length, "through");
  motion.angle = rotation.to_quantity(rotation.require("angle", "\"30 deg\""), Dimension::angle, "angle");
  motion.arc_from = rotation.vector("arc_from", Dimension::length);
  rotation.finish();
  if (motion.arc_from) {
    constexpr double kAcross = 1e-9;  // of the way, that is more than rounding
    const Vec3 way = motion.through - *motion.arc_from;
    if (motion.angle == 0) rotation.fail("\"arc_from\" needs an \"angle\" other than 0");
    if (!(motion.axis.cross(way).norm() > kAcross * way.norm()))
      rotation.fail(
          "the way from \"arc_from\" to \"through\" makes no arc: it needs a length, and another direction "
          "than \"axis\"");
  }
}

}  // namespace flexel::simulate
