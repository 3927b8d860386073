#!/usr/bin/env bash
# A smaller copy of a mesh should be no dearer to measure from. python-fcl 0.7.0.11 (FCL 0.7) takes 90 times as long for the
# distance of a sphere of 20,480 triangles from its copy of a hundred-thousandth of the size as from one of its own size
# (0.9 and 80 ms on one core), and more than ten times as long at a thousandth; at a tenth hardly longer. All are right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 python-fcl==0.7.0.11 numpy==2.2.6 scipy==1.15.3
"$folder/venv/bin/python" - <<'END'
import time

import fcl
import numpy as np
import trimesh

sphere = trimesh.creation.icosphere(5)


def model(scale):
    made = fcl.BVHModel()
    made.beginModel(len(sphere.vertices), len(sphere.faces))
    made.addSubModel(scale * sphere.vertices, sphere.faces)
    made.endModel()
    return made


rng = np.random.default_rng(1)
poses = [(q / np.linalg.norm(q), 2.5 * t / np.linalg.norm(t)) for q, t in ((rng.normal(size=4), rng.normal(size=3)) for _ in range(5))]
whole = fcl.CollisionObject(model(1))
times = {}
for scale in (1, 0.1, 1e-3, 1e-5):
    small, taken = model(scale), []
    for turn, place in poses:
        other = fcl.CollisionObject(small, fcl.Transform(turn, place))
        start = time.process_time()
        found = fcl.distance(whole, other, fcl.DistanceRequest(), fcl.DistanceResult())
        taken.append(time.process_time() - start)
        assert abs(found - (1.5 - scale)) < 2e-3, found
    times[scale] = np.median(taken)
    print(f"copy of {scale:g} times the size: {1e3 * times[scale]:.1f} ms")
assert times[0.1] < 3 * times[1] and times[1e-3] > 5 * times[1] and times[1e-5] > 30 * times[1], times
END
