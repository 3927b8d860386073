#!/usr/bin/env python3
"""Draws frames of an animated .glb of examples/bullet side by side.

usage: /usr/bin/python3 scenes.py FILE.glb OUT.png TIME [TIME …] [--turn DEGREES] [--up DEGREES]

Points are strewn over all triangles and the nearest to the eye kept, pixel by pixel. Needs numpy and
Pillow (python3-matplotlib brings both).
"""
import argparse
import json
import struct

import numpy as np
from PIL import Image

WIDTH, HEIGHT = 300, 360  # pixels of a frame
POINTS = 120_000  # a mesh
COLOURS = np.array([[0.46, 0.58, 0.72], [0.93, 0.67, 0.30], [0.58, 0.72, 0.47], [0.80, 0.52, 0.55]])
LIGHT = np.array([-0.4, -0.5, 0.85])


def read(path):
    data = open(path, "rb").read()
    text = struct.unpack_from("<I", data, 12)[0]
    gltf = json.loads(data[20:20 + text])
    binary = data[28 + text:]

    def accessor(index):
        a = gltf["accessors"][index]
        view = gltf["bufferViews"][a["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[a["type"]]
        flat = np.frombuffer(binary, np.float32, a["count"] * width, view["byteOffset"])
        return flat.reshape(a["count"], width)

    return gltf, accessor


def matrix(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def strew(triangles, count, random):
    """Points on triangles [n, 3, 3], as many on each as its area says, and their normals."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1)
    chosen = random.choice(len(triangles), count, p=area / area.sum())
    u, v = random.random((2, count, 1))
    flip = u + v > 1
    u, v = np.where(flip, 1 - u, u), np.where(flip, 1 - v, v)
    t = triangles[chosen]
    points = t[:, 0] + u * (t[:, 1] - t[:, 0]) + v * (t[:, 2] - t[:, 0])
    return points, cross[chosen] / np.maximum(area[chosen, None], 1e-30)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("glb")
    parser.add_argument("out")
    parser.add_argument("times", nargs="+", type=float)
    parser.add_argument("--turn", type=float, default=25)
    parser.add_argument("--up", type=float, default=25)
    options = parser.parse_args()
    gltf, accessor = read(options.glb)
    random = np.random.default_rng(1)
    clouds = []
    for mesh in gltf["meshes"]:
        positions = accessor(mesh["primitives"][0]["attributes"]["POSITION"]).astype(float)
        clouds.append(strew(positions.reshape(-1, 3, 3), POINTS, random))
    tracks = {}
    for animation in gltf.get("animations", []):
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            key = channel["target"]["node"], channel["target"]["path"]
            tracks[key] = accessor(sampler["input"])[:, 0], accessor(sampler["output"])

    a, b = np.radians(options.turn), np.radians(options.up)
    right = np.array([np.cos(a), np.sin(a), 0])
    ahead = np.array([-np.sin(a) * np.cos(b), np.cos(a) * np.cos(b), -np.sin(b)])
    camera = np.stack([right, np.cross(right, ahead), -ahead])
    frames, box = [], None
    for time in options.times:
        points, normals, colours = [], [], []
        for i, node in enumerate(gltf["nodes"]):
            if "mesh" not in node:
                continue
            t, q = np.array(node["translation"]), np.array(node["rotation"])
            moves = (i, "translation") in tracks
            if moves:
                times, values = tracks[i, "translation"]
                at = min(np.searchsorted(times, time), len(times) - 1)
                t, q = values[at], tracks[i, "rotation"][1][at]
            elif gltf["meshes"][node["mesh"]]["name"] == "box":
                continue  # walls would hide what is inside
            cloud, normal = clouds[node["mesh"]]
            r = matrix(np.asarray(q, float))
            points.append((cloud @ r.T + t) @ camera.T)
            normals.append(normal @ r.T)
            same = sum(n.get("mesh") == node["mesh"] for n in gltf["nodes"])
            colour = COLOURS[(i if same > 1 else node["mesh"]) % len(COLOURS)]
            colours.append(np.tile(colour, (len(cloud), 1)))
        points, normals, colours = map(np.concatenate, (points, normals, colours))
        if box is None:
            low, high = np.percentile(points, 0.01, axis=0), np.percentile(points, 99.99, axis=0)
            box = (low + high) / 2, 0.92 * min(WIDTH / (high - low)[0], HEIGHT / (high - low)[1])
        w, h = WIDTH, HEIGHT
        x = ((points[:, 0] - box[0][0]) * box[1] + w / 2).astype(int)
        y = (h / 2 - (points[:, 1] - box[0][1]) * box[1]).astype(int)
        seen = (x >= 0) & (x < w) & (y >= 0) & (y < h)
        order = np.argsort(points[seen, 2], kind="stable")
        light = 0.35 + 0.65 * np.clip(normals[seen] @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
        image = np.ones((h, w, 3))
        # Farthest first, each as a dab of 3 x 3 pixels, so that nothing shines through.
        dx, dy = np.meshgrid([0, -1, 1], [0, -1, 1])
        columns = np.clip(x[seen][order][:, None] + dx.ravel(), 0, w - 1)
        rows = np.clip(y[seen][order][:, None] + dy.ravel(), 0, h - 1)
        image[rows, columns] = (colours[seen] * light[:, None])[order][:, None]
        frames.append(image)
    Image.fromarray((np.concatenate(frames, 1) * 255).astype(np.uint8)).save(options.out)


main()
