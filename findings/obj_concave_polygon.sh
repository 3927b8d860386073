#!/usr/bin/env bash
# A polygon of an OBJ may be concave. trimesh 4.6.8 cuts it into a fan about its first corner, whichever that is: an L of
# area 3 has area 3 or 4, and in the second case triangles that overlap and face both ways.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==4.6.8 numpy==2.2.6
cd "$folder"
venv/bin/python - <<'END'
import trimesh

corners = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n"
areas = []
for face in ("f 4 5 6 1 2 3\n", "f 3 4 5 6 1 2\n"):
    open("a.obj", "w").write(corners + face)
    areas.append(round(float(trimesh.load("a.obj", force="mesh").area), 9))
print("areas of the same L from two first corners:", areas)
assert areas == [3, 4], areas
END
