#!/bin/bash
# SPDX-License-Identifier: MIT
# Grain size on the section x = 65 mm when the tool has passed it: runs the pass and draws the section.
#   bash benchmarks/section.sh [whole|short|coarse|aa5005] [RANKS]
# whole:  the pass from the plate's edge until the tool's rear edge is behind the section (43.4 s)
# short:  the tool is plunged at x = 50 mm into the cold plate and travels 25.2 mm: 14.4 s
# coarse: the same in 2 s with particles 1.33 mm apart, faster travel and more mass scaling: a test of
#         the chain, not a result
# aa5005: whole, for the aluminium plate
# Results: section_KIND.out in the current directory; a run that was stopped goes on.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
kind=${1:-whole}
ranks=${2:-$(nproc)}
input=$root/input/fsp_copper_two_phase_1mm.nml
sets=()
case $kind in
  whole) sets=(--set TIME.END=43.4) ;;
  short) sets=(--set TOOL.POSITION=50e-3,20e-3,12.0266e-3 --set TIME.END=14.4) ;;
  coarse)
    sets=(--set TOOL.POSITION=56e-3,20e-3,12.5816e-3 --set TIME.END=2.0 --set TIME.MASS_SCALING=1e6
          --set GRID.CELL=2.6666666666666667e-3 --set GRID.LOWER=-5.333333333333333e-3,-5.333333333333333e-3,0
          --set "GRID.UPPER=106.6e-3,45.3e-3,24e-3" --set "MOTION(1).DURATION=0.4"
          --set "MOTION(1).VELOCITY=0,0,-2.8e-3" --set "MOTION(2).VELOCITY=12e-3,0,0"
          --set OUTPUT.FRAME_INTERVAL=0.25)
    ;;
  aa5005)
    input=$root/input/fsp_aa5005_two_phase_1mm.nml
    sets=(--set TIME.END=38.6)
    ;;
  *)
    sed -n '4,11p' "$0" >&2
    exit 2
    ;;
esac
directory=section_$kind.out
name=$(basename "$input" .nml)
if [[ -f $directory/${name}_checkpoint.h5 ]]; then
  sets+=(--restart "$directory/${name}_checkpoint.h5")
fi
if ((EUID == 0)); then
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
mpirun -n "$ranks" "$root/build/release/stirpoint" "$input" "${sets[@]}" --output "$directory"
"$root/build/venv/bin/python" -m stirpost section "$directory" --x 65e-3
"$root/build/venv/bin/python" -m stirpost report "$directory"
