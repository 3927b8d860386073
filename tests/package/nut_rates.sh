#!/bin/sh
# nut_rates.sh PROGRAM MESHES: the nut at seven rates about 60 Hz. How far a nut turns in a run is a
# matter of roundings; in the mean its way is pitch times turns within 3 %, and no run leaves the
# helix.
set -eu
for hz in 58 59 59.5 60 60.5 61 62; do
  "$1" nut --hz $hz --meshes "$2" || [ $? -eq 3 ]
done | tee /dev/stderr | awk '
  /way over pitch/ { way += $NF; ++runs }
  /FALSE (turns|farthest|tilt)/ { ++off }
  END {
    mean = way / runs
    printf "way over pitch times turns, mean of %d: %.4f\n", runs, mean
    exit !(runs == 7 && off == 0 && mean > 0.97 && mean < 1.03)
  }'
