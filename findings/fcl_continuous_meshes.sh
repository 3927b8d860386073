#!/usr/bin/env bash
# Continuous collision of meshes in python-fcl 0.7.0.11. Conservative advancement should find every contact, and does so for a box
# and a ball as primitives. For the same two as meshes it answers that they do not collide, whether the ball touches the
# wall, stops in it or flies through, with 10 iterations or 1,000. The naive solver asks at as many poses as iterations: with the
# 10 of the default it misses a wall of 0.05 between two of them, and of a fast ball.
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


NAIVE, ADVANCEMENT = 0, 1
meshes = mesh(trimesh.creation.box((0.05, 2, 2))), mesh(trimesh.creation.icosphere(2, 0.1))
primitives = fcl.Box(0.05, 2, 2), fcl.Sphere(0.1)


def hits(pair, end, solver, iterations):
    request = fcl.ContinuousCollisionRequest(num_max_iterations=iterations, ccd_solver_type=solver)
    result = fcl.ContinuousCollisionResult()
    start = np.array([-1.07, 0.013, 0.017])
    fcl.continuousCollide(
        fcl.CollisionObject(pair[0], fcl.Transform()), fcl.Transform(),
        fcl.CollisionObject(pair[1], fcl.Transform(start)), fcl.Transform(start + [end + 1.07, 0, 0]), request, result)
    return bool(result.is_collide), result.time_of_contact


for end in (-0.11, 0, 1, 5):
    true = (1.07 - 0.125) / (end + 1.07)
    told = {name: hits(pair, end, ADVANCEMENT, 10) for name, pair in (("primitives", primitives), ("meshes", meshes))}
    told["meshes, 1,000 iterations"] = hits(meshes, end, ADVANCEMENT, 1000)
    told["meshes, naive, 10"] = hits(meshes, end, NAIVE, 10)
    told["meshes, naive, 1,000"] = hits(meshes, end, NAIVE, 1000)
    print(f"contact at {true:.4f}:", {name: (hit, round(time, 4)) for name, (hit, time) in told.items()})
    assert told["primitives"][0] and abs(told["primitives"][1] - true) < 1e-3
    assert not told["meshes"][0] and not told["meshes, 1,000 iterations"][0]
    assert told["meshes, naive, 1,000"][0] and told["meshes, naive, 10"][0] == (end < 5)
END
