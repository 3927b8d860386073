"""A motion as an animated glTF, which browsers and Blender show."""

import json
import struct

import mujoco
import numpy as np


class Film:
    """Collects poses of a model's geoms and writes them as one .glb."""

    def __init__(self, model, pictures_per_second=30):
        self._model = model
        self._period = 1 / pictures_per_second
        self._times, self._places, self._turns = [], [], []

    def add(self, data):
        """Takes a picture, if it is time for one."""
        if self._times and data.time < self._times[-1] + self._period * 0.999:
            return
        turns = np.empty((self._model.ngeom, 4))
        for geom in range(self._model.ngeom):
            mujoco.mju_mat2Quat(turns[geom], data.geom_xmat[geom])
        self._times.append(data.time)
        self._places.append(data.geom_xpos.copy())
        self._turns.append(turns)

    def write(self, path):
        """Writes the film; z points up, as in MuJoCo."""
        self._bytes, self._views, self._accessors = bytearray(), [], []
        times = self._put(np.asarray(self._times, np.float32), "SCALAR")
        places = np.asarray(self._places, np.float32)
        turns = np.roll(np.asarray(self._turns, np.float32), -1, axis=2)  # x, y, z, w
        flips = np.sign((turns[1:] * turns[:-1]).sum(2))  # the shorter rotation from picture to picture
        turns[1:] *= np.cumprod(np.where(flips == 0, 1, flips), axis=0)[..., None]
        meshes, nodes, channels, samplers, materials, made = [], [], [], [], [], {}
        for geom in range(self._model.ngeom):
            shape = shape_of(self._model, geom)
            if shape is None or self._model.geom_rgba[geom][3] == 0:
                continue
            key = (int(self._model.geom_type[geom]), int(self._model.geom_dataid[geom]),
                   tuple(self._model.geom_size[geom]), tuple(self._model.geom_rgba[geom]))
            if key not in made:
                made[key] = len(meshes)
                materials.append({"pbrMetallicRoughness": {
                    "baseColorFactor": [float(x) for x in self._model.geom_rgba[geom]],
                    "metallicFactor": 0, "roughnessFactor": 0.6}, "doubleSided": True})
                meshes.append({"primitives": [{
                    "attributes": {"POSITION": self._put(shape[0].astype(np.float32), "VEC3")},
                    "indices": self._put(shape[1].astype(np.uint32).ravel(), "SCALAR"),
                    "material": len(materials) - 1}]})
            for name, values, kind in (("translation", places, "VEC3"), ("rotation", turns, "VEC4")):
                channels.append({"sampler": len(samplers),
                                 "target": {"node": len(nodes), "path": name}})
                samplers.append({"input": times, "interpolation": "LINEAR",
                                 "output": self._put(np.ascontiguousarray(values[:, geom]), kind)})
            nodes.append({"mesh": made[key], "name": self._model.geom(geom).name or f"geom {geom}"})
        half = 0.5 ** 0.5
        nodes.append({"children": list(range(len(nodes))), "rotation": [-half, 0, 0, half]})
        document = {
            "asset": {"version": "2.0", "generator": "ist.mujoco"}, "scene": 0,
            "scenes": [{"nodes": [len(nodes) - 1]}], "nodes": nodes, "meshes": meshes,
            "materials": materials, "accessors": self._accessors, "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._bytes)}],
            "animations": [{"channels": channels, "samplers": samplers}],
        }
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as out:
            out.write(struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(self._bytes)))
            out.write(struct.pack("<II", len(text), 0x4E4F534A) + text)
            out.write(struct.pack("<II", len(self._bytes), 0x004E4942) + self._bytes)

    def _put(self, array, kind):
        self._views.append({"buffer": 0, "byteOffset": len(self._bytes), "byteLength": array.nbytes})
        self._bytes += array.tobytes()
        rows = array.reshape(len(array), -1)
        self._accessors.append({
            "bufferView": len(self._views) - 1, "count": len(array), "type": kind,
            "componentType": 5126 if array.dtype == np.float32 else 5125,
            "min": rows.min(0).tolist(), "max": rows.max(0).tolist()})
        return len(self._accessors) - 1


def shape_of(model, geom):
    """Vertices and triangles of a geom in its own frame; None for what is not drawn."""
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    types = mujoco.mjtGeom
    if kind in (types.mjGEOM_MESH, types.mjGEOM_SDF) and model.geom_dataid[geom] >= 0:
        mesh = model.mesh(int(model.geom_dataid[geom]))
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        face, faces = int(mesh.faceadr[0]), int(mesh.facenum[0])
        return model.mesh_vert[first:first + count], model.mesh_face[face:face + faces]
    if kind == types.mjGEOM_PLANE:
        half = [s if s > 0 else 20 * model.stat.extent for s in size[:2]]
        return (np.array([[x * half[0], y * half[1], 0] for x in (-1, 1) for y in (-1, 1)]),
                np.array([[0, 2, 1], [1, 2, 3]]))
    if kind == types.mjGEOM_BOX:
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size
        quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    if kind in (types.mjGEOM_SPHERE, types.mjGEOM_CAPSULE, types.mjGEOM_CYLINDER,
                types.mjGEOM_ELLIPSOID):
        return turned_profile(kind, size)
    return None


def turned_profile(kind, size, around=32, along=16):
    """Balls, capsules, cylinders and ellipsoids: a profile turned about z."""
    types = mujoco.mjtGeom
    angle = np.linspace(-np.pi / 2, np.pi / 2, along + 1)
    if kind == types.mjGEOM_CYLINDER:
        radius, height = size[0] * np.array([0, 1, 1, 0]), size[1] * np.array([-1, -1, 1, 1])
    else:
        radius, height = np.cos(angle) * size[0], np.sin(angle) * size[0]
        if kind == types.mjGEOM_CAPSULE:
            height = height + np.where(angle < 0, -size[1], size[1])
        if kind == types.mjGEOM_ELLIPSOID:
            radius, height = np.cos(angle), np.sin(angle)
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    points = np.stack([np.outer(radius, np.cos(turn)), np.outer(radius, np.sin(turn)),
                       np.repeat(height[:, None], around, 1)], -1).reshape(-1, 3)
    if kind == types.mjGEOM_ELLIPSOID:
        points = points * size
    row, column = np.meshgrid(np.arange(len(radius) - 1), np.arange(around), indexing="ij")
    a, b = row * around + column, row * around + (column + 1) % around
    quads = np.stack([a, b, b + around, a + around], -1).reshape(-1, 4)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
