#!/usr/bin/env bash
# gmsh meshes the surface of a plate, Flexel bends it, gmsh checks the result and fills the bent shape with tetrahedra.
#     gmsh.sh OUTPUT_FOLDER
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:?a folder for the results is missing}
mkdir -p "$out"

gmsh "$here/plate.geo" -2 -format stl -bin -o "$out/plate.stl" -v 2
flexel-voxelize "$out/plate.stl" --size 1mm |
  flexel-simulate "$here/press.toml" |
  flexel-map --format stl >"$out/bent.stl"
gmsh "$out/bent.stl" -check -v 4 | tee "$out/gmsh.txt"
cat >"$out/fill.geo" <<GEO
Merge "bent.stl";
Surface Loop(1) = Surface{:};
Volume(1) = {1};
GEO
gmsh "$out/fill.geo" -3 -format msh2 -o "$out/bent.msh" -v 2
