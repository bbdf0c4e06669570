// Names that writers put where they have none.
#include "formats/part/part_name.h"

#include <gtest/gtest.h>

namespace flexel {
namespace {

TEST(PartName, WhatWritersPutForWantOfOneSaysNothing) {
  for (const char* name :
       {"COMPOUND", "SOLID", "Solid-2", "mesh_0", "Mesh.001", "object 3",
        "Open CASCADE STEP translator 7.6 1", "OpenSCAD_Model", "Exported from Blender-2.80 (sub 0)",
        "Created by Gmsh", "vcg", "Document", "unnamed"})
    EXPECT_TRUE(says_nothing(name)) << name;
}

TEST(PartName, PeoplesNamesAreKept) {
  for (const char* name :
       {"bracket", "solid_rocket", "meshed gear", "patch1", "bodyA", "gear 1", "nut-2", "sides#1:5:2",
        "object holder", "12", "Moving_Jaw_SO101 v1", "shell bracket 2", "Body1", "x"})
    EXPECT_FALSE(says_nothing(name)) << name;
}

}  // namespace
}  // namespace flexel
