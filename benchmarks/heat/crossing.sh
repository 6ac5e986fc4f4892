#!/bin/bash
# SPDX-License-Identifier: MIT
# Cost of a simulated second of the plain copper plate by each integrator and cell size, one rank:
# processor seconds of one step of 0.05 s; the explicit integrator makes as many as are stable.
#   benchmarks/heat/crossing.sh [PROGRAM]
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
program=${1:-$root/build/release/stirpoint}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
printf '%-8s %-14s %-8s %12s\n' cell integrator solver 'cpu s per s'
for method in rkl2/auto explicit/auto tr-bdf2/fftw tr-bdf2/petsc; do
  for cell in 1e-3 0.5e-3 0.25e-3; do
    out=$work/$cell-${method/\//-}
    "$program" "$root/input/heat_copper_plain.nml" --quiet --output "$out" --set TIME.END=0.05 \
      --set OUTPUT.FRAME_INTERVAL=0 --set GRID.CELL=$cell --set HEAT.INTEGRATOR="${method%/*}" \
      --set HEAT.SOLVER="${method#*/}" --set HEAT.STEP=0.05 >/dev/null
    seconds=$(sed -n 's/.*"cpu_seconds": \([^,]*\),/\1/p' "$out"/*_summary.json)
    printf '%-8s %-14s %-8s %12.2f\n' "$cell" "${method%/*}" "${method#*/}" \
      "$(echo "$seconds" | awk '{print $1/0.05}')"
  done
done
