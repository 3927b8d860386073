#!/usr/bin/env bash
# Boxes that lie face on face either collide or do not. In trimesh 5.2.0 with python-fcl 0.7.0.11 it depends on where: two
# boxes of side 2 whose faces match do not collide, nor if one is 1e-9 deep in the other; the same boxes slid along that
# face do collide. The distance is 0 in all three.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 python-fcl==0.7.0.11 numpy==2.2.6 scipy==1.15.3
"$folder/venv/bin/python" - <<'END'
import numpy as np
import trimesh

told = {}
for name, place in (("matching", (2, 0, 0)), ("1e-9 deep", (2 - 1e-9, 0, 0)), ("slid", (2, 0.5, 0.3))):
    manager = trimesh.collision.CollisionManager()
    at = np.eye(4)
    at[:3, 3] = place
    manager.add_object("a", trimesh.creation.box((2, 2, 2)))
    manager.add_object("b", trimesh.creation.box((2, 2, 2)), at)
    told[name] = manager.in_collision_internal()
    distance = manager.min_distance_internal()
    print(f"{name}: collide {told[name]}, distance {distance}")
    assert distance == 0, distance
assert told == {"matching": False, "1e-9 deep": False, "slid": True}, told
END
