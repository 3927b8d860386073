#!/usr/bin/env bash
# Nodes of a scene may scale their mesh. trimesh 5.2.0's scene_to_collision() hands the whole 4 x 4 matrix to FCL, which
# takes it for a rotation: a box of side 2 by its node's scale and one beside it, 0.3 deep in it, do not collide; with
# the scale applied to the vertices they do.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 python-fcl==0.7.0.11 numpy==2.2.6 scipy==1.15.3
"$folder/venv/bin/python" - <<'END'
import numpy as np
import trimesh

beside = np.eye(4)
beside[0, 3] = 1.2
told = []
for scale in (np.diag([2, 2, 2, 1.0]), np.eye(4)):
    box = trimesh.creation.box()
    if (scale == np.eye(4)).all():
        box.apply_scale(2)
    scene = trimesh.Scene()
    scene.add_geometry(box, node_name="large", transform=scale)
    scene.add_geometry(trimesh.creation.box(), node_name="beside", transform=beside)
    boxes = [scene.geometry[g].copy().apply_transform(t).bounds for t, g in (scene.graph[n] for n in scene.graph.nodes_geometry)]
    assert np.isclose(boxes[0][1][0] - boxes[1][0][0], 0.3)
    told.append(trimesh.collision.scene_to_collision(scene)[0].in_collision_internal())
print("boxes that overlap collide: by a node's scale", told[0], ", by scaled vertices", told[1])
assert told == [False, True], told
END
