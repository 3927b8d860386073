#!/usr/bin/env python3
"""Draws bolt_and_nut.png beside this file. usage: /usr/bin/python3 make.py PATH_TO_IST

A bolt and its nut as meshes; as the inner spheres that fill them, a wedge cut out; and what a query
sums, the lenses where their matched spheres overlap once the nut sits a quarter pitch too high.
Needs numpy and matplotlib (./dev setup --bench).
"""
import pathlib
import subprocess
import sys
import tempfile

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402
from PIL import Image  # noqa: E402  (matplotlib needs it)

SPHERES = "10000"
NUT_AT_REST, NUT_TOO_HIGH = 8.0, 8.5  # [u] one turn of the thread is 2 u

BOLT, NUT, LENS = np.array([[0.46, 0.58, 0.72], [0.93, 0.67, 0.30], [0.86, 0.10, 0.22]])
SCALE = 39  # pixels a unit, about twice those of the picture
WIDTH, HEIGHT = 760, 1060

# Rows of CAMERA: right, up, towards the eye, which stands before -y once all is turned about z.
ELEVATION, TURN = np.radians(22), np.radians(-12)
CAMERA = np.array([[1, 0, 0], [0, np.sin(ELEVATION), np.cos(ELEVATION)],
                   [0, -np.cos(ELEVATION), np.sin(ELEVATION)]])
CAMERA = CAMERA @ np.array([[np.cos(TURN), -np.sin(TURN), 0], [np.sin(TURN), np.cos(TURN), 0],
                            [0, 0, 1]])
LIGHTS = [(np.array([-0.45, 0.55, 0.85]), 0.72), (np.array([0.8, 0.0, 0.6]), 0.30)]
CENTRE = np.array([0, 0, 10.0])
WEDGE = [np.radians(-135) - TURN, np.radians(-45) - TURN]  # of the angle about z: what is cut out


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def camera_of(points):
    return (points - CENTRE) @ CAMERA.T


class Canvas:
    def __init__(self):
        self.depth = np.full((HEIGHT, WIDTH), -np.inf)
        self.normal = np.zeros((HEIGHT, WIDTH, 3))
        self.colour = np.ones((HEIGHT, WIDTH, 3))

    def window(self, low, high):
        """Slices of the pixels of a box, and their coordinates in the camera's frame."""
        x0, x1 = (int(np.clip(v * SCALE + WIDTH / 2, 0, WIDTH)) for v in (low[0], high[0] + 1))
        y0, y1 = (int(np.clip(HEIGHT / 2 - v * SCALE, 0, HEIGHT))
                  for v in (high[1] + 1, low[1] - 1))
        x, y = np.meshgrid((np.arange(x0, x1) + 0.5 - WIDTH / 2) / SCALE,
                           (HEIGHT / 2 - 0.5 - np.arange(y0, y1)) / SCALE)
        return (slice(y0, y1), slice(x0, x1)), x, y

    def put(self, at, hit, depth, normal, colour):
        hit = hit & (depth > self.depth[at])
        self.depth[at][hit] = depth[hit]
        self.normal[at][hit] = np.broadcast_to(normal, depth.shape + (3,))[hit]
        self.colour[at][hit] = colour

    def sphere(self, centre, radius, colour, cut=None):
        at, x, y = self.window(centre[:2] - radius, centre[:2] + radius)
        dx, dy = x - centre[0], y - centre[1]
        inside = radius * radius - dx * dx - dy * dy
        hit, half = inside > 0, np.sqrt(np.maximum(inside, 0))
        near, far = centre[2] + half, centre[2] - half
        normal = np.stack([dx, dy, half], axis=-1) / radius
        if cut is not None:  # a ray leaves the wedge where it meets the first plane
            leave, face = cut.exit(x, y)
            removed = near > leave
            normal[removed] = face[removed]
            hit &= ~(removed & (leave <= far))
            near = np.where(removed, leave, near)
        self.put(at, hit, near, normal, colour)

    def triangle(self, corners, normal, colour):
        at, x, y = self.window(corners.min(0), corners.max(0))
        a, b, c = corners
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area <= 1e-9 or x.size == 0:
            return
        u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
        v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
        w = 1 - u - v
        weights = np.stack([u, v, w], axis=-1)
        edge = -1e-3
        hit = (u >= edge) & (v >= edge) & (w >= edge)
        self.put(at, hit, weights @ corners[:, 2], normal, colour)

    def image(self):
        seen = np.isfinite(self.depth)
        light = 0.34 + 0.08 * self.normal[..., 1]
        for direction, strength in LIGHTS:
            light = light + strength * np.maximum(self.normal @ unit(direction), 0)
        shine = np.maximum(self.normal @ unit(unit(LIGHTS[0][0]) + np.array([0, 0, 1])), 0) ** 40
        shaded = self.colour * (light * self.openness())[..., None] + 0.18 * shine[..., None]
        return np.where(seen[..., None], np.clip(shaded, 0, 1), 1)

    def openness(self):
        """Darkens what lies behind its neighbours in the picture."""
        seen = np.isfinite(self.depth)
        floor = self.depth[seen].min() - 3
        depth = np.where(seen, self.depth, floor)
        dark = 0
        for pixels, reach in ((5, 0.5), (14, 1.2), (36, 3.0)):
            dark = dark + np.clip((blur(depth, pixels) - depth) / reach, 0, 1)
        return 1 - 0.75 * np.clip(dark / 1.6, 0, 1)


class Cut:
    """What is left when the wedge between two half planes through the z axis is taken away."""

    def __init__(self):
        low, high = WEDGE  # the wedge is in front of both: n · x > 0
        self.normals = [np.array([-np.sin(low), np.cos(low), 0]),
                        np.array([np.sin(high), -np.cos(high), 0])]

    def exit(self, x, y):
        leave, face = np.full(x.shape, -np.inf), np.zeros(x.shape + (3,))
        origin = CAMERA @ -CENTRE
        for normal in self.normals:
            n = CAMERA @ normal
            z = origin[2] - (n[0] * (x - origin[0]) + n[1] * (y - origin[1])) / n[2]
            later = z > leave
            leave = np.where(later, z, leave)
            face[later] = n
        return leave, face


def blur(values, pixels):
    """Two passes of a box filter, down the columns and along the rows."""
    width = 2 * pixels + 1
    for axis in (0, 1, 0, 1):
        lines = np.moveaxis(values, axis, 0)
        total = np.cumsum(np.pad(lines, ((pixels + 1, pixels), (0, 0)), "edge"), axis=0)
        values = np.moveaxis((total[width:] - total[:-width]) / width, 0, axis)
    return values


def read_obj(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([row[1:4] for row in rows if row and row[0] == "v"], float)
    faces = np.array([[int(corner.split("/")[0]) for corner in row[1:4]]
                      for row in rows if row and row[0] == "f"])
    return vertices, faces - 1


def draw_mesh(canvas, vertices, faces, colour):
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for points, normal in zip(camera_of(vertices)[faces], unit(flat) @ CAMERA.T):
        if normal[2] > 0:
            canvas.triangle(points, normal, colour)


def shades(radii, colour):
    """Small spheres a little darker and richer, large ones lighter."""
    t = np.clip(np.log(radii / 0.06) / np.log(4 / 0.06), 0, 1)[:, None]
    return colour * (0.80 + 0.10 * t) + 0.30 * t * (1 - colour)


def draw_spheres(canvas, spheres, colour, cut=None):
    radii = spheres[:, 3]
    for centre, radius, shade in zip(camera_of(spheres[:, :3]), radii, shades(radii, colour)):
        canvas.sphere(centre, radius, shade, cut)


def lenses(a, b):
    """Centres and radii of the discs in which spheres of a and b meet."""
    found = []
    for x, y, z, r in a:
        way = b[:, :3] - (x, y, z)
        d = np.linalg.norm(way, axis=1)
        for j in np.nonzero((d < r + b[:, 3]) & (d > abs(r - b[:, 3])))[0]:
            along = (d[j] ** 2 + r * r - b[j, 3] ** 2) / (2 * d[j])
            disc = np.sqrt(max(r * r - along * along, 0))
            found.append([*(np.array([x, y, z]) + way[j] / d[j] * along), disc])
    return np.array(found)


def main(ist):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        meshes, inner, matched = {}, {}, {}
        for name in ("bolt", "nut"):
            mesh, asset, table = (folder / (name + ending) for ending in (".obj", ".ist", ".csv"))
            subprocess.run([ist, "sample", name, "-o", mesh], check=True)
            subprocess.run([ist, "bake", mesh, "-o", asset, "--spheres", SPHERES, "--quiet"],
                           check=True)
            subprocess.run([ist, "export", asset, "-o", table], check=True)
            meshes[name] = read_obj(mesh)
            rows = np.loadtxt(table, delimiter=",", skiprows=1)
            inner[name], matched[name] = rows[:, :4], rows[:, 4:8]

    up = np.array([0, 0, 1, 0])
    as_mesh, as_spheres, as_overlap = Canvas(), Canvas(), Canvas()
    draw_mesh(as_mesh, *meshes["bolt"], BOLT)
    vertices, faces = meshes["nut"]
    draw_mesh(as_mesh, vertices + up[:3] * NUT_AT_REST, faces, NUT)

    cut = Cut()
    draw_spheres(as_spheres, inner["bolt"], BOLT, cut)
    draw_spheres(as_spheres, inner["nut"] + up * NUT_AT_REST, NUT, cut)

    nut = matched["nut"] + up * NUT_TOO_HIGH
    draw_spheres(as_overlap, matched["bolt"], BOLT * 0.5 + 0.45)
    draw_spheres(as_overlap, nut, NUT * 0.8 + 0.2, cut)
    for *centre, disc in lenses(matched["bolt"], nut):
        as_overlap.sphere(camera_of(np.array(centre)), 1.15 * disc, LENS)

    figure = plt.figure(figsize=(12, 6.1), dpi=100, facecolor="white")
    titles = ["two closed meshes", "filled with spheres\n(cut open here)",
              "where spheres overlap:\nvolume, force, torque"]
    for i, (canvas, title) in enumerate(zip([as_mesh, as_spheres, as_overlap], titles)):
        axes = figure.add_axes([i / 3, 0.10, 1 / 3, 0.90])
        axes.imshow(canvas.image(), interpolation="antialiased")
        axes.axis("off")
        figure.text((i + 0.5) / 3, 0.055, title, ha="center", va="center", fontsize=17,
                    color="#333333")
    # The flanks push the nut down: force/k of the query is (-0.05, 0.27, -79) u².
    axes.annotate("", (0.88, 0.05), (0.88, 0.19), "axes fraction",
                  arrowprops={"color": LENS, "width": 7, "headwidth": 19})
    path = pathlib.Path(__file__).with_name("bolt_and_nut.png")
    figure.savefig(path)
    Image.open(path).convert("RGB").quantize(256, dither=0).save(path, optimize=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: make.py PATH_TO_IST")
    main(sys.argv[1])
