#!/usr/bin/env bash
# A PLY's elements stand in the order of its header. Where that lists faces before vertices, meshio 5.3.5 reads the
# faces' lines as coordinates and the vertices' lines as faces: other cells, without an error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 numpy==2.2.6
cd "$folder"
venv/bin/python - <<'END'
import meshio

open("a.ply", "w").write(
    "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_indices\nelement vertex 4\n"
    "property float x\nproperty float y\nproperty float z\nend_header\n"
    "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n")
mesh = meshio.read("a.ply")
cells = [(block.type, len(block.data)) for block in mesh.cells]
print("meshio: points", mesh.points.tolist(), "cells", cells, "where a tetrahedron of four triangles is meant")
assert ("triangle", 4) not in cells and mesh.points.tolist()[0] == [3, 0, 2]
END
