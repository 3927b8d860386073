#!/usr/bin/env bash
# A glTF accessor may be sparse: some of its rows are replaced by others that stand elsewhere in the file. trimesh 5.2.0 and MeshLab
# (pymeshlab 2025.7) read the rows before the replacement, so that a box of volume 6 has volume 3, without an error; the accessor's
# own minimum and maximum say otherwise. assimp (by assimp-py 1.1.0) reads the box.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 assimp-py==1.1.0 pymeshlab==2025.7.post1 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import json
import struct

import assimp_py
import numpy as np
import pymeshlab
import trimesh

box = trimesh.creation.box((1, 2, 3))
vertices = box.vertices.astype(np.float32)
moved = np.flatnonzero(vertices[:, 0] > 0).astype(np.uint16)
stored = vertices.copy()
stored[moved, 0] = 0  # half of the box: the other half is in the sparse rows
parts = [stored.tobytes(), box.faces.astype(np.uint16).tobytes(), moved.tobytes(), vertices[moved].tobytes()]
starts = np.cumsum([0] + [len(part) for part in parts]).tolist()
text = json.dumps({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": vertices.min(0).tolist(),
         "max": vertices.max(0).tolist(),
         "sparse": {"count": len(moved), "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 3}}},
        {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": len(part)} for start, part in zip(starts, parts)],
    "buffers": [{"byteLength": starts[-1]}]}).encode()
text += b" " * (-len(text) % 4)
data = b"".join(parts)
with open("box.glb", "wb") as file:
    file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data)))
    file.write(struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data)

by_trimesh = trimesh.load_mesh("box.glb").volume
meshes = pymeshlab.MeshSet()
meshes.load_new_mesh("box.glb")
by_meshlab = meshes.get_geometric_measures()["mesh_volume"]
(mesh,) = assimp_py.import_file("box.glb", 0).meshes
by_assimp = np.prod(np.ptp(np.asarray(mesh.vertices).reshape(-1, 3), axis=0))
print(f"volume 6: trimesh {by_trimesh:.3f}, MeshLab {by_meshlab:.3f}, assimp {by_assimp:.3f}")
assert abs(by_trimesh - 3) < 1e-6 and abs(by_meshlab - 3) < 1e-6 and abs(by_assimp - 6) < 1e-6
END
