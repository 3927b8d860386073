#!/usr/bin/env bash
# V-HACD (vhacdx 0.1.1, the decomposition that trimesh 5.2.0 calls) cuts a convex mesh: of an icosphere it makes all 64 parts that it
# may, and 1 % of the ball is in none of them, so that a body can stand in the surface; of a box it makes one part. With the fill mode
# "raycast", meant for meshes with holes, 96 % of a closed box is in no part.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check vhacdx==0.1.1 trimesh==5.2.0 manifold3d==3.5.4 scipy==1.15.3 numpy==2.2.6
"$folder/venv/bin/python" - <<'END'
import manifold3d
import numpy as np
import trimesh


def solid(vertices, faces):
    return manifold3d.Manifold(manifold3d.Mesh64(np.asarray(vertices, float), np.asarray(faces, np.uint64)))


def decompose(mesh, **options):
    """Parts, and the share of the mesh that is in none of them."""
    parts = [solid(part["vertices"], part["faces"]) for part in trimesh.decomposition.convex_decomposition(mesh, **options)]
    whole = solid(mesh.vertices, mesh.faces)
    return len(parts), (whole - manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add)).volume() / whole.volume()


ball, box = trimesh.creation.icosphere(subdivisions=2), trimesh.creation.box()
assert ball.is_convex and box.is_convex
for name, mesh, options in (("icosphere", ball, {}), ("box", box, {}), ("box", box, {"fillMode": "raycast"})):
    parts, missing = decompose(mesh, **options)
    print(f"{name} {options}: {parts} parts, {missing:.4f} of the volume in none")
    if name == "icosphere":
        assert parts == 64 and 0.005 < missing < 0.02
    elif options:
        assert parts == 64 and missing > 0.9
    else:
        assert parts == 1 and missing < 1e-3
END
