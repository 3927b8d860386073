#!/usr/bin/env bash
# One task of the job array: shard I of N. Exits 1 if an asset failed.
set -uo pipefail
manifest=$1 out=$2 cache=$3
part=$out/shards/$SLURM_ARRAY_TASK_ID.json
status=0
"$IST" bake --manifest "$manifest" -o "$out" --cache "$cache" --json \
  --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_MAX" --threads "${SLURM_CPUS_PER_TASK:-1}" \
  >"$part.part" || status=$?
# Whole, or not there: a task that was killed leaves no half of a summary.
mv "$part.part" "$part"
exit "$status"
