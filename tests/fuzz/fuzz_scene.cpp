// Mutated scenes: one that uses most tables, and those of the samples.
#include <algorithm>
#include <filesystem>

#include "base/files/files.h"
#include "simulate/scene/scene.h"
#include "tests/fuzz/driver.h"

namespace {

constexpr const char* kScene = R"(material = "steel"
[materials.gum]
young = "1.5 MPa"
poisson = 0.45
density = "1100 kg/m3"
source = "a data sheet"
[parts.bracket]
material = "gum"
model = "cells"
[gravity]
acceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]
[[fix]]
where = "bracket/1"
axes = "xz"
[[fix]]
where = ["xmin", { box = { min = ["0 mm", "0 mm", "0 mm"], max = ["1 cm", "2 in", "3 m"] } }]
[[load]]
where = { not = { sphere = { centre = ["0 mm", "0 mm", "0 mm"], radius = "30 mm" } } }
force = ["0 N", "0 N", "-100 N"]
[[load]]
where = { half_space = { point = ["0 mm", "0 mm", "0 mm"], normal = [0, 0.5, 1] } }
pressure = "2 bar"
[[move]]
where = "zmax"
displacement = ["0 mm", "1 mm", "0 mm"]
rotation = { axis = [0, 0, 1], through = ["0 mm", "0 mm", "0 mm"], angle = "30 deg" }
[[move]]
where = "ymax"
displacement = ["1 mm", "free", "0 mm"]
[[probe]]
name = "tip"
at = ["80 mm", "20 mm", "3 mm"]
[run]
until = "equilibrium"
tolerance = 1e-7
load_steps = 3
)";

std::vector<flexel::Bytes> corpus() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(FLEXEL_SAMPLES))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<flexel::Bytes> all = {flexel::fuzz::bytes_of(kScene)};
  for (const std::string& file : files) all.push_back(flexel::read_all(file));
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace flexel;
  return fuzz::run(argc, argv, "fuzz_scene", corpus(),
                   [](const std::string& path) { (void)simulate::read_scene(path); });
}
