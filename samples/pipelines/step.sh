#!/usr/bin/env bash
# A STEP bracket is bent and twisted and comes out as STEP; gmsh fills both with tetrahedra, writes their volumes, and, where
# there is a screen or xvfb-run, draws them.
#     step.sh OUTPUT_FOLDER
set -euo pipefail
out=${1:?a folder for the results is missing}
mkdir -p "$out"
cd "$out"

make_bracket bracket.step
flexel deform bracket.step --size 3mm --material TPU --fix "bracket/wall side" --move "bracket/tip: 0 12 -15 mm" -o bent.step --force

for part in bracket bent; do
  gmsh "$part.step" -3 -clmax 4 -format msh2 -o "$part.msh" -v 2
  cat >"$part.geo" <<GEO
Merge "$part.step";
Mesh.MeshSizeMax = 4;
Mesh 2;
Mesh.SurfaceFaces = 1;
Mesh.ColorCarousel = 2;
Geometry.Points = 0;
Geometry.CurveWidth = 2;
General.Axes = 0;
General.SmallAxes = 0;
General.BackgroundGradient = 0;
General.GraphicsWidth = 760;
General.GraphicsHeight = 460;
General.Trackball = 0;
General.RotationX = -65;
General.RotationZ = -35;
Print "$part.png";
Exit;
GEO
  if [[ -n ${DISPLAY:-} ]]; then
    gmsh "$part.geo" -v 2
  elif command -v xvfb-run >/dev/null; then
    xvfb-run -a gmsh "$part.geo" -v 2
  fi
done
