#!/usr/bin/env bash
# Builds every benchmark, or the NAMEs alone, runs them one after another and writes
# benchmarks/results: a JSON file each, pages and plots. Nothing else should run meanwhile.
# usage: benchmarks/run.sh [--quick] [--build DIR] [--results DIR] [NAME…]
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=$root/build-bench
results=$root/benchmarks/results
quick=()
names=()
while [ $# -gt 0 ]; do
  case $1 in
    --quick) quick=(--quick) ;;
    --build) build=$2; shift ;;
    --results) results=$2; shift ;;
    -*) sed -n '4s/^# //p' "$0" >&2; exit 2 ;;
    *) names+=("$1") ;;
  esac
  shift
done

cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DIST_BUILD_BENCHMARKS=ON
if [ ${#names[@]} -eq 0 ]; then
  cmake --build "$build" --target benchmarks
else
  cmake --build "$build" --target "${names[@]}"
fi
mkdir -p "$results"
if [ ${#names[@]} -eq 0 ]; then
  for program in "$build"/bin/benchmarks/*; do names+=("$(basename "$program")"); done
fi
failed=()
for name in "${names[@]}"; do
  echo "== $name"
  "$build/bin/benchmarks/$name" --out "$results/$name.json" "${quick[@]}" || failed+=("$name")
done
# apt installs matplotlib for the system's own interpreter
/usr/bin/python3 "$root/benchmarks/tables.py" "$results"
[ ${#failed[@]} -eq 0 ] || { echo "failed: ${failed[*]}" >&2; exit 1; }
