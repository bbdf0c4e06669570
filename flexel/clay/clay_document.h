// What hands have done to a part: a scene does the same.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "flexel/clay/act.h"
#include "formats/lattice/body.h"
#include "simulate/indent/indenter_shape.h"

namespace flexel::clay {

struct ClayTool {
  std::string where;           // TOML, of the scene: what it takes; of one that pushes its shape
  Vec3 centre = Vec3::Zero();  // m, rest, of a ball
  double radius = 0;           // m, likewise, or of one that pushes; 0: a face
  Vec3 middle = Vec3::Zero();  // m, rest; of one that pushes its own, clear of the part
  ToolPose pose;
  std::optional<simulate::IndenterShape> shape = {};  // of one that pushes
  Vec3 normal = Vec3::Zero();                         // rest, that its face looks along

  // Steps that go no further than the tool may in one.
  [[nodiscard]] int steps(const ToolPose& way) const;
};

// A ball that is led along a way and carves.
struct CarvedWay {
  std::vector<Vec3> path;  // m, rest: straight from each place to the next
  double radius = 0;       // m
};

struct NumberedBody {
  std::shared_ptr<const Body> body;
  std::shared_ptr<const std::vector<std::uint32_t>> element;  // (elements) numbers before anything was carved
};

// Everything that undo brings back.
struct ClayDocument {
  NumberedBody start;                          // as it came, or as its shape was kept last
  std::vector<std::string> changes;            // [[event]]s since then: what was carved, what was glued
  NumberedBody now;                            // after these
  std::shared_ptr<const std::string> surface;  // what the page draws of it; null: as it came
  std::uint64_t surface_number = 0;            // 0: as it came
  std::vector<std::string> kept;               // scenes, each ended by keeping its shape
  std::string material;                        // "": the scene's own
  std::map<std::string, std::string> painted;  // materials of parts that have their own
  std::vector<std::string> holds;              // names of faces
  std::vector<ClayTool> tools;                 // the last one is in the hand
  std::uint64_t grabs = 0;                     // number of the last grab
  std::shared_ptr<const std::vector<Vec3>> displacement;  // (elements of `now`) m, in equilibrium
};

// Scene of what was done since the shape was kept last: `base`, changes, holds, tools. `keep`: and the shape is kept.
[[nodiscard]] std::string scene_text(const ClayDocument& document, const std::string& base, bool keep);

// Throws InputError(name, ...): a base that is no scene, or that scene_text makes none of, holds, tools and all.
void refuse_unkept(const std::string& base, const std::string& name);

// Drops the oldest, but not the last one, while there are more than `most`, or their bodies have more elements.
void forget_oldest(std::vector<ClayDocument>& undo, std::size_t most, std::size_t most_elements);

// TOML of a name; of a ball.
[[nodiscard]] std::string where_of_name(const std::string& name);
[[nodiscard]] std::string where_of_ball(const Vec3& centre, double radius);
// TOML of the shape of an [[indenter]].
[[nodiscard]] std::string shape_text(const simulate::IndenterShape& shape,
                                     const simulate::IndenterPlace& place);
// The [[event]] of an act that carves or glues; of ways that are carved along.
[[nodiscard]] std::string change_text(const Act& act);
[[nodiscard]] std::string change_text(const std::vector<CarvedWay>& ways);

}  // namespace flexel::clay
