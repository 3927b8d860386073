#!/usr/bin/env bash
# After the array: all shards as one library. Exits 1 if an asset failed or a shard is missing.
set -uo pipefail
out=$1
"$IST" summary "$out"/shards/[0-9]*.json --json >"$out/summary.json"
exec "$IST" summary "$out"/shards/[0-9]*.json
