#!/bin/sh
# nut_rates.sh PROGRAM MESHES: the nut at seven rates about 60 Hz. In one run the ratio of its
# way to pitch times turns depends on roundings, 1.00 to 1.05; the mean is within 3 % of 1, and no run
# leaves the helix.
set -eu
for hz in 57 58 59 60 61 62 63; do
  "$1" nut --hz $hz --meshes "$2" || [ $? -eq 3 ]
done | tee /dev/stderr | awk '
  /way over pitch/ { way += $NF; ++runs }
  /FALSE (turns|farthest|tilt)/ { ++off }
  END {
    mean = way / runs
    printf "way over pitch times turns, mean of %d: %.4f\n", runs, mean
    exit !(runs == 7 && off == 0 && mean > 0.97 && mean < 1.03)
  }'
