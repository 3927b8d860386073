#!/usr/bin/env bash
# glTF's KHR_mesh_quantization stores positions as 16-bit integers; gltfpack writes it by default. Of a box of
# 1 x 2 x 3, trimesh 5.2.0 reads plain integers right, but forgets to divide normalised ones by 32767, so that the box is 32767 times
# too large. assimp (by assimp-py 1.1.0) takes the bytes of integers for floats: its box is 1.5e13 wide and flat, or NaN. Neither
# raises an error, though the extension is required.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 assimp-py==1.1.0 numpy==2.2.6
cd "$folder"
"$folder/venv/bin/python" - <<'END'
import json
import struct

import assimp_py
import numpy as np
import trimesh

SIZE = np.array([1.0, 2.0, 3.0])
box = trimesh.creation.box(SIZE)
faces = box.faces.astype(np.uint16).tobytes()


def write(path, normalized, step):
    """A GLB whose node scales the integers back by step."""
    rows = np.zeros((8, 4), np.int16)
    rows[:, :3] = np.round(box.vertices / (1.5 if normalized else step) * (32767 if normalized else 1))
    position = {"bufferView": 0, "componentType": 5122, "normalized": normalized, "count": 8, "type": "VEC3",
                "min": rows[:, :3].min(0).tolist(), "max": rows[:, :3].max(0).tolist()}
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"],
        "nodes": [{"mesh": 0, "scale": [step] * 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [position, {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 64, "byteStride": 8}, {"buffer": 0, "byteOffset": 64, "byteLength": 72}],
        "buffers": [{"byteLength": 136}]}).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + 136))
        file.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
        file.write(struct.pack("<II", 136, 0x004E4942) + rows.tobytes() + faces)


for name, normalized, step in (("plain.glb", False, 0.01), ("normalized.glb", True, 1.5)):
    write(name, normalized, step)
    by_trimesh = trimesh.load_scene(name).extents
    (mesh,) = assimp_py.import_file(name, 0).meshes
    with np.errstate(all="ignore"):
        by_assimp = np.ptp(np.asarray(mesh.vertices).reshape(-1, 3), axis=0)  # before the node's scale
    print(f"{name}: trimesh {np.round(by_trimesh, 3)}, assimp {by_assimp}; stored {SIZE / step if not normalized else SIZE / 1.5}")
    assert np.allclose(by_trimesh, SIZE * (32767 if normalized else 1), rtol=1e-3)
    assert not by_assimp[0] < 1e12 and by_assimp[1] < 1e-30 and by_assimp[2] == 0
END
