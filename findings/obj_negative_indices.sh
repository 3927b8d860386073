#!/usr/bin/env bash
# A negative index of an OBJ counts back from the vertices listed so far: -1 is the last one before the face. trimesh 4.6.8
# counts back from the last vertex of the whole file, so both faces below become the second one. meshio 5.3.5 subtracts
# one as from positive indices: -3, -2, -1 become -4, -3, -2. Neither says anything.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==4.6.8 meshio==5.3.5 numpy==2.2.6
cd "$folder"
venv/bin/python - <<'END'
import meshio, trimesh

text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 -2 -1\n"
open("a.obj", "w").write(text)
heights = trimesh.load("a.obj", force="mesh", process=False).triangles[:, :, 2].tolist()
indices = meshio.read("a.obj").cells_dict["triangle"].tolist()
print("trimesh: z of the faces' corners", heights, "where the first lies at 0, the second at 1")
print("meshio: indices", indices, "where [0, 1, 2] and [3, 4, 5] are meant")
assert heights == [[1, 1, 1], [1, 1, 1]] and indices == [[-4, -3, -2]] * 2
END
