// What a hand says: lines of text (docs/reference/clay-protocol.md).
#pragma once
#include <string>
#include <vector>

#include "base/math/vec.h"
#include "flexel/clay/tool_pose.h"

namespace flexel::clay {

struct Act {
  enum class Kind {
    pose,     // the tool is there
    hand,     // the hand is there, and a spring draws the tool after it
    hold,     // a face is held, or let go
    grab,     // a tool takes a face, or what rests in a ball
    push,     // a tool that only pushes is put down: a ball or a plate
    stay,     // the hand leaves, the tool stays where it is
    release,  // the last tool lets go
    keep,     // the present shape becomes the rest shape
    carve,    // what rests in a ball goes
    draw,     // likewise along the way of a hand, which is one act until it leaves
    glue,     // parts are held together where they are near, in a ball
    cancel,   // the hand leaves, and what it led or carved along its way is undone
    undo,
    redo,
    material,
    paint,  // a part gets a material of its own
    take    // the tool, from another hand
  };
  Kind kind = Kind::pose;
  std::string name;        // of a face, a material or a part; push: "ball" or "plate"
  ToolPose pose = {};      // pose, hand
  Vec3 at = Vec3::Zero();  // m, rest: carve, glue, and grab, where `name` is ""; now: push, where it touches
  double radius = 0;       // m, likewise
  bool on = true;          // hold; draw: the ball is put down, else it goes straight on to `way`
  double within = 0;       // m, glue: how near
  std::string material = {};   // paint
  Vec3 from = Vec3::Zero();    // push: unit vector, from the part to where the tool comes from
  std::vector<Vec3> way = {};  // m, rest: draw
};

// What one message says.
struct ActMessage {
  std::string client;  // 16 hexadecimal digits, which the client has chosen
  std::vector<Act> acts;
};

constexpr std::size_t kLargestMessage = 16384;  // bytes
constexpr std::size_t kMostActs = 256;          // of one message

// 16 hexadecimal digits.
[[nodiscard]] bool is_client_name(const std::string& text);

// Throws InputError("line N", what is wrong): too large, no client, an unknown word, numbers that are not finite or beyond
// 1 km and 100 turns.
[[nodiscard]] ActMessage parse_acts(const std::string& text);

}  // namespace flexel::clay
