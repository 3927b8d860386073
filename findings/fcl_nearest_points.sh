#!/usr/bin/env bash
# Nearest points of FCL's distance, by python-fcl 0.7.0.11, are in the world's frame for two meshes and for two primitives.
# For a mesh and a ball each point is in a frame of its own solid, so that the points are 1.54 apart where the distance
# is 1.34. For a capsule and a mesh they are in the world's frame, but the first point lies on the second solid.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 python-fcl==0.7.0.11 numpy==2.2.6
"$folder/venv/bin/python" - <<'END'
import fcl
import numpy as np
import trimesh


def mesh(one):
    model = fcl.BVHModel()
    model.beginModel(len(one.vertices), len(one.faces))
    model.addSubModel(np.array(one.vertices), np.array(one.faces))
    model.endModel()
    return model


turn = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))[:3, :3]
places = np.array([10.0, 20, 30]), np.array([13.0, 21, 30.5])
box, ball = trimesh.creation.box((2, 2, 2)), trimesh.creation.icosphere(3, 0.5)
told = {}
for name, first, second in (("mesh, mesh", mesh(box), mesh(ball)), ("box, sphere", fcl.Box(2, 2, 2), fcl.Sphere(0.5)),
                            ("mesh, sphere", mesh(box), fcl.Sphere(0.5)),
                            ("capsule, mesh", fcl.Capsule(0.5, 1), mesh(ball))):
    result = fcl.DistanceResult()
    distance = fcl.distance(fcl.CollisionObject(first, fcl.Transform(turn, places[0])),
                            fcl.CollisionObject(second, fcl.Transform(turn.T, places[1])),
                            fcl.DistanceRequest(enable_nearest_points=True), result)
    p, q = (np.array(point) for point in result.nearest_points)
    near_first = np.linalg.norm(p - places[0]) < np.linalg.norm(p - places[1])
    told[name] = abs(np.linalg.norm(p - q) - distance) < 1e-4, near_first
    print(f"{name}: distance {distance:.4f}, points {p.round(3)} and {q.round(3)}, {np.linalg.norm(p - q):.4f} apart")
assert told["mesh, mesh"] == told["box, sphere"] == (True, True), told
assert not told["mesh, sphere"][0] and told["capsule, mesh"] == (True, False), told
END
