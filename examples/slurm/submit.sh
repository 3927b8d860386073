#!/usr/bin/env bash
# Bakes a library as a job array, a shard a task, and puts the summaries together once all have
# ended. Prints the number of the last job.
# usage: submit.sh MANIFEST OUT CACHE SHARDS [sbatch options…]
# All three paths must lead to the same files on every node. `ist` is taken from PATH, or from $IST.
set -euo pipefail
if [[ $# -lt 4 ]]; then
  sed -n 2,5p "$0" >&2
  exit 2
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
manifest=$(realpath "$1") out=$(realpath -m "$2") cache=$(realpath -m "$3") shards=$4
mkdir -p "$out/shards"
rm -f "$out"/shards/*.json
export IST=${IST:-$(command -v ist)}

# --requeue: a task whose node dies starts again elsewhere, and takes what it had baked from the
# cache. --open-mode: its log goes on.
array=$(sbatch --parsable --job-name=ist-bake --array="1-$shards" --requeue --open-mode=append \
  --output="$out/shards/%a.log" "${@:5}" "$here/shard.sh" "$manifest" "$out" "$cache")
sbatch --parsable --job-name=ist-summary --dependency="afterany:$array" --requeue \
  --output="$out/shards/summary.log" "${@:5}" "$here/summary.sh" "$out"
