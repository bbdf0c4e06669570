// OpenVDB lies in a module of its own, which is loaded here.
#include "voxelize/classify/sample_distances.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <new>

#include "base/error.h"
#include "base/program/own_program.h"
#include "voxelize/distances/distance_module.h"

namespace flexel::voxelize {
namespace {

#define FLEXEL_TEXT_OF(name) #name
#define FLEXEL_NAME_OF(name) FLEXEL_TEXT_OF(name)

// Loaded once, and never let go.
const FlexelDistanceModule& module() {
  static const FlexelDistanceModule& kModule = []() -> const FlexelDistanceModule& {
    const std::string path = own_program("flexel-distances.so");
    void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* function = library == nullptr ? nullptr : dlsym(library, FLEXEL_NAME_OF(FLEXEL_DISTANCE_MODULE));
    if (function == nullptr)
      throw InputError(fmt::format("{} cannot be loaded: install Flexel and OpenVDB again", path));
    return *reinterpret_cast<FlexelDistanceModuleFunction*>(function)();
  }();
  return kModule;
}

}  // namespace

struct SampleDistances::Grid {
  explicit Grid(void* made) : distances(made) {
    if (distances == nullptr) throw std::bad_alloc();
  }
  ~Grid() { module().destroy(distances); }
  Grid(const Grid&) = delete;
  Grid& operator=(const Grid&) = delete;
  void* distances;
};

SampleDistances::SampleDistances(const PartMesh& mesh, const Range& range) {
  std::vector<double> points;
  points.reserve(3 * mesh.vertices.size());
  for (const Vec3& vertex : mesh.vertices)
    for (int a = 0; a < 3; ++a) points.push_back((vertex[a] - range.begin[a]) * kSamples - .5);
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * mesh.corners.size());
  for (const auto& triangle : mesh.corners) corners.insert(corners.end(), triangle.begin(), triangle.end());
  grid_ = std::make_unique<Grid>(
      module().create(points.data(), mesh.vertices.size(), corners.data(), mesh.corners.size(), kBand));
}
SampleDistances::~SampleDistances() = default;

float SampleDistances::at(int x, int y, int z) const {
  float distance = 0;
  module().read(grid_->distances, x, y, z, 1, &distance);
  return distance;
}

void SampleDistances::voxel(int i, int j, int k, std::array<float, 64>& out) const {
  module().read(grid_->distances, kSamples * i, kSamples * j, kSamples * k, kSamples, out.data());
}

}  // namespace flexel::voxelize
