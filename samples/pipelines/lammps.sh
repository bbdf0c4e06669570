#!/usr/bin/env bash
# LAMMPS steps a part that swings, element by element as Flexel would; Flexel takes back the motion (swing.pvd) and the
# part as it is at the end (bent.stl).
#     lammps.sh PART OUTPUT_FOLDER [RANKS]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
part=${1:?a part is missing}
out=${2:?a folder for the results is missing}
ranks=${3:-1}
mkdir -p "$out"

flexel export "$part" --scene "$here/swing.toml" --size "2 mm" --lammps -o "$out/swing.in"
lammps=(lmp)
[[ $ranks == 1 ]] || lammps=(mpirun --bind-to none --oversubscribe -np "$ranks" lmp)
(cd "$out" && "${lammps[@]}" -in swing.in -log none >lammps.txt)
flexel import-lammps "$out/swing.dump" "$out/swing.vtu" -o "$out/swing.pvd"
flexel-map "$out/swing_00010.vtu" -o "$out/bent.stl"
