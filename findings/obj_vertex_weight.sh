#!/usr/bin/env bash
# A vertex of an OBJ may have a fourth number, the weight of a rational curve or surface, which polygons do not have. assimp divides
# the coordinates by it: a box with weights of 2 is half as large by assimp-py 1.1.0, and by Coal 3.0.3, whose loader is assimp;
# trimesh 5.2.0 and meshio 5.3.5 read the box as it stands. None says a word.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check assimp-py==1.1.0 coal==3.0.3 trimesh==5.2.0 meshio==5.3.5 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import assimp_py
import coal
import meshio
import numpy as np
import trimesh

box = trimesh.creation.box((1, 2, 3))
for weight in ("", " 1.0", " 2.0"):
    with open("box.obj", "w") as file:
        file.writelines(f"v {x} {y} {z}{weight}\n" for x, y, z in box.vertices)
        file.writelines(f"f {a} {b} {c}\n" for a, b, c in box.faces + 1)
    (mesh,) = assimp_py.import_file("box.obj", 0).meshes
    shape = coal.MeshLoader().load("box.obj", np.ones(3))
    shape.computeLocalAABB()
    sizes = {"assimp": np.ptp(np.asarray(mesh.vertices).reshape(-1, 3), axis=0),
             "Coal": shape.aabb_local.max_ - shape.aabb_local.min_, "trimesh": trimesh.load_mesh("box.obj").extents,
             "meshio": np.ptp(meshio.read("box.obj").points[:, :3], axis=0)}
    print(f"weight{weight or ' none'}:", ", ".join(f"{name} {np.round(size, 3)}" for name, size in sizes.items()))
    for name, size in sizes.items():
        halved = weight == " 2.0" and name in ("assimp", "Coal")
        assert np.allclose(size, np.array([1, 2, 3]) / (2 if halved else 1)), name
END
