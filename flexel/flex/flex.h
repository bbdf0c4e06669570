// A part bent or twisted to a shape: supports and rotations of its two ends, and what came of it
// (docs/guide/flex.md).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "base/program/arguments.h"
#include "simulate/scene/scene.h"

namespace flexel::commands {

struct FlexArguments {
  std::string bend, twist, along, about;
};

// What is asked for. The ends are the sides where the part is farthest along an axis of the world ("xmin"
// and "xmax"); the first is held.
struct Flex {
  bool bends = true;  // the way between the ends becomes an arc; false: the second end turns about that way
  double angle = 0;   // rad, of the second end; right-handed about `about`
  std::optional<Eigen::Index> along;  // nothing: the longest axis of the part
  std::optional<Vec3> about;  // of a bend: unit, along an axis of the world. Nothing: chosen by the part
};

void declare_flex(CommandLine& app, FlexArguments& arguments);

// Throws InputError: not one of --bend and --twist, no angle or one of 0 or too many turns, axes that do not
// fit.
[[nodiscard]] Flex plan_flex(const FlexArguments& arguments);

// The axes that the part's size decides: a bend goes about the wider of the two axes across, and leads
// the end towards the positive side of the thinner one.
struct FlexFrame {
  Eigen::Index along = 0;     // axis of the world
  Vec3 axis = Vec3::UnitY();  // unit, that the second end turns about
  std::string held, led;      // "xmin", "xmax"
};
[[nodiscard]] FlexFrame flex_frame(const Flex& flex, const Surface& surface);

// Adds the support and the rotation to the scene. Throws InputError: a side that has no face of its own.
void add_flex(simulate::Scene& scene, const Flex& flex, const Body& body);

// rad, how far the second end has turned from the first one, like `Flex::angle`, by the rigid motions nearest
// to those of their vertices; whole turns are those of `flex`. `displacement`: (vertices of the body's
// surface, or more) m.
[[nodiscard]] double measure_flex(const Flex& flex, const Body& body, const std::vector<Vec3>& displacement);

struct FlexAnswer {
  double angle = 0;                     // rad, measured
  std::optional<double> volume_change;  // share, of the matter; nothing where it has no cells
};
// What to say where the ends miss the angle that is asked for by 5 % of it and more; else empty.
[[nodiscard]] std::string flex_warning(const Flex& flex, const FlexAnswer& answer);
// Whether they miss it by half of it and more: then the command has not done what it was asked for.
[[nodiscard]] bool flex_failed(const Flex& flex, const FlexAnswer& answer);
[[nodiscard]] std::string flex_line(const Flex& flex, const FlexAnswer& answer);

}  // namespace flexel::commands
