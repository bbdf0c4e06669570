#!/usr/bin/env bash
# meshio brings any mesh that it reads (PLY, VTK, ...) to STL, Flexel bends it, and meshio takes the bent surface back to the
# format that it came in and the lattice to Abaqus and CalculiX (.inp, hexahedra, metres).
#     meshio.sh PART OUTPUT_FOLDER
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
part=${1:?a part is missing}
out=${2:?a folder for the results is missing}
mkdir -p "$out"
convert() { /usr/bin/python3 -c 'import meshio, sys; meshio.read(sys.argv[1]).write(sys.argv[2])' "$1" "$2"; }

convert "$part" "$out/part.stl"
flexel-voxelize "$out/part.stl" --count 2000 |
  flexel-simulate "$here/press.toml" -o "$out/body.vtu"
flexel-map "$out/body.vtu" -o "$out/bent.stl"
convert "$out/bent.stl" "$out/bent.${part##*.}"
convert "$out/body.vtu" "$out/body.inp"
