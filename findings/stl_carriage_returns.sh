#!/usr/bin/env bash
# An ASCII STL is words between white space. One whose lines end by a carriage return alone, as of old Macs, is read by
# trimesh 4.6.8 as a mesh of volume 0 and by meshio 5.3.5 as one without cells, both without an error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==4.6.8 meshio==5.3.5 numpy==2.2.6
cd "$folder"
venv/bin/python - <<'END'
import meshio, trimesh

corners = ("0 0 0", "1 0 0", "0 1 0", "0 0 1")
text = "solid s\n"
for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)):
    text += "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {corners[i]}\n" for i in face)
    text += "endloop\nendfacet\n"
text += "endsolid s\n"
seen = []
for end in ("\n", "\r"):
    open("a.stl", "wb").write(text.replace("\n", end).encode())
    cells = sum(len(block.data) for block in meshio.read("a.stl").cells)
    seen.append((round(6 * float(trimesh.load("a.stl", force="mesh").volume), 9), cells))
print("6 × volume by trimesh, triangles by meshio, of LF and of CR:", seen)
assert seen == [(1, 4), (0, 0)], seen
END
