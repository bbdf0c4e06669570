// Mutated lines of poses that lead a tool while a run goes on, and as keys of its path.
#include <fstream>

#include "base/error.h"
#include "simulate/rigid/live_tool.h"
#include "tests/fuzz/driver.h"

namespace {

using namespace flexel;

constexpr const char* kPoses =
    "# a tool\ntool 0 0 0 0\n0.001 1e-3 0 0\n0.002, 1e-3, 2e-3, 0, 0.1, 0, 3.2\n\ntool 0.003 0 0 0 0.7071 0 "
    "0.7071 0\n"
    "0.004 0 0 -1e-3 0 0 -3.1\nend\n";

void lead(const std::string& path) {
  const Bytes bytes = read_all(path);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  simulate::LiveTool led, keyed;
  double now = 0;
  for (std::size_t begin = 0, number = 1; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string place = "stdin:" + std::to_string(number);
    const auto pose = simulate::parse_pose_line(text.substr(begin, end - begin), place);
    begin = end + 1;
    if (!pose) continue;
    if (pose->end) break;
    led.lead_to(*pose, now += 1e-4, 1e-3);
    led.forget(now);
    keyed.add_key(*pose, place);
  }
}

}  // namespace

int main(int argc, char** argv) {
  return fuzz::run(argc, argv, "fuzz_pose", {fuzz::bytes_of(kPoses)}, lead);
}
