#!/usr/bin/env bash
# OpenSCAD makes a clip, Flexel presses its leaves down, admesh looks for damage.
#     openscad.sh OUTPUT_FOLDER
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:?a folder for the results is missing}
mkdir -p "$out"

openscad -q -o "$out/clip.stl" "$here/clip.scad"
flexel-voxelize "$out/clip.stl" --size 1mm |
  flexel-simulate "$here/press.toml" |
  flexel-map --format stl >"$out/pressed.stl"
admesh "$out/pressed.stl" | tee "$out/admesh.txt"
