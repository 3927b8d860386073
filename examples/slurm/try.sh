#!/usr/bin/env bash
# Bakes a small library on a Slurm of two nodes, started on this machine, one of which dies meanwhile
# and comes back; then holds the result against a bake without Slurm.
# usage: try.sh IST DIR    DIR is emptied. Exits 77 where Slurm or root is missing.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
export IST
IST=$(realpath "$1")
rm -rf "$2"
mkdir -p "$2/meshes"
cd "$2"

for program in slurmctld slurmd munged unshare pkill; do
  if ! command -v "$program" >/dev/null; then
    echo "skipped: no $program here; ./dev setup --slurm installs it"
    exit 77
  fi
done
if [[ $(id -u) != 0 ]]; then
  echo "skipped: Slurm's daemons want root"
  exit 77
fi

echo "== a library of twelve"
shapes=(gear bolt nut capsule)
for shape in "${shapes[@]}"; do "$IST" sample "$shape" -o "meshes/$shape.obj" >/dev/null; done
{
  printf '[defaults]\nspheres = 1500\n'
  for shape in "${shapes[@]}"; do
    for seed in 1 2 3; do
      printf '\n[[asset]]\nmesh = "meshes/%s.obj"\nname = "%s-%s"\nseed = %s\n' \
        "$shape" "$shape" "$seed" "$seed"
    done
  done
} >library.toml

echo "== a cluster of two nodes"
# shellcheck source=cluster.sh
source "$here/cluster.sh"
trap stop_cluster EXIT
start_cluster cluster
sinfo -N

echo "== a job array of three shards"
last=$("$here/submit.sh" library.toml out cache 3)

# A shard that runs on n2, once it has baked something.
victim() {
  local task
  for task in $(squeue -h -w n2 -t R -n ist-bake -o %K); do
    if grep -qs ': baked in' "out/shards/$task.log"; then
      echo "$task"
      return 0
    fi
  done
  return 1
}
wait_for victim >/dev/null
task=$(victim)
kill_node n2
before=$(grep -c ': baked in' "out/shards/$task.log")
echo "== n2 died in shard $task, of which $before assets were baked"
scontrol update nodename=n2 state=down reason="it died"
squeue -o '%F_%K %j %T %r'
if [[ -e out/shards/$task.json ]]; then
  echo "the shard had ended already: nothing was tried" >&2
  exit 1
fi
start_node n2
wait_for nodes_are_back

done_all() { [[ -z $(squeue -h -j "$last" 2>/dev/null) ]]; }
for _ in 1 2 3; do wait_for done_all 2>/dev/null && break; done
echo "== all shards together"
cat out/shards/summary.log

"$IST" bake --manifest library.toml -o whole --quiet
for asset in whole/*.ist; do cmp "$asset" "out/${asset#whole/}"; done
count() { grep -c "\"status\": \"$2\"" "$1" || true; }
cached=$(count "out/shards/$task.json" cached)
if [[ $(count out/summary.json baked) != $((12 - cached)) || $cached -lt $before ]]; then
  echo "shard $task baked again what it had baked: $before before, $cached from the cache" >&2
  exit 1
fi
echo "== the bytes of a bake without Slurm; $cached assets of shard $task came from the cache"
