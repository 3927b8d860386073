"""Pictures of placed meshes, for the examples beside this file."""
import numpy as np


def rotations(poses):
    """(n, 3, 3) of (n, 7) poses."""
    w, x, y, z = (poses[:, :4] / np.linalg.norm(poses[:, :4], axis=1, keepdims=True)).T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                     2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                    axis=1).reshape(-1, 3, 3)


def random_rotations(random, count):
    """(count, 4) unit quaternions, evenly spread."""
    q = random.normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


class Scaled:
    """A mesh under a scale, to be drawn."""

    def __init__(self, mesh, scale):
        self.vertices, self.triangles = mesh.vertices * scale, mesh.triangles


def draw(axes, meshes, kinds, poses, colours, up=24, turn=-58):
    """Paints the meshes into axes of matplotlib, far triangles first, shaded.

    meshes: ClosedMesh a kind. kinds: (n,) which one. poses: (n, 7). colours: (n, 3)."""
    e, t = np.radians(up), np.radians(turn)
    right = np.array([-np.sin(t), np.cos(t), 0])
    eye = np.array([np.cos(e) * np.cos(t), np.cos(e) * np.sin(t), np.sin(e)])
    above = np.cross(eye, right)
    light = eye + 0.6 * above - 0.5 * right
    light /= np.linalg.norm(light)
    corners, shades = [], []
    for kind, pose, turned, colour in zip(kinds, poses, rotations(poses), colours):
        mesh = meshes[kind]
        points = (mesh.vertices @ turned.T + pose[4:])[mesh.triangles]
        normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        seen = normals @ eye > 0
        corners.append(points[seen])
        shades.append(np.clip(0.35 + 0.65 * normals[seen] @ light, 0.25, 1)[:, None] * colour)
    corners, shades = np.concatenate(corners), np.concatenate(shades)
    order = np.argsort((corners @ eye).mean(axis=1))
    flat = np.stack((corners @ right, corners @ above), axis=-1)[order]
    from matplotlib.collections import PolyCollection
    axes.add_collection(PolyCollection(flat, facecolors=shades[order], edgecolors=shades[order],
                                       linewidths=0.3))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")
    return lambda points: np.stack((points @ right, points @ above), axis=-1)


def palette(count):
    """(count, 3) soft colours."""
    from matplotlib import colormaps
    return colormaps["Set2"](np.arange(count) % 8)[:, :3]
