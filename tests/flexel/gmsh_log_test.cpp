// How far gmsh has come, from what it writes.
#include "flexel/export/gmsh_log.h"

#include <gtest/gtest.h>

namespace flexel::mesh_export {
namespace {

TEST(GmshLog, GoesOnByWhatItSaysAndByItsPaceBetween) {
  GmshLog log;
  EXPECT_EQ(log.share(9), 0);
  log.add("Info    : Running 'gmsh mesh.geo'\nInfo    : Meshing 1D...\nInfo    : [ 50%] Meshing cur", 0.2);
  const double first = log.share(0.2);
  EXPECT_GT(first, 0);
  log.add("ve 2 (Line)\n", 0.3);
  EXPECT_GT(log.share(0.3), first);
  log.add(
      "Info    : Done meshing 1D (Wall 0.004485s)\nInfo    : Meshing 2D...\nInfo    : [ 90%] Meshing surface "
      "7\n",
      1);
  const double faces = log.share(1);
  log.add("Info    : Meshing 3D...\n", 1);
  EXPECT_GT(log.share(1), faces);
  EXPECT_GT(log.share(2), log.share(1)) << "it says nothing, and goes on";
  log.add("Info    : It. 500 - 500 nodes created - worst tet radius 1.81 (nodes removed 0 0)\n", 3);
  const double refining = log.share(3);
  log.add("Info    : It. 900 - 900 nodes created - worst tet radius 1.04 (nodes removed 0 0)\n", 4);
  EXPECT_GT(log.share(4), refining + 0.1);
  log.add(
      "Info    : Done meshing 3D (Wall 5.58s)\nInfo    : Optimizing mesh...\nInfo    : Done optimizing "
      "mesh\n",
      6);
  log.add("Info    : Meshing order 2 (curvilinear on)...\nInfo    : [100%] Meshing volume 1 order 2\n", 7);
  EXPECT_LT(log.share(7), 0.5) << "the solids are still to come";
  EXPECT_NEAR(log.share(8), log.share(7) * 8 / 7, 1e-12);
  EXPECT_LE(log.share(1000), 0.9) << "more steps follow";
  log.add("Info    : Optimizing mesh...\nInfo    : Writing 'mesh.msh'...\n", 15);
  EXPECT_GT(log.share(15), 0.9);
  EXPECT_EQ(log.share(1e6), 1);
}

TEST(GmshLog, OfOtherTextIsNothing) {
  GmshLog log;
  log.add("Error   : Unknown curve\n[[[%]\n%]\nworst tet radius -\n", 3);
  EXPECT_EQ(log.share(5), 0);
}

}  // namespace
}  // namespace flexel::mesh_export
