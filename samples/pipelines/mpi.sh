#!/usr/bin/env bash
# A part is pressed on several ranks, and comes back as a surface (bent.stl). Load steps are kept in out/steps: where a job was
# killed, the next one goes on from there.
#     mpi.sh PART OUTPUT_FOLDER [RANKS]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
part=${1:?a part is missing}
out=${2:?a folder for the results is missing}
ranks=${3:-2}
mkdir -p "$out"

flexel-voxelize "$part" --count 5000 -o "$out/body.vtu"
resume=()
[[ ! -e $out/steps ]] || resume=(--resume "$out/steps")
mpirun --bind-to none --oversubscribe -n "$ranks" "$(command -v flexel-simulate-mpi)" "$here/press.toml" "$out/body.vtu" \
  --checkpoint "$out/steps" "${resume[@]}" -o "$out/bent.vtu"
rm -f "$out/steps"
flexel-map "$out/bent.vtu" -o "$out/bent.stl"
