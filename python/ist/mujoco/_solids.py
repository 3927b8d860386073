"""The solid of a mesh of a scene: read from its file, baked, and kept in a folder."""

import dataclasses
import hashlib
import os
import pathlib
import tempfile
import warnings

import ist
import mujoco
import numpy as np


@dataclasses.dataclass
class Solid:
    path: pathlib.Path
    asset: ist.Asset


def of_mesh(spec, model, mesh, name, folder, spheres, measure, repair, findings):
    vertices, faces = _from_file(spec, model, mesh, name)
    key = hashlib.sha256(f"{ist._core._bake_revision} {repair} ".encode() + vertices.tobytes() + faces.tobytes())

    def made(spheres):
        path = folder / f"{key.hexdigest()[:32]}{f'-{spheres}' if spheres else ''}.ist"
        if path.exists():
            try:
                return Solid(path, ist.Asset.load(path))
            except ist.Error:  # of another format: baked again
                pass
        closed = ist.close_mesh(ist.Mesh(vertices, faces), name=name, repair=repair)
        if closed.report.notes:
            findings.append(f"{name}: {'; '.join(closed.report.notes)}")
        asset = ist.bake(closed, max_spheres=spheres) if spheres else ist.bake_mesh_only(closed)
        part = path.with_suffix(f".{os.getpid()}")
        asset.save(part)
        os.replace(part, path)  # another process may bake the same
        return Solid(path, asset)

    if measure in ("matched", "inner"):
        return made(spheres)
    solid = made(0)
    if solid.asset.mesh_triangles > 0:
        return solid
    if measure == "exact":
        raise ist.Error(f"{name}: its mesh cannot serve the exact measure: {solid.asset.mesh_state}")
    return made(spheres)


def _from_file(spec, model, mesh, name):
    """Vertices and triangles in the frame that MuJoCo reads a mesh in, with its scale."""
    vertices, faces = _of_model(model, mesh)
    entry = next((m for m in spec.meshes if m.name == name), None)
    try:
        loaded = _loaded(spec, model, mesh)
        if loaded is None or entry is None:
            return vertices, faces
    except ist.Error as error:
        _warn(f"mesh {name!r} is MuJoCo's copy, since its file is not read: {error}")
        return vertices, faces
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, entry.refquat / np.linalg.norm(entry.refquat))
    own = (loaded.vertices - entry.refpos) @ turn.reshape(3, 3) * entry.scale
    triangles = np.ascontiguousarray(loaded.triangles[:, ::-1] if np.prod(entry.scale) < 0 else loaded.triangles)
    size = np.ptp(vertices, axis=0).max()
    if np.abs(_box(own) - _box(vertices)).max() > 1e-4 * size:
        _warn(f"mesh {name!r} is MuJoCo's copy, which lies elsewhere than its file")
        return vertices, faces
    volume, area = _moments(own, triangles)
    copied, copied_area = _moments(vertices, faces)
    if abs(volume - copied) > 1e-3 * abs(volume) or abs(area - copied_area) > 1e-3 * area:
        _warn(f"mesh {name!r}: MuJoCo's copy differs from its file: {len(faces)} of {len(triangles)} triangles, "
              f"volume {copied:.4g} for {volume:.4g}, area {copied_area:.4g} for {area:.4g}. The solid is the file's")
    return own, triangles


def _of_model(model, mesh):
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
    vertices = model.mesh_vert[first:first + count].astype(float) @ turn.reshape(3, 3).T + model.mesh_pos[mesh]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return vertices, np.ascontiguousarray(model.mesh_face[first:first + count], dtype=np.uint32)


def _loaded(spec, model, mesh):
    """The mesh of a file, or None without one: ist reads other files in other ways than MuJoCo does."""
    start = model.mesh_pathadr[mesh]
    path = pathlib.Path(os.fsdecode(model.paths[start:].split(b"\0", 1)[0]) if start >= 0 else "")
    if path.suffix.lower() not in (".obj", ".stl"):
        return None
    # MuJoCo finds assets by the last part of their names.
    held = [name for name in spec.assets if pathlib.Path(name).name == path.name]
    if not held:
        return ist.load_mesh(path)
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / path.name
        copy.write_bytes(spec.assets[min(held, key=lambda name: not str(path).endswith(name))])
        return ist.load_mesh(copy)


def _box(vertices):
    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _moments(vertices, triangles):
    """Signed volume and area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    return np.einsum("ij,ij->", a, across) / 6, np.linalg.norm(across, axis=1).sum() / 2


def _warn(text):
    warnings.warn(f"ist.mujoco: {text}", stacklevel=5)
