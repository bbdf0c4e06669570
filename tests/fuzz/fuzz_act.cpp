// Mutated messages of hands to flexel clay: refused, or what they say is finite and within bounds.
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "flexel/clay/act.h"
#include "flexel/clay/clay_document.h"
#include "simulate/scene/scene.h"
#include "tests/fuzz/driver.h"

namespace {

using namespace flexel;

constexpr const char* kMessage =
    "client 0123456789abcdef\nhold bracket/1\nfree bracket/1\ngrab face bracket/2\ngrab at 0.08 0.02 0.003 "
    "0.004\n"
    "hand 0 0 -0.005\nhand 0 0 -0.005 0 0.1 0\n0 1e-3 0 0\n0 1e-3 2e-3 0 0 0.1 "
    "0\nstay\nrelease\nkeep\nundo\nredo\n"
    "material PLA\ncarve at 0.08 0.02 0.003 0.004\ncarve from 0.08 0.02 0.003 0.004\ncarve to 0.07 0.02 "
    "0.003\npush ball 0.08 0.02 0.006 0 0 1 0.004\npush plate 0.08 "
    "0.02 0.006 0 0 1 0.004\npaint steel bracket\nglue at 0.08 0.02 0.003 0.004 "
    "0.0005\ncancel\ntake\n";

// Names and numbers of a message are those of a scene that can be read.
void check_scene(const clay::ActMessage& message) {
  clay::ClayDocument document;
  document.material = "PLA";
  std::vector<clay::CarvedWay> ways;
  for (const clay::Act& act : message.acts) {
    if (!act.pose.displacement.allFinite() || !act.pose.turn.allFinite() || !act.at.allFinite()) std::abort();
    if (act.kind == clay::Act::Kind::carve || act.kind == clay::Act::Kind::glue)
      document.changes.push_back(clay::change_text(act));
    if (act.kind == clay::Act::Kind::draw) {
      if (act.way.size() != 1 || !act.way[0].allFinite()) std::abort();
      if (act.on) ways.push_back({{}, act.radius});
      if (!ways.empty()) ways.back().path.push_back(act.way[0]);
    }
    if (act.kind == clay::Act::Kind::paint) document.painted[act.name] = act.material;
    if (act.kind == clay::Act::Kind::hold) document.holds.push_back(act.name);
    if (act.kind == clay::Act::Kind::push) {
      if (std::abs(act.from.norm() - 1) > 1e-9) std::abort();
      const simulate::IndenterShape shape{act.name == "plate", act.radius, act.radius};
      clay::ClayTool& tool = document.tools.emplace_back();
      tool.shape = shape;
      tool.where = clay::shape_text(shape, {act.at, -act.from});
    }
    if (act.kind == clay::Act::Kind::grab)
      document.tools.push_back(
          {act.name.empty() ? clay::where_of_ball(act.at, act.radius) : clay::where_of_name(act.name), act.at,
           act.radius, act.at, act.pose});
  }
  if (!ways.empty()) document.changes.push_back(clay::change_text(ways));
  (void)simulate::parse_scene(clay::scene_text(document, "", true), "clay");
}

void read_message(const std::string& path) {
  const Bytes bytes = read_all(path);
  const clay::ActMessage message =
      clay::parse_acts(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  check_scene(message);
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_act", {fuzz::bytes_of(kMessage)}, read_message);
}
