// Winding numbers of closed meshes: whole, whatever the point, also where solid angles add up to several turns.
#include <gtest/gtest.h>

#include "tests/voxelize/shapes.h"
#include "voxelize/classify/winding.h"

namespace flexel::voxelize {
namespace {

using namespace shapes;

PartMesh mesh_of(const Mesh& mesh) {
  PartMesh part = std::move(part_meshes(surface(mesh)).front());
  part.vertices = part.world;
  return part;
}

TEST(WindingNumber, IsOneInsideAndNothingOutside) {
  for (const PartMesh& mesh : {mesh_of(box({0, 0, 0}, {1, 1, 1})), mesh_of(icosphere(2, 0.5))}) {
    const WindingNumber winding(mesh, mesh.vertices);
    const bool ball = mesh.corners.size() > 12;
    const Vec3 shift = ball ? Vec3(0, 0, 0) : Vec3(0.5, 0.5, 0.5);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int trial = 0; trial < 2000; ++trial) {
      const Vec3 point(uniform(random), uniform(random), uniform(random));
      const double reach = ball ? point.norm() : point.cwiseAbs().maxCoeff();
      if (reach > 0.47 && reach < 0.503) continue;
      EXPECT_NEAR(winding.at(point + shift), reach < 0.5 ? 1 : 0, 0.05) << point.transpose();
    }
    // Just under the surface the face there is half of all that is seen.
    if (ball) continue;
    EXPECT_NEAR(winding.at(Vec3(0.3, 0.4, 1 - 1e-9)), 1, 1e-6);
    EXPECT_NEAR(winding.at(Vec3(0.3, 0.4, 1 + 1e-9)), 0, 1e-6);
  }
}

// Eight sheets above each other, whose solid angles are more than two turns together.
TEST(WindingNumber, AddsUpMoreThanATurn) {
  PartMesh mesh;
  for (int sheet = 0; sheet < 8; ++sheet) {
    const double z = -1e-3 * (sheet + 1);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vec3& corner : {Vec3(-100, -100, z), Vec3(100, -100, z), Vec3(0, 150, z)})
      mesh.vertices.push_back(corner);
    mesh.corners.push_back({first, first + 1, first + 2});
  }
  EXPECT_NEAR(WindingNumber(mesh, mesh.vertices).at(Vec3(0, 0, 0)), -4, 1e-3);
  for (Corners& corners : mesh.corners) std::swap(corners[1], corners[2]);
  EXPECT_NEAR(WindingNumber(mesh, mesh.vertices).at(Vec3(0, 0, 0)), 4, 1e-3);
}

// A triangle whose half angle is a quarter turn to the bit, twice: the product of both is -1, of no sure side.
TEST(WindingNumber, AddsUpToHalfATurnToTheBit) {
  PartMesh mesh;
  mesh.vertices = {Vec3(3, 0, 0), Vec3(0, 3, 0), Vec3(-1, -2, 2)};
  mesh.corners = {{0, 2, 1}, {0, 2, 1}};
  EXPECT_NEAR(WindingNumber(mesh, mesh.vertices).at(Vec3(0, 0, 0)), -0.5, 1e-12);
  mesh.corners = {{0, 1, 2}, {0, 1, 2}};
  EXPECT_NEAR(WindingNumber(mesh, mesh.vertices).at(Vec3(0, 0, 0)), 0.5, 1e-12);
}

}  // namespace
}  // namespace flexel::voxelize
